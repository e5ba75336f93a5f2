"""Which pairs are used, which join scans alone, and which need a second one that agrees."""

from dataclasses import replace

import numpy as np
import pytest

from fieldalign.assembly.graph import Graph, is_certain, usable, weight_of
from fieldalign.assembly.pair_result import PairResult
from fieldalign.motions import exp_twist, inverse
from fieldalign.verdict import Evidence, Reason

GOOD = Evidence(met=0.9, agreeing=0.6, margin=4.0, searched=True, seen_through=None, hold=0.05, off=0.0)
CLEAR = replace(GOOD, seen_through=0.001)


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
        (replace(CLEAR, margin=1.1), False, False),
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
    assert pytest.approx(weight_of(result_of(replace(CLEAR, margin=1.5)))) == 0.9
    assert weight_of(result_of(replace(CLEAR, seen_through=0.02))) < 0.1


def test_a_pair_that_failed_is_good_for_nothing():
    failed = PairResult.failed("b", "a", "it failed")
    assert not usable(failed)
    assert not is_certain(failed)
    assert failed.reason is Reason.FAILED


@pytest.fixture
def truth(rng, any_motion):
    return np.stack([any_motion(rng, 3.0) for _ in range(4)])


def graph_of(truth, pairs):
    """pairs: {(i, j): evidence}, all of them right."""
    graph = Graph(dict.fromkeys(range(4), (0.05, 40.0)), 4, 0)
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
    graph = Graph(dict.fromkeys(range(4), (0.05, 40.0)), 4, 0)
    results = {pair: result_of(e, inverse(truth[pair[0]]) @ truth[pair[1]]) for pair, e in SURE.items()}
    off = exp_twist(np.array([0, 0, 0.5, 1.0, 0, 0]))
    results[1, 2] = result_of(WEAK, inverse(truth[1]) @ truth[2])
    results[0, 3] = result_of(WEAK, inverse(truth[0]) @ truth[3] @ off)
    graph.add(results)
    assert graph.components == [[0, 1], [2, 3]]


def test_near_ones_that_were_not_tried_are_named_once(truth):
    near = graph_of(truth, SURE | {(1, 2): GOOD}).unseen(5)
    assert near == [(0, 2), (0, 3), (1, 3)]
    assert graph_of(truth, SURE | {(1, 2): GOOD}).unseen(0) == []


def test_why_a_scan_is_left_out(truth):
    graph = graph_of(truth, {(0, 1): GOOD, (1, 2): replace(GOOD, margin=1.2)})
    reasons = graph.reasons_of([2, 3])
    assert "none of 1 registrations was accepted" in reasons[2]
    assert "no other scan looks like it" in reasons[3]


def seen_in(graph, truth, pairs):
    for (i, j), (on, through) in pairs.items():
        graph.saw((i, j), inverse(truth[i]) @ truth[j], on, through)


def test_what_was_seen_holds_where_it_was_seen(truth):
    graph = graph_of(truth, SURE | {(1, 2): GOOD})
    seen_in(graph, truth, {(0, 2): (0.5, 0.0)})
    assert graph.unseen(5) == [(0, 3), (1, 3)]
    assert list(graph.seen()) == [(0, 2, 0.5, 0.0)]
    graph.saw((0, 2), exp_twist(np.array([0, 0, 0.1, 0, 0, 0])) @ inverse(truth[0]) @ truth[2], 0.5, 0.0)
    assert list(graph.seen()) == []
    assert (0, 2) in graph.unseen(5)


def test_one_weak_pair_joins_where_all_that_it_lays_together_agrees(truth):
    graph = graph_of(truth, SURE | {(1, 2): WEAK})
    seen_in(graph, truth, {(0, 2): (0.6, 0.0), (1, 3): (0.6, 0.0)})
    assert graph.check()
    assert graph.components == [[0, 1, 2, 3]]
    assert not graph.check()  # nothing has changed since


@pytest.mark.parametrize("through", [None, 0.01])
def test_what_is_unknown_or_looked_through_joins_nothing(truth, through):
    graph = graph_of(truth, SURE | {(1, 2): WEAK})
    seen_in(graph, truth, {(0, 2): (0.6, through), (1, 3): (0.6, through)})
    graph.check()
    assert graph.components == [[0, 1], [2, 3]]


def test_a_pair_across_which_sensors_looked_through_is_given_up(truth):
    graph = graph_of(truth, SURE | {(1, 2): GOOD})
    assert graph.components == [[0, 1, 2, 3]]
    seen_in(graph, truth, {(0, 2): (0.6, 0.02), (1, 3): (0.6, 0.02), (0, 3): (0.4, 0.0)})
    assert graph.check()
    assert graph.components == [[0, 1], [2, 3]]
    assert [pair[:2] for pair in graph.told(believed=True)] == [(0, 1), (2, 3)]
