"""Which pairs are used, which join scans alone, and which need a second one that agrees."""

from dataclasses import replace

import numpy as np
import pytest

from fieldalign.assembly.graph import Graph, is_certain, usable, weight_of
from fieldalign.assembly.looks import Look
from fieldalign.assembly.pair_result import PairResult
from fieldalign.motions import exp_twist, inverse
from fieldalign.verdict import Evidence, Reason

GOOD = Evidence(met=0.9, agreeing=0.6, margin=4.0, searched=True, seen_through=None, hold=0.05, off=0.0)
CLEAR = replace(GOOD, seen_through=0.0003)


def result_of(evidence=GOOD, T=None):
    return PairResult(
        "b", "a", np.eye(4) if T is None else T, evidence.reason.accepts, evidence.reason, 0.8, 0.8, np.eye(6),
        np.zeros(3), 0.01, evidence,
    )


@pytest.mark.parametrize(
    ("evidence", "used", "joins"),
    [
        (GOOD, True, True),
        (CLEAR, True, True),
        (replace(CLEAR, seen_through=0.01), True, False),   # furniture that was moved, or a place that looks alike
        (replace(CLEAR, seen_through=0.1), False, False),
        (replace(GOOD, hold=1e-4), True, False),            # along a street
        (replace(GOOD, margin=1.5), True, False),           # which needs others that agree
        (replace(GOOD, margin=1.4), False, False),
        (replace(CLEAR, margin=1.5), True, False),          # no sensor objects
        (replace(CLEAR, margin=1.1), True, False),
        (replace(CLEAR, margin=1.5, seen_through=0.01), True, False),  # and counts next to nothing
        (replace(CLEAR, margin=1.5, agreeing=0.1), False, False),
    ],
)
def test_what_a_pair_is_good_for(evidence, used, joins):
    assert usable(result_of(evidence)) is used
    assert is_certain(result_of(evidence)) is joins


def test_what_is_less_sure_counts_less_where_several_must_agree():
    assert weight_of(result_of(GOOD)) == weight_of(result_of(replace(GOOD, hold=1e-4))) == 1
    assert weight_of(result_of(replace(GOOD, margin=1.5))) == 0.5
    assert weight_of(result_of(replace(CLEAR, margin=1.5))) == pytest.approx(1 / 1.09)
    assert weight_of(result_of(replace(CLEAR, seen_through=0.02))) < 0.1


def test_a_pair_that_failed_is_good_for_nothing():
    failed = PairResult.failed("b", "a", "it failed")
    assert not usable(failed)
    assert not is_certain(failed)
    assert failed.reason is Reason.FAILED


@pytest.fixture
def truth(rng, any_motion):
    return np.stack([any_motion(rng, 3.0) for _ in range(4)])


def empty():
    return Graph(dict.fromkeys(range(4), (0.05, 40.0)), dict.fromkeys(range(4), np.zeros(3)), 4, 0)


def graph_of(truth, pairs):
    """pairs: {(i, j): evidence}, all of them right."""
    graph = empty()
    graph.add({(i, j): result_of(e, inverse(truth[i]) @ truth[j]) for (i, j), e in pairs.items()})
    return graph


WEAK = replace(GOOD, hold=1e-4)
SURE = {(0, 1): GOOD, (2, 3): GOOD}


def test_one_weak_pair_joins_nothing(truth):
    graph = graph_of(truth, SURE | {(1, 2): WEAK})
    assert graph.components == [[0, 1], [2, 3]]
    assert [pair[:2] for pair in graph.told(believed=True)] == [(0, 1), (2, 3)]


def test_two_weak_pairs_that_agree_join(truth):
    graph = graph_of(truth, SURE | {(1, 2): WEAK, (0, 3): WEAK})
    assert graph.components == [[0, 1, 2, 3]]
    assert np.allclose(inverse(graph.poses[0]) @ graph.poses, inverse(truth[0]) @ truth)


def test_two_weak_pairs_that_do_not_agree_join_nothing(truth):
    graph = empty()
    results = {pair: result_of(e, inverse(truth[pair[0]]) @ truth[pair[1]]) for pair, e in SURE.items()}
    off = exp_twist(np.array([0, 0, 0.5, 1.0, 0, 0]))
    results[1, 2] = result_of(WEAK, inverse(truth[1]) @ truth[2])
    results[0, 3] = result_of(WEAK, inverse(truth[0]) @ truth[3] @ off)
    graph.add(results)
    assert graph.components == [[0, 1], [2, 3]]


def test_near_ones_that_were_not_tried_are_named_once(truth):
    graph = graph_of(truth, SURE | {(1, 2): GOOD})
    asked = graph.unseen()
    assert [laid[:2] for laid in asked] == [(0, 2), (0, 3), (1, 3)]
    assert all(np.allclose(laid.T_ij, inverse(truth[laid.i]) @ truth[laid.j]) for laid in asked)
    for laid in asked:
        graph.saw(laid, Look(0.5, None))
    assert graph.unseen() == []
    assert graph.overlaps() == {(0, 2): 0.5, (0, 3): 0.5, (1, 3): 0.5}


def test_why_a_scan_is_left_out(truth):
    graph = graph_of(truth, {(0, 1): GOOD, (1, 2): replace(GOOD, margin=1.2)})
    reasons = graph.reasons_of([2, 3])
    assert "none of 1 registrations was accepted" in reasons[2]
    assert "no other scan looks like it" in reasons[3]


def looked_at(graph, truth, pairs):
    """What comes of it where pairs show (on, through) of each other as they truly lie, and all others nothing."""
    for _ in range(20):
        asked = graph.unseen()
        for laid in asked:
            lies_so = np.allclose(laid.T_ij, inverse(truth[laid.i]) @ truth[laid.j])
            graph.saw(laid, Look(*pairs.get((laid.i, laid.j), (0.0, 0.0)) if lies_so else (0.5, 0.5)))
        if not graph.settle() and not asked:
            return graph.components
    raise AssertionError("it does not come to an end")


SEEN = {(0, 1): CLEAR, (2, 3): CLEAR}
WEAK_AND_SEEN = replace(CLEAR, hold=1e-4)


def test_where_sensors_are_known_nothing_is_joined_before_they_were_asked(truth):
    graph = graph_of(truth, SEEN)
    assert graph.components == []
    assert looked_at(graph, truth, {}) == [[0, 1], [2, 3]]
    assert np.allclose(inverse(graph.poses[0]) @ graph.poses[1], inverse(truth[0]) @ truth[1])


def test_one_weak_pair_joins_where_all_that_it_lays_together_agrees(truth):
    graph = graph_of(truth, SEEN | {(1, 2): WEAK_AND_SEEN})
    assert looked_at(graph, truth, {(0, 2): (0.9, 0.0), (1, 3): (0.9, 0.0), (0, 3): (0.5, 0.0)}) == [[0, 1, 2, 3]]
    assert [pair[:2] for pair in graph.told(believed=True)] == [(0, 1), (2, 3), (1, 2)]
    assert not graph.settle()  # nothing has changed since


@pytest.mark.parametrize("through", [None, 0.005])
def test_what_is_unknown_or_looked_through_joins_nothing(truth, through):
    graph = graph_of(truth, SEEN | {(1, 2): WEAK_AND_SEEN})
    assert looked_at(graph, truth, {(0, 2): (0.6, through), (1, 3): (0.6, through)}) == [[0, 1], [2, 3]]


def test_a_pair_across_which_sensors_looked_through_is_not_believed(truth):
    graph = graph_of(truth, SEEN | {(1, 2): CLEAR})
    shown = {(0, 2): (0.6, 0.02), (1, 3): (0.6, 0.02), (0, 3): (0.4, 0.0)}
    assert looked_at(graph, truth, shown) == [[0, 1], [2, 3]]
    assert [pair[:2] for pair in graph.told(believed=True)] == [(0, 1), (2, 3)]
    assert [pair[:2] for pair in graph.told(believed=False)] == [(1, 2)]
