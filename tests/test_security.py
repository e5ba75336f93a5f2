"""What the code of the package never does, whatever a file says: SECURITY.md promises it, and here it is read from the
code itself."""

import ast
import io
from pathlib import Path

import numpy as np
import pytest

import fieldalign as fa
from fieldalign.cli.poses import read_pose

SOURCE = Path(fa.__file__).parent
MODULES = {path.relative_to(SOURCE).as_posix(): ast.parse(path.read_text("utf-8")) for path in SOURCE.rglob("*.py")}
PICKLING = {"assembly/identity.py", "assembly/work.py", "assembly/on_dask.py", "assembly/processes.py"}
UNPICKLING = {  # what worker processes of this run sent, or what it wrote for them into a folder that is only its own
    "assembly/on_dask.py": ["pickle.loads"], "assembly/processes.py": ["pickle.load", "pickle.loads"],
}
LATE = {"__init__.py", "cli/__init__.py", "experiments/__init__.py", "experiments/scenes/streams.py"}  # of one package
FOREIGN_CODE = {"experiments/columns.py": ["spec.loader.exec_module"]}  # adapters in a folder that the user names
PROCESSES = {"cli/demo.py": ["subprocess.run"]}  # this very program


def calls(tree):
    """The calls in a module, and what is called, as it is written there."""
    nodes = (node for node in ast.walk(tree) if isinstance(node, ast.Call))
    return [(ast.unparse(node.func).partition("(")[0], node) for node in nodes]


def where(is_meant):
    """The modules with calls that are meant, and these."""
    found = {name: sorted({called for called, node in calls(tree) if is_meant(called, node)})
             for name, tree in MODULES.items()}
    return {name: called for name, called in found.items() if called}


def imports(tree):
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name.partition(".")[0] for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and not node.level and node.module:
            yield node.module.partition(".")[0]


def importing(*names):
    return {name for name, tree in MODULES.items() if {*names} & {*imports(tree)}}


def test_what_is_looked_for_would_be_found():
    tree = ast.parse("import os.path\nfrom yaml import load\nload(1)\nos.system('a')\nrun('a', shell=True)")
    assert [*imports(tree)] == ["os", "yaml"]
    assert [called for called, _ in calls(tree)] == ["load", "os.system", "run"]
    assert len(MODULES) > 200


def test_no_text_becomes_code():
    builtins = {"eval", "exec", "compile", "__import__"}
    assert where(lambda called, node: called in builtins) == {}
    assert where(lambda called, node: called.endswith(".exec_module")) == FOREIGN_CODE
    assert where(lambda called, node: called.endswith("import_module")).keys() == LATE


def test_nothing_is_unpickled_but_what_a_run_sends_itself():
    assert importing("pickle") == PICKLING
    assert importing("marshal", "shelve", "dill", "cloudpickle", "joblib", "jsonpickle") == set()
    assert where(lambda called, node: called.startswith("pickle.load") or called.endswith("Unpickler")) == UNPICKLING
    assert where(lambda called, node: called.endswith(("torch.load", "read_pickle", "np.fromregex"))) == {}


def test_arrays_are_loaded_without_objects():
    loading = [node for tree in MODULES.values() for called, node in calls(tree) if called in ("np.load", "numpy.load")]
    assert len(loading) >= 4
    for node in loading:
        assert {k.arg: ast.unparse(k.value) for k in node.keywords}.get("allow_pickle") == "False", ast.unparse(node)


def test_no_shell_no_program_but_this_one():
    assert importing("subprocess", "pty", "shlex", "commands") == set(PROCESSES)
    assert where(lambda called, node: called.startswith("subprocess.")) == PROCESSES
    shells = ("os.system", "os.popen", "os.exec", "os.spawn", "os.posix_spawn", "os.startfile")
    assert where(lambda called, node: called.startswith(shells)) == {}
    assert where(lambda called, node: any(k.arg == "shell" for k in node.keywords)) == {}


def test_nothing_is_asked_of_a_network_and_no_archive_is_unpacked_into_files():
    """Dask, which is for other machines, is asked for by name; YAML (of ROS bags) is read by rosbags, which loads it
    safely: tests/odometry/sequences/test_bags.py."""
    assert importing("socket", "urllib", "http", "requests", "ftplib", "smtplib", "xmlrpc", "socketserver") == set()
    assert importing("yaml", "ruamel", "tarfile", "webbrowser") == set()
    unpacking = ("extract", "extractall", "unpack_archive", "mktemp")
    assert where(lambda called, node: called.rpartition(".")[2] in unpacking) == {}


@pytest.mark.parametrize("shape", [(10**12, 4), (0, 10**12), (2**62, 4)])
def test_a_pose_that_lies_takes_no_memory(shape, tmp_path):
    file = io.BytesIO()
    np.lib.format.write_array_header_1_0(file, {"descr": "<f8", "fortran_order": False, "shape": shape})
    (tmp_path / "pose.npy").write_bytes(file.getvalue() + bytes(128))
    with pytest.raises(fa.ArgumentError, match="init must be a file with a 4 x 4 pose or 16 numbers"):
        read_pose(str(tmp_path / "pose.npy"))
