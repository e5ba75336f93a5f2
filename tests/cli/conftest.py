"""How the tests of the command line run it."""

import pytest

from fieldalign.cli import main


@pytest.fixture
def call(scans, monkeypatch, capsys):
    """Runs a command in the folder of the scans: exit status, stdout, stderr; what it leaves there is removed."""
    folder, _ = scans
    monkeypatch.chdir(folder)
    before = set(folder.rglob("*"))

    def run(*args):
        with pytest.raises(SystemExit) as ended:
            main([str(arg) for arg in args])
        out, err = capsys.readouterr()
        return ended.value.code, out, err

    yield run
    for left in set(folder.rglob("*")) - before:
        left.unlink()
