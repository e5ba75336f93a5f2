"""Disks that are full, folders that may not be written, files that vanish: one clear error, and no half of a file."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import fieldalign as fa
from fieldalign.evaluation import evaluate
from fieldalign.experiments.results import write_json
from fieldalign.fields.files import write_mesh
from fieldalign.motions import exp_twist
from fieldalign.odometry import drive

RNG = np.random.default_rng(0)
POINTS = RNG.normal(size=(400, 3)) * [1, 0.8, 0.3]
POSES = np.stack([exp_twist(np.array([0, 0, 0.01 * k, 0.1 * k, 0, 0])) for k in range(100)])
TRAJECTORY = fa.Trajectory(np.arange(100.0), POSES)
VERTICES, FACES = POINTS, np.stack([np.arange(398), np.arange(1, 399), np.arange(2, 400)], axis=1)


def report(path):
    from fieldalign.reports import write_report

    pair = fa.prepare(POINTS), fa.prepare(POINTS)
    write_report(fa.register(*pair, init=np.eye(4)), *pair, path)


def picture(path):
    from fieldalign.reports.picture import before_and_after

    before_and_after(POINTS, POINTS, np.eye(4), path, "a picture")


def histogram(path):
    from fieldalign.reports.histogram import deviation_histogram

    deviation_histogram(fa.deviation(POINTS, POINTS), path, "a histogram")


def way(path):
    from fieldalign.reports.trajectory_picture import trajectory_picture

    trajectory_picture(TRAJECTORY, path)


WRITERS = {
    **{f"cloud{suffix}": lambda path: fa.write_cloud(path, POINTS)
       for suffix in (".ply", ".pcd", ".xyz", ".csv", ".npy", ".npz", ".bin", ".las", ".laz", ".e57")},
    **{f"mesh{suffix}": lambda path: write_mesh(path, VERTICES, FACES) for suffix in (".ply", ".stl", ".obj", ".off")},
    "tum.txt": lambda path: fa.write_trajectory(path, TRAJECTORY),
    "kitti.txt": lambda path: fa.write_trajectory(path, TRAJECTORY, "kitti"),
    "results.json": lambda path: write_json(evaluate(TRAJECTORY, TRAJECTORY).to_dict(), path),
    "report.html": report, "picture.png": picture, "histogram.svg": histogram, "way.pdf": way,
}


def write(name, path):
    pytest.importorskip("pye57" if name.endswith("e57") else "laspy" if ".la" in name else "numpy")
    WRITERS[name](path)


@pytest.mark.parametrize("name", WRITERS)
def test_a_full_disk_is_one_clear_error_and_the_old_file_stays(tmp_path, full, name):
    path = tmp_path / name
    path.write_bytes(b"what was there before")
    with full(100), pytest.raises(fa.FieldalignError, match="cannot be written") as raised:
        write(name, path)
    assert str(path) in str(raised.value)
    assert os.listdir(tmp_path) == [name]
    assert path.read_bytes() == b"what was there before"


@pytest.mark.parametrize("name", ["cloud.bin", "cloud.ply", "cloud.npy", "cloud.xyz"])
def test_a_disk_that_is_full_by_the_last_bytes(tmp_path, full, name):
    """They may lie in a buffer until the file is closed."""
    fa.write_cloud(tmp_path / name, POINTS[:10])
    whole = (tmp_path / name).read_bytes()
    with full(len(whole) - 1), pytest.raises(fa.CloudFileError, match="cannot be written"):
        fa.write_cloud(tmp_path / name, POINTS[:10])
    assert os.listdir(tmp_path) == [name]
    assert (tmp_path / name).read_bytes() == whole


@pytest.mark.parametrize("name", [name for name in WRITERS if name not in ("report.html", "picture.png", "way.pdf")])
def test_a_folder_that_may_not_be_written_is_one_clear_error(read_only, as_nobody, name):
    path = read_only / name
    path.write_bytes(b"what was there before")
    with as_nobody(read_only), pytest.raises(fa.FieldalignError, match="cannot be written"):
        write(name, path)
    assert os.listdir(read_only) == [name]


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="there is no disk that is always full")
def test_a_full_disk_behind_stdout_is_one_line(tmp_path):
    fa.write_cloud(tmp_path / "cloud.ply", POINTS)
    paths = os.pathsep.join([str(Path(fa.__file__).parents[1]), *filter(None, [os.environ.get("PYTHONPATH")])])
    command = [sys.executable, "-m", "fieldalign", "register", "cloud.ply", "cloud.ply", "--json", "-"]
    with open("/dev/full", "wb") as stdout:
        ended = subprocess.run(command, cwd=tmp_path, env=os.environ | {"PYTHONPATH": paths}, stdout=stdout,
                               stderr=subprocess.PIPE, text=True, check=False)
    assert ended.returncode == 1
    assert ended.stderr == "Error: the output cannot be written: No space left on device\n"


# ------------------------------------------------------------------------------------------------------ whole runs


@pytest.fixture
def clouds(tmp_path):
    (tmp_path / "in").mkdir()
    paths = [tmp_path / "in" / f"{k}.ply" for k in range(3)]
    for k, path in enumerate(paths):
        fa.write_cloud(path, POINTS[k::3])
    return [str(path) for path in paths]


RUNS = {
    "assemble": lambda clouds, folder: fa.assemble(clouds, run_folder=folder),
    "register_many": lambda clouds, folder: fa.register_many([(clouds[0], clouds[1])], run_folder=folder),
    "in processes": lambda clouds, folder: fa.register_many([(POINTS, POINTS[:300])], run_folder=folder, executor=1),
}


@pytest.mark.parametrize(("name", "room"), [
    ("assemble", 0), ("assemble", 100), ("assemble", 1000), ("assemble", 4000), ("register_many", 0),
    ("register_many", 300), ("in processes", 1000),
])
def test_a_run_without_room_is_one_clear_error_and_goes_on_when_there_is(tmp_path, clouds, full, name, room):
    with full(room), pytest.raises(fa.RunError, match=r"full|cannot be written"):
        RUNS[name](clouds, tmp_path / "run")
    assert str(RUNS[name](clouds, tmp_path / "run")) == str(RUNS[name](clouds, None))


@pytest.mark.parametrize("room", [0, 1000, 3000])
def test_a_drive_keeps_all_lines_for_which_there_was_room(tmp_path, full, room):
    (tmp_path / "drive").mkdir()
    for k in range(12):
        fa.write_cloud(tmp_path / "drive" / f"{k:02}.ply", POINTS + [0.01 * k, 0, 0])
    frames = fa.read_sequence(tmp_path / "drive")
    with full(room), pytest.raises(fa.RunError, match="cannot be written"):
        drive.run(frames, fa.Odometry(), tmp_path / "out")
    lines = (tmp_path / "out" / "trajectory_kitti.txt").read_bytes().splitlines(keepends=True)
    assert all(line.endswith(b"\n") and len(line.split()) == 12 for line in lines)
    assert bool(lines) == (room > 0)
    assert "summary.json" not in os.listdir(tmp_path / "out")


@pytest.mark.parametrize("name", RUNS)
def test_a_run_folder_that_may_not_be_written_is_one_clear_error(read_only, as_nobody, name):
    for path in (clouds := [str(read_only / f"{k}.ply") for k in range(3)]):
        fa.write_cloud(path, POINTS)
    with as_nobody(read_only), pytest.raises(fa.RunError, match="cannot be written"):
        RUNS[name](clouds, read_only / "run")


# -------------------------------------------------------------------------------------------------------- vanishing


@pytest.mark.parametrize("name", [name for name in WRITERS if name.startswith("cloud")])
@pytest.mark.parametrize("how", ["gone", "empty", "half"])
def test_a_file_that_vanishes_while_it_is_read_is_one_clear_error(tmp_path, monkeypatch, name, how):
    """Behind the check that it is there, and while its size is already known."""
    path = tmp_path / name
    write(name, path)
    whole = path.read_bytes()

    def vanish(*_):
        if how == "gone":
            path.unlink()
        else:
            path.write_bytes(whole[: (len(whole) // 2 + 1) * (how == "half")])

    monkeypatch.setattr("fieldalign.clouds.files.check_existing", vanish)
    with pytest.raises(fa.CloudFileError, match=str(path)):
        fa.read_cloud(path)


def test_a_file_that_shrinks_between_its_size_and_its_bytes(tmp_path, monkeypatch):
    fa.write_cloud(tmp_path / "a.bin", POINTS)
    stat = Path.stat

    def shrinks(path, **options):
        found = stat(path, **options)
        if path.suffix == ".bin":
            os.truncate(path, 1000)
        return found

    monkeypatch.setattr(Path, "stat", shrinks)
    with pytest.raises(fa.CloudFileError, match=r"a\.bin"):
        fa.read_cloud(tmp_path / "a.bin")
