from dataclasses import replace

import numpy as np
import pytest

from fieldalign.alignment.truncation import agreement, truncate, unshared
from fieldalign.fields import FieldSample
from fieldalign.settings import Settings


def sample(gradient, value=None, foot=None, normal=None):
    n = len(gradient)
    rows = np.arange(3.0 * n).reshape(n, 3)
    return FieldSample(np.ones(n) if value is None else value, gradient, rows if foot is None else foot,
                       gradient if normal is None else normal)


def test_a_foot_that_serves_too_many_is_dropped_in_either_cloud():
    up = np.tile([0, 0, 1.0], (20, 1))
    feet = np.arange(60.0).reshape(20, 3)
    shared = feet.copy()
    shared[:4] = shared[0]
    shared[4:7] = shared[4]
    for a, b in ((shared, feet), (feet, shared)):
        kept = unshared(sample(up, foot=a), sample(up, foot=b), Settings())
        assert kept.tolist() == [False] * 4 + [True] * 16


def test_directions_are_compared_in_one_frame(rng):
    R = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    R *= np.sign(np.linalg.det(R))
    away = rng.normal(size=(30, 3))
    away /= np.linalg.norm(away, axis=1)[:, None]
    assert np.allclose(agreement(sample(away @ R.T), sample(away), R, Settings()), 1)
    assert np.allclose(agreement(sample(-away @ R.T), sample(away), R, Settings()), -1)


def test_the_inside_of_a_signed_field_counts_as_unsigned():
    up = np.tile([0, 0, 1.0], (15, 1))
    signed, unsigned = sample(up, value=-np.ones(15)), sample(-up)
    assert np.allclose(agreement(signed, unsigned, np.eye(3), Settings()), 1)


def test_the_papers_words_ask_for_the_normals():
    slanted = np.tile([0, 0.8, 0.6], (15, 1))
    up = np.tile([0, 0, 1.0], (15, 1))
    literal = replace(Settings(), direction="normals")
    assert np.allclose(agreement(sample(up), sample(slanted, normal=up), np.eye(3), literal), 0.6)


@pytest.mark.parametrize(("cosine", "strict"), [(0.95, True), (0.5, False), (0.0, False), (-1.0, False)])
def test_it_always_ends_and_keeps_enough(cosine, strict):
    a = np.tile([1.0, 0, 0], (30, 1))
    b = np.tile([cosine, np.sqrt(1 - cosine**2), 0], (30, 1))
    kept, passed = truncate(sample(a), sample(b), np.eye(3), Settings())
    assert kept.all()
    assert passed is strict


def test_it_ends_where_nothing_has_a_direction():
    zero = np.zeros((30, 3))
    same_foot = np.zeros((30, 3))
    kept, strict = truncate(sample(zero, foot=same_foot), sample(zero, foot=same_foot), np.eye(3), Settings())
    assert kept.all()
    assert not strict


def test_the_count_rule_holds_until_the_cosine_is_used_up():
    a = np.tile([1.0, 0, 0], (30, 1))
    feet = np.arange(90.0).reshape(30, 3)
    feet[:15] = 0
    kept, _ = truncate(sample(a, foot=feet), sample(a), np.eye(3), Settings())
    assert kept.sum() == 15
