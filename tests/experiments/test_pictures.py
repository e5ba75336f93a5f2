"""The experiments that are pictures: whole files, what is in them, and the same bits for a seed."""

import json

import numpy as np
import pytest
from scipy.spatial import cKDTree

from fieldalign.assembly.executor import as_executor
from fieldalign.experiments import NAMES, Request, figures, run
from fieldalign.experiments.pictures.distance_field import slice_of
from fieldalign.experiments.pictures.floor_plan import floor_plan
from fieldalign.experiments.pictures.pseudo_sets import drawn_sets
from fieldalign.fields import PointField
from fieldalign.reports.painting import Window

TETRAHEDRON = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"
PICTURES = "distance-field", "pseudo-sets", "data-examples"


@pytest.fixture(autouse=True)
def coarse(monkeypatch):
    """Coarse pictures are drawn faster."""
    monkeypatch.setattr(figures, "_DPI", 60)


def room(rng, count):
    """A corner of a room with boxes in it, in a camera's frame: y looks down."""
    parts = [rng.uniform((-2, 1.2, 0), (2, 1.2, 4), (count, 3)), rng.uniform((-2, -1, 4), (2, 1.2, 4), (count, 3)),
             rng.uniform((2, -1, 0), (2, 1.2, 4), (count, 3))]
    for x, z in ((-1, 2), (0.5, 3), (1.2, 1)):
        faces = rng.uniform(-0.3, 0.3, (count // 3, 3))
        faces[np.arange(len(faces)), rng.integers(0, 3, len(faces))] = rng.choice([-0.3, 0.3], len(faces))
        parts.append(faces + [x, 0.9, z])
    return np.concatenate(parts)


def street(rng, count):
    """Road, walls and cars, in a sensor's frame."""
    return (room(rng, count) @ np.array([[0, -1, 0], [0, 0, -1], [1, 0, 0]]) - [2, 0, 0]) * [10, 5, 1.5]


@pytest.fixture
def part(tmp_path, rng):
    """A folder like this project's part of the data sets, but small."""
    data = tmp_path / "data"
    for folder in ("modelnet40", "meshes", "3dmatch", "kitti00", "kitti_10m_pairs"):
        (data / folder).mkdir(parents=True)
    shapes = rng.normal(size=(5, 600, 3))
    shapes *= 0.5 / np.linalg.norm(shapes, axis=2, keepdims=True)
    np.savez(data / "modelnet40/airplane.npz", names=[f"airplane_{k}" for k in range(5)], xyz=shapes.astype("f4"))
    for k in range(4):
        (data / f"meshes/00{k}.obj").write_text(TETRAHEDRON)
    shifted = np.eye(4)
    shifted[0, 3] = 0.5
    for place, cloud in (("3dmatch/kitchen_0_1", room), ("3dmatch/kitchen_0_2", room), ("3dmatch/kitchen_0_3", room),
                         ("kitti_10m_pairs/000", street)):
        np.savez(data / f"{place}.npz", source=cloud(rng, 500) - shifted[:3, 3], target=cloud(rng, 500),
                 target_from_source=shifted)
    for k in range(2):
        np.savez(data / f"kitti00/00000{k}.npz", xyz=street(rng, 4000).astype("f4"))
    np.savez(data / "kitti00/poses.npz", frames=[0, 1],
             world_from_lidar_semantickitti=np.stack([np.eye(4), shifted]))
    return data


def request(data, folder, seed=0):
    folder.mkdir(exist_ok=True)
    return Request(data, folder, as_executor(None), seed)


@pytest.mark.parametrize("name", PICTURES)
def test_png_pdf_and_what_is_shown(name, part, tmp_path):
    from matplotlib.image import imread

    report = run(name, request(part, tmp_path / "out"))
    assert [file.name for file in report.files] == [f"{name}.png", f"{name}.pdf", f"{name}.json"]
    assert sorted(file.name for file in (tmp_path / "out").iterdir()) == sorted(file.name for file in report.files)
    image = imread(report.files[0])
    assert image.shape[1] == round(60 * figures.COLUMN)
    assert 0.05 < (image[..., :3].min(axis=2) < 0.9).mean() < 0.95  # neither empty nor full
    assert report.files[1].read_bytes().startswith(b"%PDF")
    said = json.loads(report.files[2].read_text())
    assert said["experiment"] == name
    assert said["seed"] == 0
    assert said["versions"]["numpy"] == np.__version__
    assert said["shown"]
    for sentence in said["protocol"]:
        assert sentence in report.text


@pytest.mark.parametrize("name", PICTURES)
def test_same_seed_same_picture(name, part, tmp_path):
    once, again, other = (
        run(name, request(part, tmp_path / folder, seed)).files[0].read_bytes()
        for folder, seed in (("once", 3), ("again", 3), ("other", 4))
    )
    assert once == again
    assert once != other


def test_pseudo_sets_are_those_of_the_method(part, tmp_path):
    sets = drawn_sets(request(part, tmp_path, seed=5))
    again = drawn_sets(request(part, tmp_path, seed=5))
    assert [s.settings.pseudo_set for s in sets] == ["uniform", "uniform", "neighbourhood", "keypoints"]
    for one, other in zip(sets, again, strict=True):
        assert one.pseudo.shape == (1000, 3)
        assert np.array_equal(one.pseudo, other.pseudo)
    uniform, near = (np.median(cKDTree(s.points).query(s.pseudo)[0]) for s in sets[1:3])
    assert near < uniform


def test_slice_has_the_distances_of_its_places():
    rng = np.random.default_rng(0)
    points = rng.uniform(-1, 1, (200, 3))
    found = slice_of(PointField(points), Window(np.array([1.0, 2.0]), 4.0, 2.0), 0.3, rows=10)
    assert found.values.shape == (10, 20)
    first, last = cKDTree(points).query([[-0.9, 1.1, 0.3], [2.9, 2.9, 0.3]])[0]
    assert np.allclose([found.values[0, 0], found.values[-1, -1]], [first, last])


def test_floor_plan():
    plan = floor_plan(1)
    assert np.array_equal(plan, floor_plan(1))
    assert not np.array_equal(plan[:100], floor_plan(2)[:100])
    assert np.ptp(plan, axis=0) == pytest.approx([30, 21], abs=0.1)
    corridor = np.stack([np.linspace(7, 23, 50), np.full(50, 6.0)], axis=1)
    free = cKDTree(plan).query(corridor)[0]
    assert np.median(free) > 0.3  # some doors stand open
    assert np.max(np.diff(np.sort(plan[np.abs(plan[:, 1]) < 0.05, 0]))) < 0.2  # the outer wall has no gap


def test_pictures_can_be_asked_for_by_name():
    assert set(PICTURES) <= set(NAMES)


@pytest.mark.parametrize("name", PICTURES)
def test_on_real_scans(name, data, tmp_path):
    report = run(name, request(data, tmp_path / "out"))
    assert all(file.stat().st_size > 500 for file in report.files)
