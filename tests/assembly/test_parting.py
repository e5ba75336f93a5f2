"""Which scans of a part had better go: by sums over links."""

import numpy as np
import pytest

from fieldalign.assembly.parting import parted, pieces, seam, shifted


def links_of(pairs, count=6):
    links = {k: {} for k in range(count)}
    for (i, j), says in pairs.items():
        links[i][j] = links[j][i] = says
    return links


TWO = {(0, 1): 1.0, (1, 2): 1.0, (0, 2): 1.0, (3, 4): 1.0, (4, 5): 1.0, (3, 5): 1.0}  # 0 1 2 and 3 4 5


def test_what_nothing_ties_together_is_in_pieces():
    assert pieces(range(6), links_of(TWO)) == [[0, 1, 2], [3, 4, 5]]
    assert pieces(range(6), links_of(TWO | {(2, 3): 0.1})) == [list(range(6))]
    assert pieces(range(6), links_of(TWO | {(2, 3): -0.1})) == [[0, 1, 2], [3, 4, 5]]


def test_a_part_of_which_nothing_is_against_stays_whole():
    assert parted(range(6), links_of(TWO | {(2, 3): 0.1}), 0.1) == []


@pytest.mark.parametrize(("against", "expected"), [(-0.3, True), (-0.15, False)])
def test_a_part_is_cut_where_more_is_against_than_for_it(against, expected):
    """The bundle between the two sides says 0.4 in all."""
    links = links_of(TWO | {(2, 3): 0.2, (2, 4): 0.2, (0, 5): against, (1, 5): against})
    sides = [[0, 1, 2], [3, 4, 5]]
    assert (parted(range(6), links, 0.1) in sides) is expected


def test_a_scan_that_most_others_object_to_goes_alone():
    links = links_of(TWO | {(2, 3): 1.0, (2, 4): 1.0, (1, 3): 1.0, (0, 3): -5.0})
    assert parted(range(6), links, 0.1) in ([0], [1, 2, 3, 4, 5])


def test_the_weakest_seam_between_scans():
    links = links_of(TWO | {(2, 3): 0.3, (1, 4): 0.2})
    held, side = seam([0], [5], range(6), links)
    assert (held, side) == (pytest.approx(0.5), [3, 4, 5])
    assert seam([5], [0], range(6), links)[1] == [0, 1, 2]


def test_the_seam_is_where_several_want_it():
    """Between 0 and 5 alone, 5 would go by itself."""
    links = links_of({(0, 1): 3.0, (1, 2): 3.0, (2, 3): 1.0, (3, 4): 3.0, (4, 5): 0.5})
    assert seam([0], [5], range(6), links) == (pytest.approx(0.5), [5])
    assert seam([0], [4, 5], range(6), links) == (pytest.approx(1.0), [3, 4, 5])


def test_nothing_goes_where_nothing_is_gained():
    assert shifted(range(6), dict.fromkeys(range(6), 0.0), links_of(TWO)) == (0.0, [])
    gone = shifted(range(6), {0: 1.5, 3: -1.0, 5: -1.0}, links_of(TWO | {(2, 3): 2.0}))
    assert gone == (0.0, [])


def test_scans_go_together_where_none_would_go_alone():
    """Each of 3, 4, 5 leaves two others that are worth more to it; all three leave 0.5."""
    links = links_of(TWO | {(2, 3): 0.5})
    gain, scans = shifted(range(6), {0: -1.0, 3: 0.6, 4: 0.6, 5: 0.6}, links)
    assert (gain, scans) == (pytest.approx(1.3), [3, 4, 5])


def test_those_that_are_objected_to_there_stay(rng):
    links = links_of(TWO | {(2, 3): 0.5})
    there = {3: 2.0, 4: 2.0, 5: 2.0} | dict.fromkeys(range(3), -4.0)
    order = rng.permutation(6)
    renamed = {int(order[k]): {int(order[m]): s for m, s in ties.items()} for k, ties in links.items()}
    gain, scans = shifted(range(6), {int(order[k]): s for k, s in there.items()}, renamed)
    assert gain == pytest.approx(5.5)
    assert scans == sorted(np.asarray(order)[[3, 4, 5]].tolist())
