"""The package imports a name when it is asked for; whatever is imported first, names are what they should be."""

import ast
import pickle
import subprocess
import sys
from pathlib import Path

import pytest

import fieldalign as fa
from fieldalign.cli import VERBS

SAME_NAME = ("assemble", "prepare", "register", "register_many", "verify")  # functions in files of their names


def answer(code: str) -> str:
    """What a fresh process prints."""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return done.stdout.strip()


def test_editors_and_python_are_told_the_same():
    """The imports for type checkers and the table of homes."""
    tree = ast.parse(Path(fa.__file__).read_text())
    told = {alias.asname: node.module for node in ast.walk(tree) if isinstance(node, ast.ImportFrom) and node.level
            for alias in node.names}
    assert told.pop("fields") is None
    assert told == fa._HOME_OF
    assert sorted([*told, "fields"]) == fa.__all__


def test_importing_loads_no_numpy_until_a_name_asks_for_it():
    code = "import sys, fieldalign as fa; print('numpy' in sys.modules); fa.PointCloud; print('numpy' in sys.modules)"
    assert answer(code).split() == ["False", "True"]


@pytest.mark.parametrize("first", [
    "pass", "import fieldalign.{0}", "from fieldalign.{0} import {0}", "import fieldalign.cli.{0}",
    "import importlib; importlib.import_module('fieldalign.{0}')", "from fieldalign import *",
])
def test_a_function_is_never_its_module(first):
    code = "; ".join([
        *[first.format(name) for name in SAME_NAME if "cli" not in first or name in VERBS],
        "import fieldalign as fa", "import sys",
        *[f"from fieldalign import {name}; import fieldalign.{name}" for name in SAME_NAME],
        f"print(*[callable(getattr(fa, name)) and getattr(fa, name) is globals()[name] is "
        f"getattr(sys.modules['fieldalign.' + name], name) for name in {SAME_NAME}])",
    ])
    assert answer(code).split() == ["True"] * len(SAME_NAME)


def test_all_names_come_by_a_star():
    assert answer("from fieldalign import *; import fieldalign as fa; "
                  "print(all(globals()[name] is getattr(fa, name) for name in fa.__all__), fields.PointField)"
                  ).startswith("True <class")


def test_dir_tells_what_is_not_yet_loaded():
    code = "import fieldalign as fa; print(set(fa.__all__) <= set(dir(fa)), 'register' in vars(fa), fa.__version__)"
    assert answer(code).split() == ["True", "False", fa.__version__]


def test_what_is_pickled_is_found_again():
    values = [getattr(fa, name) for name in (*SAME_NAME, "PointCloud", "Reason")]
    data = pickle.dumps(values)
    assert pickle.loads(data) == values
    assert answer(f"import pickle; print(*[v.__name__ for v in pickle.loads({data!r})])").split() == [
        *SAME_NAME, "PointCloud", "Reason"]


def test_a_name_that_is_not_there_is_an_attribute_error():
    with pytest.raises(AttributeError, match="module 'fieldalign' has no attribute 'regsiter'"):
        _ = fa.regsiter
    with pytest.raises(ImportError, match="cannot import name 'regsiter'"):
        exec("from fieldalign import regsiter")
