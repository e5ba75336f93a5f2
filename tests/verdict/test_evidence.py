"""From numbers to a verdict: each alone is enough to refuse, and the strength says by how much."""

import json
from dataclasses import asdict, replace

import pytest

from fieldalign.verdict import Evidence, Reason
from fieldalign.verdict.evidence import (
    MAX_OFF,
    MAX_SEEN_THROUGH,
    MIN_AGREEING,
    MIN_HOLD,
    MIN_MARGIN,
    MIN_MET,
)

AT_THE_EDGE = Evidence(
    met=MIN_MET, agreeing=MIN_AGREEING, margin=MIN_MARGIN, searched=True,
    seen_through=MAX_SEEN_THROUGH, hold=MIN_HOLD, off=MAX_OFF,
)
LEAST = {"met": Reason.LOW_OVERLAP, "agreeing": Reason.LOW_OVERLAP,
         "hold": Reason.DEGENERATE, "margin": Reason.AMBIGUOUS}
MOST = {"seen_through": Reason.CONTRADICTED, "off": Reason.NOT_CONVERGED}
WORSE = {name: 0.99 * getattr(AT_THE_EDGE, name) for name in LEAST} | {
    name: 1.01 * getattr(AT_THE_EDGE, name) for name in MOST}
BETTER = replace(AT_THE_EDGE, **{name: 1.5 * getattr(AT_THE_EDGE, name) for name in LEAST},
                 **{name: getattr(AT_THE_EDGE, name) / 1.5 for name in MOST})


@pytest.mark.parametrize("name", [*LEAST, *MOST])
def test_a_number_that_could_not_be_had_accepts_nothing(name):
    unknown = replace(BETTER, **{name: float("nan")})
    assert not unknown.reason.accepts
    assert not unknown.strength >= 1


def test_what_is_just_enough_is_accepted():
    assert AT_THE_EDGE.reason is Reason.ACCEPTED
    assert AT_THE_EDGE.strength == pytest.approx(1, abs=1e-12)
    assert AT_THE_EDGE.strength >= 1
    assert BETTER.reason is Reason.ACCEPTED
    assert BETTER.strength == pytest.approx(1.5)


@pytest.mark.parametrize(("name", "reason"), (LEAST | MOST).items())
def test_each_number_alone_refuses(name, reason):
    worse = replace(BETTER, **{name: WORSE[name]})
    assert worse.reason is reason
    assert not worse.reason.accepts
    assert worse.strength == pytest.approx(1.01 if name in MOST else 0.99, abs=0.03)
    assert worse.strength < 1


@pytest.mark.parametrize("name", [*LEAST, *MOST])
def test_the_strength_is_that_of_the_weakest(name):
    """By the factor to its threshold, whichever it is, and however good the others are."""
    at = getattr(AT_THE_EDGE, name)
    for factor in (0.2, 1.1):
        changed = replace(BETTER, **{name: at * factor if name in LEAST else at / factor})
        assert changed.strength == pytest.approx(factor)


def test_accepted_is_what_has_a_strength_of_one(rng):
    accepted = 0
    for _ in range(2000):
        drawn = replace(AT_THE_EDGE, **{name: getattr(AT_THE_EDGE, name) * rng.choice([0.1, 0.999, 1.0, 1.001, 10])
                                        for name in rng.choice([*LEAST, *MOST], 2)})
        assert bool(drawn.strength >= 1) is drawn.reason.accepts
        accepted += drawn.reason.accepts
    assert 100 < accepted < 1900


def test_the_worst_that_is_known_is_the_reason():
    """In this order: too little meets, something slides, a sensor looked through, others fit as well, a long step."""
    evidence = replace(AT_THE_EDGE, **WORSE)
    order = [("met", "agreeing"), ("hold",), ("seen_through",), ("margin",), ("off",)]
    for names in order:
        assert evidence.reason is (LEAST | MOST)[names[0]]
        evidence = replace(evidence, **{name: getattr(BETTER, name) for name in names})
    assert evidence.reason is Reason.ACCEPTED


def test_without_a_search_others_are_not_known():
    assert replace(BETTER, searched=False).reason is Reason.ACCEPTED_NEAR_INIT
    assert replace(BETTER, searched=False).strength == BETTER.strength
    assert replace(BETTER, searched=False, margin=WORSE["margin"]).reason is Reason.AMBIGUOUS


def test_where_no_sensor_is_known_none_contradicts():
    unknown = replace(BETTER, seen_through=None)
    assert unknown.reason is Reason.ACCEPTED
    assert unknown.strength == pytest.approx(1.5)
    assert replace(unknown, seen_through=0.0, off=0.0).strength == pytest.approx(1.5)  # and no division by nothing


def test_the_sentence_has_the_numbers():
    evidence = Evidence(
        met=0.61, agreeing=0.72, margin=4.56, searched=True, seen_through=0.034, hold=0.0789, off=0.12)
    told = str(evidence)
    for number in ("61%", "72%", "4.6 times", "3.4%", "7.9%", "0.12 voxels"):
        assert number in told
    assert "in any clearly different pose" in told
    assert told.endswith(".")


def test_the_sentence_says_what_is_not_known():
    told = str(replace(BETTER, searched=False, seen_through=None, margin=1e12, hold=-1e-5))
    assert "looked through" not in told
    assert "around the guess" in told
    assert "over 1000 times" in told
    assert "-" not in told  # a hold that noise makes negative is none


@pytest.mark.parametrize("seen_through", [None, 0.25])
def test_the_numbers_by_name_are_json(seen_through):
    evidence = replace(BETTER, seen_through=seen_through)
    plain = json.loads(json.dumps(evidence.to_dict(), allow_nan=False))
    assert plain == asdict(evidence) | {"strength": evidence.strength}


def test_only_two_reasons_accept():
    assert [reason for reason in Reason if reason.accepts] == [Reason.ACCEPTED, Reason.ACCEPTED_NEAR_INIT]
    assert len({str(reason) for reason in Reason}) == len(Reason)


def test_the_thresholds_are_those_that_were_found():
    """By the benchmark of the verdict, and told in docs/verdict.md: whoever changes one runs it again, and tells it."""
    assert (MIN_MARGIN, MIN_AGREEING, MIN_MET, MIN_HOLD) == (2.5, 0.25, 0.33, 3e-3)
    assert (MAX_SEEN_THROUGH, MAX_OFF) == (0.03, 1.5)
