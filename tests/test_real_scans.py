"""Real scans with known motion: within the paper's range by its method, from any pose by the robust one.

Skipped where the data is not to be had. The truth of the indoor scans is itself uncertain by a degree."""

from functools import partial

import numpy as np
import pytest

import fieldalign as fa
from fieldalign.evaluation import rotation_error, translation_error
from fieldalign.motions import apply, exp_twist, inverse

by_paper = partial(fa.register, method="paper")


def moved(source, T_target_source, twist):
    """The source, moved, and the truth for it."""
    P = exp_twist(np.array(twist))
    return apply(P, np.asarray(source, float)), T_target_source @ inverse(P)


@pytest.mark.parametrize("seed", range(3))
def test_indoor_demo_pair_by_the_papers_method(data, seed):
    pair = np.load(data / "pointnetlk" / "demo_pair.npz")
    truth = np.load(data / "pointnetlk" / "demo_target_from_source_icp.npy")
    P = np.load(data / "paper_pairs" / "demo_perturb100.npy")[seed]
    result = by_paper(apply(P, pair["p1"].astype(float)), pair["p0"], seed=seed)
    assert rotation_error(result.T_target_source @ P, truth) < 1.5
    assert translation_error(result.T_target_source @ P, truth) < 0.06
    assert result.overlap > 0.8


def test_bunny_by_the_papers_method(data):
    scans = np.load(data / "stanford" / "bunny.npz")
    first, second = (str(name) for name in scans["names"][:2])
    world = scans["world_from_scan"]
    source, truth = moved(scans[second], inverse(world[0]) @ world[1], [0.1, -0.15, 0.1, 0.005, 0.0, -0.01])
    result = by_paper(source, scans[first], settings=fa.PRESETS["indoor"].scaled(0.05))
    assert rotation_error(result.T_target_source, truth) < 2
    assert translation_error(result.T_target_source, truth) < 0.003


def test_kitti_by_the_papers_method(data):
    poses = np.load(data / "kitti00" / "poses.npz")["world_from_lidar_semantickitti"]
    target, source = (np.load(data / "kitti00" / f"{i:06d}.npz")["xyz"] for i in (0, 1))
    source, truth = moved(source, inverse(poses[0]) @ poses[1], [0.01, -0.01, 0.017, 0.5, -0.4, 0.1])
    result = by_paper(source, target, init=np.eye(4), settings="outdoor")
    assert rotation_error(result.T_target_source, truth) < 0.5
    assert translation_error(result.T_target_source, truth) < 0.2


def test_indoor_fragments_by_the_papers_method(data):
    a, b = (np.load(data / "indoor_fragments" / f"frag_0{i}.npz") for i in (0, 1))
    source, truth = moved(
        b["xyz"], inverse(a["world_from_fragment"]) @ b["world_from_fragment"], [0.1, 0.2, -0.1, 0.2, 0.1, 0.1]
    )
    result = by_paper(source, a["xyz"])
    assert rotation_error(result.T_target_source, truth) < 3
    assert translation_error(result.T_target_source, truth) < 0.1


# ----------------------------------------------------------------------------------------------------- from any pose


def found_again(source, target, truth, any_motion, seed, degrees, length):
    """Whether both are brought together from a random pose of the source; the truth is of both as given."""
    W = any_motion(np.random.default_rng(seed), 1.0)
    result = fa.register(apply(W, np.asarray(source, float)), target, seed=seed)
    T = result.T_target_source @ W
    return rotation_error(T, truth) < degrees and translation_error(T, truth) < length


@pytest.mark.parametrize("pair", [(0, 1), (3, 4), (6, 7)])
def test_indoor_fragments(data, any_motion, pair):
    target, source = (np.load(data / "indoor_fragments" / f"frag_0{i}.npz") for i in pair)
    truth = inverse(target["world_from_fragment"]) @ source["world_from_fragment"]
    assert found_again(source["xyz"], target["xyz"], truth, any_motion, pair[0], 3, 0.1)


@pytest.mark.parametrize("name", ["redkitchen_0_1", "redkitchen_1_4", "geotransformer_demo"])
def test_fragments_of_3dmatch(data, any_motion, name):
    pair = np.load(data / "3dmatch" / f"{name}.npz")
    assert found_again(pair["source"], pair["target"], pair["target_from_source"], any_motion, 1, 5, 0.15)


@pytest.mark.parametrize("name", ["000", "020", "040"])
def test_scans_of_a_car_ten_metres_apart(data, any_motion, name):
    pair = np.load(data / "kitti_10m_pairs" / f"{name}.npz")
    assert found_again(pair["source"], pair["target"], pair["target_from_source"], any_motion, 2, 0.5, 0.2)


@pytest.mark.parametrize(("first", "second"), [(0, 1), (2, 12)])
def test_full_scans_of_a_car(data, any_motion, first, second):
    poses = np.load(data / "kitti00" / "poses.npz")["world_from_lidar_semantickitti"]
    target, source = (np.load(data / "kitti00" / f"{i:06d}.npz")["xyz"] for i in (first, second))
    truth = inverse(poses[first]) @ poses[second]
    assert found_again(source, target, truth, any_motion, 3, 0.5, 0.2)


@pytest.mark.parametrize("unit", [1.0, 1000.0], ids=["metres", "millimetres"])
@pytest.mark.parametrize(("name", "pair"), [("bunny", (0, 1)), ("dragon_stand", (3, 4))])
def test_range_scans_of_an_object(data, any_motion, name, pair, unit):
    scans = np.load(data / "stanford" / f"{name}.npz")
    target, source = (unit * scans[str(scans["names"][k])].astype(float) for k in pair)
    worlds = [scans["world_from_scan"][k].astype(float).copy() for k in pair]
    for world in worlds:
        world[:3, 3] *= unit
    truth = inverse(worlds[0]) @ worlds[1]
    assert found_again(source, target, truth, any_motion, 4, 1.0, 0.002 * unit)
