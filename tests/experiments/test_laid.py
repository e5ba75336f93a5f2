"""Pairs that are moved: the answers lay the clouds on each other, and the motions are as the protocols say."""

import pickle

import numpy as np
import pytest

from fieldalign.evaluation import rotation_error
from fieldalign.experiments.data_sets import twists
from fieldalign.experiments.data_sets.kitti import ScanPair
from fieldalign.experiments.scenes import laid
from fieldalign.experiments.scenes.kitti import drawn_by_text
from fieldalign.motions import apply, inverse, log_motion


@pytest.fixture
def pairs(tmp_path, corner, any_motion, rng):
    """Five pairs of the same points."""
    found = []
    for k in range(5):
        T, file = any_motion(rng, 2.0), tmp_path / f"{k}.npz"
        np.savez(file, source=apply(inverse(T), corner), target=corner)
        found.append(ScanPair("drive", k, k + 1, f"{file}#source", f"{file}#target", T, "made"))
    return found


MOTIONS = {
    "as they lie": laid.as_they_lie, "turned": laid.turned, "about z": laid.turned_about_z,
    "drawn": laid.aligned_then(twists.drawn), "by the text": laid.aligned_then(drawn_by_text),
}


@pytest.mark.parametrize("motions", MOTIONS.values(), ids=MOTIONS)
def test_the_answer_lays_the_source_on_the_target(motions, pairs, tmp_path):
    cases = laid.LaidCases(lambda folder: pairs, motions)(tmp_path, 3)
    assert [case.name for case in cases] == [f"drive/{k}_{k + 1}/0" for k in range(5)]
    assert {case.group for case in cases} == {"drive"}
    for case in map(pickle.loads, map(pickle.dumps, cases)):
        source, target = case.clouds()
        np.testing.assert_allclose(apply(case.T_target_source, source), target, atol=1e-9)


def test_the_motions_are_those_of_the_protocols(pairs, tmp_path):
    def of(motions):
        return [case.T_target_source for case in laid.LaidCases(lambda folder: pairs, motions, least=60)(tmp_path, 0)]

    assert all(np.array_equal(T, pair.T_target_source)
               for T, pair in zip(of(laid.as_they_lie), pairs * 12, strict=True))
    degrees = [rotation_error(T, np.eye(4)) for T in of(laid.aligned_then(twists.drawn))]
    assert max(degrees) < 45
    assert max(degrees) > 40
    texts = np.array([log_motion(inverse(T)) for T in of(laid.aligned_then(drawn_by_text))])
    assert (texts > 0).all()
    assert (texts < [np.radians(1)] * 3 + [1] * 3).all()
    turns = [inverse(T) @ pair.T_target_source for T, pair in zip(of(laid.turned_about_z), pairs * 12, strict=True)]
    np.testing.assert_allclose([turn[:3, 2] for turn in turns], [[0, 0, 1]] * 60, atol=1e-12)
    assert np.ptp([turn[0, 0] for turn in turns]) > 1.9
    anyhow = [inverse(T) @ pair.T_target_source for T, pair in zip(of(laid.turned), pairs * 12, strict=True)]
    assert np.ptp([turn[:3, 2] for turn in anyhow], axis=0).min() > 1.5


def test_few_pairs_are_taken_several_times_with_motions_of_their_own(pairs, tmp_path):
    cases = laid.LaidCases(lambda folder: pairs, laid.turned, least=11)(tmp_path, 0)
    assert len({case.name for case in cases}) == len(cases) == 15
    assert cases[5].name == "drive/0_1/1"
    assert rotation_error(cases[0].T_target_source, cases[5].T_target_source) > 1
    again = laid.LaidCases(lambda folder: pairs, laid.turned, least=11)(tmp_path, 0)
    assert all(np.array_equal(a.T_target_source, b.T_target_source) for a, b in zip(cases, again, strict=True))
    other = laid.LaidCases(lambda folder: pairs, laid.turned)(tmp_path, 1)
    assert not np.allclose(cases[0].T_target_source, other[0].T_target_source)


def test_fewer_points(pairs):
    source, target = laid.Laid(pairs[0], np.eye(4), every=2)()
    assert (len(source), len(target)) == (3000, 3000)
    assert np.array_equal(target[1], pairs[0].clouds()[1][2])
    source, target = laid.Laid(pairs[0], np.eye(4), voxel=0.3)()
    assert 50 < len(target) < 2000
