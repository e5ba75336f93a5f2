"""The motions of the experiments: drawn as the texts say, and read from files."""

import json

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from scipy.stats import kstest

from fieldalign.errors import ArgumentError, DataSetError
from fieldalign.experiments.data_sets import twists
from fieldalign.motions import exp_twist


def are_uniform(values, low, high):
    return kstest(values, "uniform", args=(low, high - low)).pvalue > 1e-3


def are_on_the_sphere_evenly(vectors):
    """On the sphere, each coordinate is uniform in [-1, 1]."""
    units = vectors / np.linalg.norm(vectors, axis=1, keepdims=True)
    return all(are_uniform(units[:, k], -1, 1) for k in range(3))


def test_motions_as_the_text_says(rng):
    drawn = twists.drawn(rng, 4000)
    assert drawn.shape == (4000, 6)
    assert are_uniform(np.degrees(np.linalg.norm(drawn[:, :3], axis=1)), 0, 45)
    assert are_uniform(np.linalg.norm(drawn[:, 3:], axis=1), 0, 0.8)
    assert are_on_the_sphere_evenly(drawn[:, :3])
    assert are_on_the_sphere_evenly(drawn[:, 3:])
    assert abs(np.corrcoef(drawn.T) - np.eye(6)).max() < 0.08


def test_motions_for_kitti_are_uniform_about_and_along_each_axis(rng):
    T = np.array([exp_twist(twist) for twist in twists.drawn_for_kitti(rng, 3000)])
    angles = Rotation.from_matrix(T[:, :3, :3]).as_euler("xyz", degrees=True)
    assert all(are_uniform(angles[:, k], -1, 1) for k in range(3))
    assert all(are_uniform(T[:, k, 3], -1, 1) for k in range(3))


@pytest.mark.parametrize("draw", [twists.drawn, twists.drawn_for_kitti])
def test_a_seed_draws_the_same(draw):
    one, same, other = (draw(np.random.default_rng(seed), 5) for seed in (1, 1, 2))
    assert np.array_equal(one, same)
    assert not np.array_equal(one, other)
    with pytest.raises(ArgumentError, match="count must be an integer"):
        draw(np.random.default_rng(0), 0)


def test_a_csv_is_read(tmp_path, rng):
    values = rng.normal(size=(7, 6))
    np.savetxt(tmp_path / "gt_poses.csv", values, delimiter=",")
    assert np.array_equal(twists.from_csv(tmp_path / "gt_poses.csv"), values)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "but holds 0 numbers"),
        ("1,2,3,4,5,6\n1,2,3,4,5\n", "6 finite numbers each, but holds 11 numbers"),
        ("1,2,3,4,5,nan\n", "but holds numbers that are not finite"),
        ("1,2,3,4,5,x\n", "cannot be read as twists"),
    ],
)
def test_a_csv_that_holds_no_twists(text, words, tmp_path):
    (tmp_path / "a.csv").write_text(text)
    with pytest.raises(DataSetError, match=words):
        twists.from_csv(tmp_path / "a.csv")


def test_pairs_of_the_program_in_both_forms(tmp_path):
    twist = [0.1, 0, 0, 1, 2, 3]
    file = tmp_path / "pairs.json"
    for entry in (["a/a_1", "paper", twist], {"i": 0, "name": "a/a_1", "set": "paper", "twist": twist}):
        file.write_text(json.dumps([entry, entry]))
        pairs = twists.program_pairs(file)
        assert [(pair.shape, pair.set, pair.twist.tolist()) for pair in pairs] == [("a/a_1", "paper", twist)] * 2


@pytest.mark.parametrize(
    "text", ["", "[]", "{}", "7", '[["a", "b"]]', '[["a", "b", [1, 2]]]', '[["a", "b", [1, 2, 3, 4, 5, NaN]]]',
             '[{"name": "a"}]', '[["a", "b", "c"]]']
)
def test_files_that_hold_no_pairs(text, tmp_path):
    (tmp_path / "a.json").write_text(text)
    with pytest.raises(DataSetError, match=r"a\.json (is no list|must hold twists)"):
        twists.program_pairs(tmp_path / "a.json")


def test_files_that_hold_no_motions(tmp_path):
    file = tmp_path / "a.npy"
    with pytest.raises(DataSetError, match=r"cannot be read as \.npy"):
        twists.demo_motions(file)
    np.save(file, np.eye(4))
    with pytest.raises(DataSetError, match=r"holds an array of shape \(4, 4\)"):
        twists.demo_motions(file)
    np.save(file, np.array([np.eye(4), 2 * np.eye(4)]))
    with pytest.raises(ArgumentError, match="motion 1 of"):
        twists.demo_motions(file)


def test_the_part(data):
    motions = twists.from_csv(data / "pointnetlk" / "gt_poses.csv")
    assert motions.shape == (10000, 6)
    assert np.allclose(np.degrees(np.linalg.norm(motions[:, :3], axis=1)), 40)
    assert twists.demo_motions(data / "paper_pairs" / "demo_perturb100.npy").shape == (100, 4, 4)
    for name, count in (("synthetic", 400), ("modelnet10k", 300)):
        pairs = twists.program_pairs(data / "paper_pairs" / f"{name}_pairs.json")
        assert len(pairs) == count
        by_text = [np.linalg.norm(pair.twist[3:]) for pair in pairs if pair.set == "paper"]
        assert are_uniform(by_text, 0, 0.8)
