"""Scans that look alike are laid where most of what sensors saw speaks for it, however many registrations say else."""

from itertools import pairwise

import numpy as np
import pytest

from fieldalign.assembly.looks import Look, Looks
from fieldalign.assembly.parts import CLEAR, Parts, Told, says
from fieldalign.motions import inverse

UNIT, REACH, STEP = 0.05, 5.0, 1.2
NEARLY = 0.6  # of CLEAR: what is looked through between places that are alike


def shift(x, y=0.0):
    T = np.eye(4)
    T[:2, 3] = x, y
    return T


class Corridor:
    """Scans along a line, each seeing all within its reach. look: what tells places apart; those of one look are alike.

    Two scans show the same of each other where they are laid rightly, or nearly so, if both are of places that are
    alike, as any two of these places lie. Otherwise their sensors look through what the other shows.
    """

    def __init__(self, count, alike=()):
        self.truth = np.stack([shift(STEP * k) for k in range(count)])
        self.kind = np.arange(count)
        for k, other in alike:
            self.kind[other] = self.kind[k]
        self.parts = Parts(Looks(np.zeros((count, 3)), np.full(count, REACH), UNIT))

    def right(self, i, j):
        return inverse(self.truth[i]) @ self.truth[j]

    def through(self, laid):
        """What share is looked through: nothing where scans lie rightly, little where both of others like them do."""
        same = [np.flatnonzero(self.kind == self.kind[k]) for k in (laid.i, laid.j)]
        if np.allclose(self.right(laid.i, laid.j), laid.T_ij, atol=1e-6):
            return 0.0
        alike = min(map(len, same)) > 1
        if alike and any(np.allclose(self.right(a, b), laid.T_ij, atol=1e-6) for a in same[0] for b in same[1]):
            return NEARLY * CLEAR
        return 0.02

    def tell(self, *pairs, like=None, strength=1.0, joins=True):
        """Registrations of pairs; like: as if they were these other pairs."""
        for (i, j), (a, b) in zip(pairs, like or pairs, strict=True):
            said = says(Look(0.8, 0.0 if like is None else NEARLY * CLEAR))
            self.parts.add({(i, j): Told(self.right(a, b), said, strength, joins)})

    def settle(self):
        for _ in range(30):
            asked = self.parts.unseen()
            for laid in asked:
                on = max(0.0, 1 - float(np.linalg.norm(laid.T_ij[:3, 3])) / REACH)
                self.parts._looks.add(laid, Look(on, self.through(laid)))
            if not self.parts.settle() and not asked:
                return self.groups()
        raise AssertionError("it does not come to an end")

    def groups(self):
        """The parts of more than one scan, each of whose scans must lie right beside each other."""
        found = []
        for part in np.unique(self.parts.label):
            members = np.flatnonzero(self.parts.label == part)
            poses = self.parts.poses[members]
            right = np.allclose(inverse(poses[0]) @ poses, inverse(self.truth[members[0]]) @ self.truth[members])
            found += [members.tolist() if right else "wrong"] * (len(members) > 1)
        return found


def chain(*scans):
    return list(pairwise(scans))


def test_what_a_look_says():
    assert says(Look(0.8, None)) == 0
    assert says(Look(0.8, 0.0)) == pytest.approx(0.4)
    assert says(Look(0.8, CLEAR)) == 0
    assert says(Look(0.8, 3 * CLEAR)) == pytest.approx(-0.8)
    assert says(Look(0.8, 1.0)) == pytest.approx(-8)


def test_a_chain_of_right_pairs_is_one_part():
    place = Corridor(8)
    place.tell(*chain(*range(8)))
    assert place.settle() == [list(range(8))]


def test_nothing_is_joined_without_a_pair():
    place = Corridor(6)
    place.tell(*chain(0, 1, 2), *chain(3, 4, 5))
    assert place.settle() == [[0, 1, 2], [3, 4, 5]]


def test_a_pair_that_is_not_certain_joins_where_all_that_it_lays_together_agrees():
    place = Corridor(6)
    place.tell(*chain(0, 1, 2), *chain(3, 4, 5))
    place.tell((2, 3), joins=False)
    assert place.settle() == [list(range(6))]
    alone = Corridor(2)
    alone.tell((0, 1), joins=False)
    assert alone.settle() == []


def test_a_pair_that_a_sensor_objects_to_joins_nothing():
    place = Corridor(2)
    place.parts.add({(0, 1): Told(place.right(0, 1), -1.0, 9.0, True)})
    assert place.settle() == []


ENDS = [(2, 10), (3, 11)]  # of a corridor of thirteen: the same to every sensor
WRONG = {(2, 10): (2, 2), (2, 11): (2, 3), (3, 10): (3, 2), (3, 11): (3, 3)}  # all that the one end and the other say


@pytest.mark.parametrize("strength", [0.5, 5.0])
def test_a_bundle_of_wrong_pairs_that_agree_is_found_out_by_what_lies_around(strength):
    """All pairs between the two ends say that these are one place, and close triangles with all right pairs there."""
    place = Corridor(13, ENDS)
    place.tell(*chain(*range(13)))
    place.tell(*WRONG, like=WRONG.values(), strength=strength)
    assert place.settle() == [list(range(13))]


def test_scans_that_went_astray_together_come_back():
    """The one end was laid on the other before anybody knew what lies around."""
    place = Corridor(13, ENDS)
    place.tell(*WRONG, like=WRONG.values())
    place.tell((2, 3), (10, 11), *chain(*range(4, 10)))
    assert place.settle() == ["wrong", [4, 5, 6, 7, 8, 9]]
    place.tell(*chain(*range(13)))
    assert place.settle() == [list(range(13))]


def test_a_scan_that_stands_as_well_in_two_places_of_a_part_is_left_apart():
    place = Corridor(9)
    place.truth[8] = place.truth[2] @ shift(0, 1.0)
    place.tell(*chain(*range(8)))
    there = place.right(2, 8)
    place.parts.add({(2, 8): Told(there, 0.4, 1.0, True), (6, 8): Told(there, 0.4, 1.0, True)})
    place.parts._looks.reach[8] = 1.1  # it sees no other
    assert place.settle() == [list(range(8))]


def test_the_order_of_the_scans_does_not_matter(rng):
    place = Corridor(13, ENDS)
    order = rng.permutation(13)
    place.truth, place.kind = place.truth[order], place.kind[order]
    at = np.argsort(order)
    pairs = [tuple(sorted((int(at[a]), int(at[b])))) for a, b in chain(*range(13))]
    place.tell(*pairs)
    for (a, b), (_, c) in WRONG.items():
        i, j, T = int(at[a]), int(at[b]), place.right(int(at[a]), int(at[c]))
        i, j, T = (i, j, T) if i < j else (j, i, inverse(T))
        place.parts.add({(i, j): Told(T, says(Look(0.8, NEARLY * CLEAR)), 3.0, True)})
    assert place.settle() == [list(range(13))]


def test_agrees_says_whether_a_pair_lies_as_it_was_registered():
    place = Corridor(4)
    place.tell(*chain(0, 1, 2))
    place.settle()
    place.tell((0, 2), like=[(0, 1)])
    place.tell((2, 3))
    assert [place.parts.agrees(pair) for pair in ((0, 1), (1, 2), (0, 2), (2, 3))] == [True, True, False, False]
