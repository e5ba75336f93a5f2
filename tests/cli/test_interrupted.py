"""Ctrl-C and SIGTERM at random moments of real commands: a file is there whole or not at all, and nothing else."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

import fieldalign as fa
from fieldalign.fields.files import write_mesh

pytest.importorskip("pty", reason="signals as POSIX has them")
SEEDS = int(os.environ.get("FIELDALIGN_INTERRUPTIONS", "2"))  # of each command and signal
LONGEST = 1.2  # seconds until the signal
# A shell may have told its background jobs to ignore Ctrl-C.
PROGRAM = ("import signal; signal.signal(signal.SIGINT, signal.default_int_handler); "
           "from fieldalign.cli import main; main()")
OUTPUTS = "--output {0}/aligned.ply --json {0}/result.json --picture {0}/both.png --report {0}/page.html"
COMMANDS = {
    "register": f"register a.ply b.ply {OUTPUTS}",
    "batch": "batch pairs.csv --output {0}/all.csv --json {0}/all.json --report {0}/page.html --workers 2",
    "assemble": "assemble a.ply b.ply c.ply --output {0}/model.ply --poses-to {0}/poses.json --report {0}/page.html",
    "odometry": "odometry drive --output {0}/out --report {0}/page.html",
    "experiment": "experiment modelnet40 --data data --output {0}/found --limit 2",
    "plot": "plot a.ply b.ply --output {0}/figure.pdf",
}
WHOLE = {
    ".json": lambda path: json.loads(path.read_text()),
    ".ply": fa.read_cloud,
    ".html": lambda path: path.read_text("utf-8").rstrip().endswith("</html>") or pytest.fail("torn"),
    ".png": lambda path: path.read_bytes()[-8:-4] == b"IEND" or pytest.fail("torn"),
    ".pdf": lambda path: path.read_bytes().rstrip().endswith(b"%%EOF") or pytest.fail("torn"),
    ".csv": lambda path: path.read_text()[-1:] in ("\n", "") or pytest.fail("torn"),
    ".txt": lambda path: path.read_text()[-1:] in ("\n", "") or pytest.fail("torn"),
    ".md": lambda path: path.read_text().endswith("\n") or pytest.fail("torn"),
    ".jsonl": lambda path: path.read_text()[-1:] in ("\n", "") or pytest.fail("torn"),
    "": lambda path: path.name == "lock" or pytest.fail("unknown"),  # of a run, which holds nothing
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory, corner, seen_from):
    """Clouds, a list of pairs, and a drive."""
    folder = tmp_path_factory.mktemp("interrupted")
    rng = np.random.default_rng(3)
    for name in "abc":
        fa.write_cloud(folder / f"{name}.ply", corner[rng.permutation(len(corner))[:4000]])
    (folder / "pairs.csv").write_text("source,target\n" + "a.ply,b.ply\n" * 3)
    (folder / "drive").mkdir()
    for k in range(8):
        fa.write_cloud(folder / "drive" / f"{k}.ply", seen_from((0.2 * k, 0, 1.5), k).astype(np.float32))
    u, v = (a.ravel() for a in np.meshgrid(np.linspace(0, 1, 16), np.linspace(0, 0.8, 16), indexing="ij"))
    a = (16 * np.arange(15)[:, None] + np.arange(15)).ravel()
    faces = np.r_[np.c_[a, a + 16, a + 1], np.c_[a + 1, a + 16, a + 17]]
    for category, split in (("piano", "train"), ("sofa", "test")):
        shape = folder / "data" / "ModelNet40" / category / split / f"{category}_0001.off"
        shape.parent.mkdir(parents=True)
        height = 0.5 * np.exp(-20 * ((u - 0.3) ** 2 + (v - 0.2) ** 2)) + np.sin(3 * u) * v**2
        write_mesh(shape, np.c_[u, v, height], faces)
    (folder / "data" / "gt_poses.csv").write_text("0.5,0.2,-0.3,0.1,0.4,-0.2\n-0.1,0.6,0.2,0.3,0,0.1\n")
    return folder


@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM], ids=lambda number: number.name)
@pytest.mark.parametrize("verb", COMMANDS)
def test_a_signal_leaves_nothing_half_written(verb, number, folder, tmp_path):
    rng = np.random.default_rng([number, *map(ord, verb)])
    for seed in range(SEEDS):
        place = tmp_path / str(seed)
        (place / "tmp").mkdir(parents=True)
        process = subprocess.Popen(
            [sys.executable, "-c", PROGRAM, *COMMANDS[verb].format(place).split()], cwd=folder, text=True,
            env=os.environ | {"TMPDIR": str(place / "tmp")}, start_new_session=True,
            stdout=subprocess.PIPE, stderr=subprocess.PIPE,
        )
        moment = rng.uniform(0, LONGEST)
        time.sleep(moment)
        # Ctrl-C goes to all processes of a terminal, a SIGTERM to one.
        if process.poll() is None:
            (os.killpg if number == signal.SIGINT else os.kill)(process.pid, number)
        out, err = process.communicate(timeout=60)
        told = f"after {moment:.3f} s: {process.returncode}\n{out}\n{err}"
        # Python itself may have been starting, here or in a worker.
        starting = any(words in err for words in ("init_import_site", "multiprocessing"))
        assert process.returncode in (0, 3, 128 + number, -number) or starting, told
        if process.returncode == 128 + number:
            assert "Traceback" not in err or starting, told
        assert not list((place / "tmp").iterdir()), told
        for path in place.rglob("*"):
            assert not path.name.startswith("."), told
            if path.is_file():
                check_whole(path, told)


def check_whole(path: Path, told: str) -> None:
    try:
        WHOLE[path.suffix](path)
    except Exception as error:
        raise AssertionError(f"{path.name} is torn: {error}; {told}") from error
