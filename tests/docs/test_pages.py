"""Every page's code runs: its blocks of Python and of fieldalign in the shell, from top to bottom, in one folder."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
BLOCK = re.compile(r"^```(python|sh)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
NEEDED = {"dask": "distributed", "ros2": "rosbags"}  # extras, where a page needs one
SHELL = f'set -e; fieldalign() {{ "{sys.executable}" -m fieldalign "$@"; }}; '


def blocks_of(page):
    """(line, language, code) of each block."""
    text = page.read_text(encoding="utf-8")
    return [(text.count("\n", 0, match.start()) + 2, *match.groups()) for match in BLOCK.finditer(text)]


def pages():
    own = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md")), *sorted((ROOT / "docs/tutorials").glob("*.md"))]
    return [page for page in own if blocks_of(page)]


def run_shell(code, where):
    if os.name == "nt" or shutil.which("bash") is None:
        pytest.skip("the shell's blocks need bash, and paths as it has them")
    done = subprocess.run(["bash", "-c", SHELL + code], capture_output=True, text=True, env=os.environ)
    assert done.returncode == 0, f"{where} ends with {done.returncode}: {done.stderr}"


@pytest.mark.parametrize("page", pages(), ids=lambda page: page.stem)
def test_page(page, tmp_path, monkeypatch, groundwork):
    pytest.importorskip(NEEDED.get(page.stem, "fieldalign"))
    monkeypatch.chdir(tmp_path)
    names = {"__name__": page.stem}
    exec(groundwork.get(page.stem, ""), names)
    for line, language, code in blocks_of(page):
        where = f"{page.relative_to(ROOT)}:{line}"
        if language == "sh":
            run_shell(code, where)
        else:
            exec(compile("\n" * (line - 1) + code, str(page), "exec"), names)
