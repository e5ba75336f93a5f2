"""The model: points of the scans, moved and no more, each with its scan."""

import numpy as np
import pytest
from scipy.spatial import cKDTree

from fieldalign.assembly import fused as module
from fieldalign.assembly.fused import fused
from fieldalign.assembly.scan import read_scan, thinned, write_scan
from fieldalign.motions import apply

VOXEL = 0.1


@pytest.fixture
def scans(corner):
    """Two halves of the corner that overlap, as the assembly keeps them, by index."""
    x = corner[:, 0]
    return {k: thinned(corner[half], f"scan {k}", 1) for k, half in ((2, x < 2), (5, x > 1))}


@pytest.fixture
def poses(rng, any_motion):
    return {k: any_motion(rng, 3.0) if k == 2 else np.eye(4) for k in (2, 5)}


def rows_of(points):
    return {row.tobytes() for row in points}


def test_each_point_is_one_of_its_scan_moved(scans, poses):
    model = fused([2, 5], scans.get, poses, VOXEL, 1)
    origin = model.attributes["scan"]
    assert set(origin.tolist()) == {2, 5}
    for k in (2, 5):
        assert rows_of(model.points[origin == k]) <= rows_of(apply(poses[k], scans[k].points))


def test_the_model_is_thinned_and_covers_all(scans):
    poses = {2: np.eye(4), 5: np.eye(4)}
    model = fused([2, 5], scans.get, poses, VOXEL, 1)
    everything = np.vstack([scans[2].points, scans[5].points])
    assert len(model.points) < 0.6 * len(everything)
    apart, _ = cKDTree(model.points).query(everything)
    assert apart.max() <= np.sqrt(3) * VOXEL
    assert np.allclose(np.linalg.norm(model.normals, axis=1), 1)


def test_normals_are_those_of_the_walls(scans):
    model = fused([2, 5], scans.get, {2: np.eye(4), 5: np.eye(4)}, VOXEL, 1)
    x, y, z = model.points.T
    floor = (z == 0) & (x > 0.4) & (y > 0.4) & ~((x > 0.6) & (x < 2.4) & (y > 0.6) & (y < 2))
    assert floor.sum() > 50
    assert np.median(np.abs(model.normals[floor, 2])) > 0.99


def test_pieces_give_a_model_as_thin(scans, poses, monkeypatch):
    """Where the points are too many to wait together, what is there is thinned before more is read."""
    whole = fused([2, 5], scans.get, poses, VOXEL, 1)
    monkeypatch.setattr(module, "_AT_ONCE", 100)
    pieces = fused([2, 5], scans.get, poses, VOXEL, 1)
    assert set(pieces.attributes["scan"].tolist()) == {2, 5}
    assert 0.8 * len(whole.points) < len(pieces.points) < 1.2 * len(whole.points)


def test_a_scan_is_kept_bit_for_bit(scans, tmp_path):
    write_scan(tmp_path / "scan.npz", scans[2])
    kept = read_scan(tmp_path / "scan.npz")
    assert kept.points.tobytes() == scans[2].points.tobytes()
    assert (kept.eye, kept.voxel, kept.extent, kept.dropped) == (None, scans[2].voxel, scans[2].extent, 0)
