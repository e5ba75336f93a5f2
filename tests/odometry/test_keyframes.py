"""Keyframes: what is kept of a whole drive."""

import numpy as np
import pytest

import fieldalign as fa
from fieldalign.odometry.keyframes import fused

SCANS = 150  # 120 metres


@pytest.fixture(scope="module")
def driven(drive):
    odometry = fa.Odometry(whole=True)
    for k in range(SCANS):
        odometry.step(*drive.scan(k))
    return odometry


def test_the_map_of_the_whole_drive_is_kept(driven, drive):
    around, whole = driven._tracker.map.cloud(), driven.map
    assert around.points[:, 0].min() > 50
    assert whole.points[:, 0].min() < 0
    assert whole.points[:, 0].max() > 110
    assert np.allclose(np.linalg.norm(whole.normals, axis=1), 1, atol=1e-5)
    assert whole.attributes["count"].min() >= 5
    near = whole.points[np.abs(whole.points[:, 0] - 50) < 5]
    back = drive.pose_at(0.05)[:3, :3].T @ [40, 0, 0]  # the street is the same every 20 metres
    assert np.median(drive.distance(near - back)) < 0.03


def test_keyframes_are_apart_and_hold_a_voxel_once(driven):
    frames = driven.keyframes
    gone = np.array([frame.gone for frame in frames])
    assert (frames[0].number, frames[-1].number) == (1, SCANS - 1)
    assert 10 < len(frames) < 50
    assert (np.diff(gone[:-1]) >= 0.09 * driven._tracker.map.reach).all()
    assert np.array_equal(frames[3].pose, driven.results[frames[3].number].pose)
    kept = sum(len(frame.means) for frame in frames)
    assert kept < 1.2 * len(driven.map)


def test_a_standstill_keeps_nothing_more(drive):
    odometry = fa.Odometry(whole=True)
    for _ in range(20):
        odometry.step(drive.scan(0)[0])
    assert len(odometry._keyframes.kept) == 1


def test_the_map_moves_with_the_keyframes(driven):
    frames = driven.keyframes
    shift = np.eye(4)
    shift[:3, 3] = [1, 2, 3]
    moved = fused(frames, np.stack([shift @ frame.pose for frame in frames]))
    assert len(moved) == pytest.approx(len(driven.map), rel=0.1)
    assert np.allclose(moved.points.mean(axis=0) - driven.map.points.mean(axis=0), [1, 2, 3], atol=0.2)


def test_nothing_is_kept_unless_it_is_asked_for(drive):
    odometry = fa.Odometry()
    odometry.step(*drive.scan(0))
    assert odometry.keyframes == []
    assert fa.Odometry(whole=True).keyframes == []
    assert len(fa.Odometry(whole=True).map) == 0
