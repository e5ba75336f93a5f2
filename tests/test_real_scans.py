"""Real scans with known motion, each within the paper's range; skipped where the data is not to be had."""

import numpy as np
import pytest

import fieldalign as fa
from fieldalign.evaluation import rotation_error, translation_error
from fieldalign.motions import apply, exp_twist, inverse


def moved(source, T_target_source, twist):
    """The source, moved, and the truth for it."""
    P = exp_twist(np.array(twist))
    return apply(P, np.asarray(source, float)), T_target_source @ inverse(P)


@pytest.mark.parametrize("seed", range(3))
def test_indoor_demo_pair(data, seed):
    pair = np.load(data / "pointnetlk" / "demo_pair.npz")
    truth = np.load(data / "pointnetlk" / "demo_target_from_source_icp.npy")
    P = np.load(data / "paper_pairs" / "demo_perturb100.npy")[seed]
    result = fa.register(apply(P, pair["p1"].astype(float)), pair["p0"], seed=seed)
    assert rotation_error(result.T_target_source @ P, truth) < 1.5
    assert translation_error(result.T_target_source @ P, truth) < 0.06
    assert result.overlap > 0.8


def test_bunny(data):
    scans = np.load(data / "stanford" / "bunny.npz")
    first, second = (str(name) for name in scans["names"][:2])
    world = scans["world_from_scan"]
    source, truth = moved(scans[second], inverse(world[0]) @ world[1], [0.1, -0.15, 0.1, 0.005, 0.0, -0.01])
    result = fa.register(source, scans[first], settings=fa.PRESETS["indoor"].scaled(0.05))
    assert rotation_error(result.T_target_source, truth) < 2
    assert translation_error(result.T_target_source, truth) < 0.003


def test_kitti(data):
    poses = np.load(data / "kitti00" / "poses.npz")["world_from_lidar_semantickitti"]
    target, source = (np.load(data / "kitti00" / f"{i:06d}.npz")["xyz"] for i in (0, 1))
    source, truth = moved(source, inverse(poses[0]) @ poses[1], [0.01, -0.01, 0.017, 0.5, -0.4, 0.1])
    result = fa.register(source, target, init=np.eye(4), settings="outdoor")
    assert rotation_error(result.T_target_source, truth) < 0.5
    assert translation_error(result.T_target_source, truth) < 0.2


def test_indoor_fragments(data):
    a, b = (np.load(data / "indoor_fragments" / f"frag_0{i}.npz") for i in (0, 1))
    source, truth = moved(
        b["xyz"], inverse(a["world_from_fragment"]) @ b["world_from_fragment"], [0.1, 0.2, -0.1, 0.2, 0.1, 0.1]
    )
    result = fa.register(source, a["xyz"])
    assert rotation_error(result.T_target_source, truth) < 3
    assert translation_error(result.T_target_source, truth) < 0.1
