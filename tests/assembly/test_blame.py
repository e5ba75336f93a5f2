"""The edges that are given up: those across which pairs that nobody registered contradict each other."""

import numpy as np
import pytest

from fieldalign.assembly.blame import blamed
from fieldalign.assembly.consensus import Consensus

CHAIN = Consensus(
    np.tile(np.eye(4), (7, 1, 1)), np.ones(5, bool), np.ones(5),
    before=np.array([-1, 0, 1, 2, 1, -1, 5]), by=np.array([-1, 0, 1, 2, 3, -1, 4]),
)  # 0 - 1 - 2 - 3, 1 - 4, and apart from them 5 - 6


@pytest.mark.parametrize(
    ("i", "j", "path"), [(0, 3, {0, 1, 2}), (3, 4, {2, 1, 3}), (4, 4, set()), (1, 2, {1}), (5, 6, {4}), (0, 6, set())]
)
def test_the_way_between_two_scans(i, j, path):
    assert set(CHAIN.path(i, j)) == set(CHAIN.path(j, i)) == path
    assert len(CHAIN.path(i, j)) == len(path)


def test_nothing_against_it_nothing_given_up():
    assert blamed(CHAIN, [], np.ones(5)) == set()
    assert blamed(CHAIN, [(0, 3, -0.5), (5, 6, -0.1)], np.ones(5)) == set()


def test_the_edge_that_explains_most_is_given_up():
    against = [(0, 2, 1.0), (0, 3, 1.0), (4, 2, 1.0), (4, 3, 1.0), (0, 4, -1.0), (2, 3, -1.0)]
    assert blamed(CHAIN, against, np.ones(5)) == {1}


def test_of_two_that_explain_as_much_the_weaker_one():
    strength = np.array([1.0, 1.0, 0.5, 1.0, 1.0])
    assert blamed(CHAIN, [(1, 3, 1.0)], strength) == {2}
    assert blamed(CHAIN, [(1, 3, 1.0)], strength[[0, 2, 1, 3, 4]]) == {1}


def test_what_is_left_is_explained_by_another():
    assert blamed(CHAIN, [(0, 1, 1.0), (2, 3, 1.0), (5, 6, 1.0), (1, 2, -1.0)], np.ones(5)) == {0, 2, 4}


def test_what_speaks_for_an_edge_saves_it():
    assert blamed(CHAIN, [(0, 1, 1.0), (0, 4, -2.0)], np.ones(5)) == set()
