"""The command line as a shell sees it: quick help, completion, quiet and verbose, progress, exit status."""

import json
import os
import signal
import subprocess
import sys
import time
from contextlib import suppress

import numpy as np
import pytest

import fieldalign as fa
from fieldalign.cli import VERBS, cli, loudness, progress
from fieldalign.clouds import files
from fieldalign.errors import ArgumentError
from fieldalign.evaluation.absolute import ALIGNMENTS
from fieldalign.evaluation.relative import UNITS
from fieldalign.experiments import NAMES
from fieldalign.odometry.sequences.sweeps import SWEEPS
from fieldalign.odometry.trajectory_files import FORMATS

pty = pytest.importorskip("pty", reason="terminals and signals as POSIX has them")


@pytest.fixture(scope="module")
def scans(tmp_path_factory, corner):
    """A folder with two clouds."""
    folder = tmp_path_factory.mktemp("shell")
    fa.write_cloud(folder / "a.ply", corner)
    fa.write_cloud(folder / "b.ply", corner + [0.1, 0.2, 0.0])
    return folder, None


# --------------------------------------------------------------------------------------------------------------- help


def test_help_of_every_verb_loads_no_numpy():
    code = ("import sys, fieldalign.cli as c\n"
            "for args in [['--help'], *[[verb, '-h'] for verb in c.VERBS]]:\n"
            "    try: c.main(args)\n"
            "    except SystemExit as end: assert not end.code, args\n"
            "print('loaded:', [name for name in ('numpy', 'scipy', 'matplotlib', 'trimesh') if name in sys.modules])")
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert done.stdout.splitlines()[-1] == "loaded: []"
    assert done.stdout.count("-q, --quiet") == len(VERBS) + 1


@pytest.mark.parametrize(("verb", "option", "names"), [
    ("register", "settings", tuple(fa.PRESETS)), ("evaluate", "align", ALIGNMENTS), ("evaluate", "unit", UNITS),
    ("evaluate", "form", ("auto", *FORMATS)), ("odometry", "sweep", SWEEPS), ("experiment", "name", tuple(NAMES)),
])
def test_choices_are_those_of_the_library(verb, option, names):
    """They are written out so that --help loads no library."""
    parameter = next(p for p in cli.get_command(None, verb).params if p.name == option)
    assert tuple(parameter.type.choices) == tuple(names)


# --------------------------------------------------------------------------------------------------------- completion


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_the_script_of_a_shell_is_printed(call, shell):
    status, out, _ = call("completion", shell)
    assert status == 0
    assert "_FIELDALIGN_COMPLETE" in out


def completed(words: str, at: int) -> str:
    env = os.environ | {"_FIELDALIGN_COMPLETE": "bash_complete", "COMP_WORDS": words, "COMP_CWORD": str(at)}
    return subprocess.run([sys.executable, "-m", "fieldalign"], env=env, capture_output=True, text=True).stdout


@pytest.mark.parametrize(("words", "at", "expected"), [
    ("fieldalign od", 1, "plain,odometry"), ("fieldalign register --sc", 2, "plain,--scale"),
    ("fieldalign register a.p", 2, "file,"), ("fieldalign register a.ply --method pa", 4, "plain,paper"),
    ("fieldalign plot --quie", 2, "plain,--quiet"),
])
def test_verbs_options_values_and_files_are_completed(words, at, expected):
    assert expected in completed(words, at)


# -------------------------------------------------------------------------------------------------- quiet and verbose


def test_verbose_tells_each_step_on_stderr(call):
    status, out, err = call("register", "a.ply", "b.ply", "--json", "-", "--verbose")
    assert status == 0
    assert json.loads(out)["accepted"]
    assert [line.split(":")[0] for line in err.splitlines() if "done in" in line] == [
        "reading source", "reading target", "aligning", "writing"]


@pytest.mark.parametrize("arguments", [("-q", "register"), ("register", "-q"), ("register",)], ids=" ".join)
def test_quiet_leaves_warnings_out_before_and_after_the_verb(call, corner, arguments):
    far = corner.astype(np.float32) + np.float32([5e5, 5e6, 0])
    np.save("far.npy", far)
    status, out, err = call(*arguments, "far.npy", "far.npy")
    assert status in (0, 3)
    assert out.startswith("T_target_source =")
    assert ("Warning: " in err) == ("-q" not in arguments)


def test_an_error_is_told_however_quiet(call):
    assert call("register", "none.ply", "b.ply", "-q")[2].startswith("Error: none.ply")
    status, _, err = call("register", "none.ply", "b.ply", "-v")
    assert status == 1
    assert "Traceback" in err
    assert err.splitlines()[-1].startswith("Error: none.ply")
    status, _, err = call("register", "a.ply", "b.ply", "-q", "-v")
    assert (status, err.count("\n")) == (1, 1)
    assert "exclude each other" in err


# ------------------------------------------------------------------------------------------------------------ progress


@pytest.fixture
def told(monkeypatch, capsys):
    """What is told of a step that takes a third of a second, in the lines of a log."""
    loudness.reset()
    monkeypatch.setattr(progress, "_LINE_AFTER", 0.1)
    monkeypatch.setattr(progress, "_NEXT_LINE", 0.1)
    monkeypatch.setattr(progress, "_NEXT_PICTURE", 0.02)
    return lambda: capsys.readouterr().err.splitlines()


def test_a_long_step_has_a_first_line_some_and_a_last(told):
    with progress.bar() as tell:
        tell("registering", 0, 10)
        time.sleep(0.3)
        tell("registering", 5, 10)
        time.sleep(0.3)
        tell("registering", 10, 10)
    lines = told()
    assert lines[0] == "registering: 10"
    assert any(line.startswith("registering: 5 of 10 after 0:0") and line.endswith(" left") for line in lines)
    assert lines[-1].startswith("registering: done in 0.")
    assert 3 <= len(lines) <= 9


def test_a_quick_step_is_not_told(told, monkeypatch):
    monkeypatch.setattr(progress, "_LINE_AFTER", 5.0)
    with progress.bar() as tell:
        for k in range(1001):
            tell("registering", k, 1000)
    assert told() == []


def test_the_bar_goes_when_something_is_raised(told):
    with suppress(ArgumentError), progress.bar() as tell:
        tell("registering", 0, None)
        raise ArgumentError("no")
    assert told() == []


def test_a_terminal_sees_a_bar_with_the_time_that_is_left():
    code = ("import time; from fieldalign.cli import progress; progress._BAR_AFTER = 0.0\n"
            "with progress.bar() as tell:\n"
            "    for k in range(5): tell('registering', k, 4); time.sleep(0.3)\n")
    seen = in_terminal([sys.executable, "-c", code])
    assert "registering [" in seen
    assert "#" in seen
    assert " of 4" in seen
    assert " left" in seen
    assert seen.endswith("\r\x1b[K")
    assert "\n" not in seen


def in_terminal(command, **env):
    """What a command writes to a terminal of its own."""
    ours, theirs = pty.openpty()
    process = subprocess.Popen(command, stdin=theirs, stdout=theirs, stderr=theirs, env=os.environ | env)
    os.close(theirs)
    text = b""
    while True:
        try:
            some = os.read(ours, 65536)
        except OSError:  # Linux says so when the other end is closed
            break
        if not some:
            break
        text += some
    os.close(ours)
    assert process.wait() == 0, text.decode()
    return text.decode()


# ------------------------------------------------------------------------------------------------------------- signals


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM], ids=lambda number: number.name)
def test_the_exit_status_names_the_signal(call, number, monkeypatch):
    before = signal.getsignal(signal.SIGTERM)
    monkeypatch.setattr("fieldalign.cli.register.read_dof", lambda *_: os.kill(os.getpid(), number))
    status, out, err = call("register", "a.ply", "b.ply")
    assert status == 128 + number
    assert (out, err.strip()) == ("", "")
    assert signal.getsignal(signal.SIGTERM) is before


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM], ids=lambda number: number.name)
def test_a_file_that_is_half_written_goes(call, scans, number, monkeypatch):
    """The older one of that name stays."""
    folder = scans[0]
    (folder / "moved.ply").write_bytes(b"older")

    def interrupted(path, cloud):
        path.write_bytes(b"ply\nhalf")
        os.kill(os.getpid(), number)
        time.sleep(1)

    monkeypatch.setitem(files.FORMATS, ".ply", files.FORMATS[".ply"]._replace(write=interrupted))
    status, _, _ = call("register", "a.ply", "b.ply", "--output", "moved.ply")
    assert status == 128 + number
    assert (folder / "moved.ply").read_bytes() == b"older"
    assert sorted(path.name for path in folder.iterdir()) == ["a.ply", "b.ply", "moved.ply"]
