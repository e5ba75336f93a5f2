"""Which pairs are tried: all of few, the likeliest of many, none twice, and none once all is joined."""

from itertools import combinations

import numpy as np

from fieldalign.assembly.choice import _HOPE, Choice

MOST = 12  # pairs that a scan asks for


def near(count, reach=8):
    """The likeness of scans on a circle: the nearer, the likelier, all of them different."""
    apart = np.abs(np.subtract.outer(np.arange(count), np.arange(count)))
    apart = np.minimum(apart, count - apart)
    likeness = np.maximum(0, 1 - apart / reach) + 1e-6 * np.add.outer(np.arange(count), np.arange(count))
    return np.where(apart == 0, 0, likeness)


def chosen(likeness, ordered=False, known=None):
    return Choice(likeness, ordered, np.ones(len(likeness), bool) if known is None else known)


def all_asked(choice, component):
    """The pairs of each round until none is left."""
    rounds = [choice.first()]
    while rounds[-1]:
        rounds.append(choice.more(component))
    return rounds[:-1]


def test_of_few_scans_all_pairs_are_tried_once():
    choice = chosen(np.zeros((9, 9)))
    assert choice.first() == list(combinations(range(9), 2))
    assert choice.more(np.arange(9)) == []


def test_scans_that_cannot_be_had_are_in_no_pair():
    known = np.ones(40, bool)
    known[[3, 17]] = False
    few = chosen(np.zeros((9, 9)), known=np.arange(9) != 4).first()
    assert few == [(i, j) for i, j in combinations(range(9), 2) if 4 not in (i, j)]
    likeness = near(40)
    likeness[~known] = likeness[:, ~known] = 0
    rounds = all_asked(chosen(likeness, True, known), np.arange(40))
    assert not {3, 17} & {k for pairs in rounds for pair in pairs for k in pair}
    assert (2, 4) in rounds[0]  # it is the next that there is


def test_of_many_only_the_likeliest_are_tried():
    likeness = near(60)
    first = chosen(likeness).first()
    assert len(first) <= 3 * 60
    apart = [min(j - i, 60 - j + i) for i, j in first]
    assert max(apart) <= 4
    assert apart.count(1) == 60
    assert {k for pair in first for k in pair} == set(range(60))


def test_no_scan_asks_for_more_than_its_few():
    rounds = all_asked(chosen(near(60, 30)), np.arange(60))
    assert len(rounds) > 1
    assert sum(map(len, rounds)) <= MOST * 60


def test_no_pair_is_tried_twice():
    choice = chosen(near(60, 30), ordered=True)
    pairs = [pair for one in all_asked(choice, np.arange(60)) for pair in one]
    assert all(i < j for i, j in pairs)
    assert len(set(pairs)) == len(pairs)
    assert choice.tried == set(pairs)
    assert choice.add([pairs[0], pairs[0][::-1], (0, 29), (29, 0)]) == [(0, 29)]
    assert choice.add([(0, 29)]) == []


def test_what_is_joined_asks_no_more():
    choice = chosen(near(60, 30))
    assert choice.first()
    assert choice.more(np.zeros(60, int)) == []


def test_a_scan_that_cannot_be_had_keeps_nobody_asking():
    known = np.arange(60) != 7
    component = np.where(known, 0, 7)
    choice = chosen(near(60, 30), known=known)
    choice.first()
    assert choice.more(component) == []


def test_more_pairs_lie_between_components():
    component = np.arange(60) // 20
    choice = chosen(near(60, 30))
    choice.first()
    more = choice.more(component)
    assert more
    assert all(component[i] != component[j] for i, j in more)


def test_what_is_unlike_is_not_tried():
    choice = chosen(np.full((20, 20), _HOPE / 2))
    assert choice.first() == []
    assert choice.more(np.arange(20)) == []


def test_in_order_the_next_is_tried_first():
    first = chosen(np.zeros((20, 20)), ordered=True).first()
    assert first == [(k, k + 1) for k in range(19)]


def test_a_scan_left_alone_asks_those_without_hope_up_to_ten_pairs_a_scan():
    """Forty scans in one component but for the last, of which glances saw nothing; the likeliest are asked first."""
    likeness = np.zeros((41, 41))
    likeness[40, 7] = likeness[7, 40] = 1e-4
    choice = Choice(likeness, False, np.ones(41, bool))
    assert choice.first() == []
    component = np.r_[np.zeros(40, int), 1]
    rounds = [choice.more(component) for _ in range(3)]
    assert rounds[0][0] == (7, 40)
    assert [len(pairs) for pairs in rounds] == [20, 20, 0]
    assert {pair for pairs in rounds for pair in pairs} == {(k, 40) for k in range(40)}
    many = Choice(likeness, False, np.ones(41, bool))
    many.add([(i, j) for i in range(40) for j in range(i)][:400])
    assert many.more(component) == []
