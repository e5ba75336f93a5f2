"""Scans that hang together: the laying that most of what sensors saw speaks for, found by joining, moving and parting.

What speaks for a laying is a sum over the pairs of scans that it lays near each other: one that shows the same there
speaks for it, one of which a sensor looked through the other speaks against it, and louder. How many registrations say
so counts nothing: places that look alike are laid on each other by whole bundles of pairs that agree. But with them
come the scans around, which do not. So parts are joined by one motion, weighed by all the pairs that it lays together,
and scans that stand better elsewhere, alone or with others, move there. Each step lets the sum grow.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..fields.protocol import Floats
from ..motions import inverse
from .looks import Laid, Look, Looks
from .parting import Links, parted, pieces, seam, shifted

CLEAR = 0.001      # share of a surface that was looked through: less in a static scene, more where places look alike
_FOR, _AGAINST = 0.5, 10.0  # what a pair that wholly overlaps says where it is clear, and at most against it
_SAME = 2.0        # voxels: a pair says that the scans lie so, if they lie no further off
_SURE, _JOINS = 0.1, 1.0  # what must speak for joining parts, with a certain pair between them, and without
_BETTER = 0.1      # by so much must the sum grow where scans move or are parted
_RIVALS, _CLEARLY = 4, 1.25  # motions of two parts that are weighed; by what factor one must be better than the next
_LOOKED = 40       # pairs, the nearest, that are looked at of two parts before they are joined

Pair = tuple[int, int]


class Told(NamedTuple):
    """A registered pair. strength: of its evidence; joins: whether it alone joins two parts."""

    T_ij: Floats
    says: float
    strength: float
    joins: bool


class Motion(NamedTuple):
    """T (4, 4) takes the frame of part b into that of part a. says: what speaks for it. unseen: pairs that nobody has
    looked at yet."""

    a: int
    b: int
    T: Floats
    says: float
    joins: bool
    unseen: list[Laid]


def says(look: Look) -> float:
    """What speaks for a pair as it is laid; less than 0: against it."""
    if look.through is None:
        return 0.0
    return look.on * max(_FOR * (1 - look.through / CLEAR), -_AGAINST)


class Parts:
    """label: (n,), the part of each scan; poses: (n, 4, 4), each in the frame of its part."""

    def __init__(self, looks: Looks) -> None:
        self._looks, self._told = looks, dict[Pair, Told]()
        self.label: NDArray[np.int64] = np.arange(len(looks.reach))
        self.poses = np.tile(np.eye(4), (len(looks.reach), 1, 1))

    def add(self, told: Mapping[Pair, Told]) -> None:
        """Takes registered pairs (i, j), i < j."""
        self._told |= told

    def agrees(self, pair: Pair) -> bool:
        """Whether a registered pair says that its scans lie where they do."""
        told, (i, j) = self._told[pair], pair
        return bool(self.label[i] == self.label[j]) and self._same(self._laid(i, j), told)

    def unseen(self) -> list[Laid]:
        """Pairs that somebody must look at before the next step."""
        asked = [laid for laid in self._near() if self._says(laid) is None]
        for motion in self._motions():
            asked += motion.unseen
        for _, _, motion in self._astray(self._links()):
            asked += motion.unseen
        return list({(laid.i, laid.j, laid.T_ij.tobytes()): laid for laid in asked}.values())

    def settle(self) -> bool:
        """Parts, moves and joins what is better so; whether anything has changed."""
        return any([self._part(), self._move(), self._join()])

    # -------------------------------------------------------------------------------------------- what speaks for it

    def _says(self, laid: Laid) -> float | None:
        """What speaks for a pair; None where nobody has looked yet. A registration that differs is against it."""
        told = self._told.get((laid.i, laid.j))
        if told is not None and self._same(laid, told):
            return told.says
        look = self._looks.find(laid)
        return None if look is None else says(look) - (0.0 if told is None else max(0.0, told.says))

    def _same(self, laid: Laid, told: Told) -> bool:
        return self._looks.off(laid, told.T_ij) <= _SAME

    def _laid(self, i: int, j: int) -> Laid:
        return Laid(i, j, inverse(self.poses[i]) @ self.poses[j])

    def _of_several(self) -> list[int]:
        """The parts of more than one scan."""
        return [int(part) for part in np.flatnonzero(np.bincount(self.label) > 1)]

    def _members(self, part: int) -> NDArray[np.int64]:
        return np.flatnonzero(self.label == part)

    def _near(self) -> Iterator[Laid]:
        return self._looks.within(self.poses, self.label)

    def _around(self, k: int, pose: Floats, part: int) -> list[Laid]:
        return self._looks.around(k, pose, self.poses, self._members(part))

    def _support(self, k: int, pose: Floats, part: int) -> float:
        """What speaks for a scan at a pose among those of a part."""
        return sum(self._says(laid) or 0.0 for laid in self._around(k, pose, part))

    def _links(self) -> dict[int, dict[int, float]]:
        links: dict[int, dict[int, float]] = defaultdict(dict)
        for laid in self._near():
            if (found := self._says(laid)) is not None:
                links[laid.i][laid.j] = links[laid.j][laid.i] = found
        return links

    def _motions(self) -> list[Motion]:
        """How two parts may be joined: by the motions that pairs between them say, what most speaks for first."""
        between: dict[Pair, list[tuple[Floats, float]]] = defaultdict(list)
        for (i, j), told in sorted(self._told.items(), key=lambda item: (-item[1].strength, item[0])):
            a, b = int(self.label[i]), int(self.label[j])
            if a != b and told.says > 0:
                T = self.poses[i] @ told.T_ij @ inverse(self.poses[j])
                pair, T = ((a, b), T) if a < b else ((b, a), inverse(T))
                known = between[pair]
                row = next((k for k, (other, _) in enumerate(known) if self._alike(T, other, pair[1])), len(known))
                before = known[row] if row < len(known) else (T, 0.0)
                known[row : row + 1] = [(before[0], before[1] + told.says)]
        found = [
            self._motion(a, b, T, self._members(a), self._members(b))
            for (a, b), known in sorted(between.items()) for T, _ in sorted(known, key=lambda m: -m[1])[:_RIVALS]
        ]
        return sorted(found, key=lambda motion: (-motion.says, motion.a, motion.b))

    def _alike(self, T: Floats, other: Floats, part: int) -> bool:
        """Whether two motions lay a part (nearly) the same."""
        return all(
            self._looks.off(Laid(k, k, T @ self.poses[k]), other @ self.poses[k]) <= 2 * _SAME
            for k in map(int, self._members(part))
        )

    def _motion(self, a: int, b: int, T: Floats, ours: NDArray[np.int64], theirs: NDArray[np.int64]) -> Motion:
        """What speaks for laying `theirs`, of part b, on `ours`, of part a."""
        pairs = [
            laid for k in map(int, theirs)
            for laid in self._looks.around(k, T @ self.poses[k], self.poses, ours)
        ]
        pairs.sort(key=self._looks.apart)
        said = [self._says(laid) for laid in pairs]
        joins = any(
            told.joins and self._same(laid, told) for laid in pairs if (told := self._told.get((laid.i, laid.j)))
        )
        unseen = [laid for laid, known in zip(pairs[:_LOOKED], said, strict=False) if known is None]
        return Motion(a, b, T, sum(known for known in said if known is not None), joins, unseen)

    def _astray(self, links: Links) -> Iterator[tuple[float, list[int], Motion]]:
        """Where clear pairs say that scans of a part lie otherwise: what holds these in their place, the scans, and how
        they would lie. Those on their side of the weakest seam to where they should lie go together, or single ones."""
        for part in self._of_several():
            members = [int(k) for k in self._members(part)]
            for T, stay, go in self._complaints(part):
                sides = [(T, [k]) for k in sorted(go)] + [(inverse(T), [k]) for k in sorted(stay)]
                if stay - go and go - stay:
                    sides.append((T, seam(sorted(stay - go), sorted(go - stay), members, links)[1]))
                for motion, side in sides:
                    rest, those = np.setdiff1d(members, side), np.array(side)
                    held = self._motion(part, part, np.eye(4), rest, those).says
                    yield held, side, self._motion(part, part, motion, rest, those)

    def _complaints(self, part: int) -> list[tuple[Floats, set[int], set[int]]]:
        """Motions (4, 4) within a part that clear pairs ask for, the scans that would stay and those that would go."""
        found: list[tuple[Floats, set[int], set[int]]] = []
        for (i, j), told in sorted(self._told.items(), key=lambda item: (-item[1].strength, item[0])):
            if self.label[i] == part == self.label[j] and told.says > 0 and not self.agrees((i, j)):
                T = self.poses[i] @ told.T_ij @ inverse(self.poses[j])
                for asked, stay, go in found:
                    for motion, a, b in ((T, i, j), (inverse(T), j, i)):
                        if self._looks.off(Laid(b, b, motion @ self.poses[b]), asked @ self.poses[b]) <= 2 * _SAME:
                            stay.add(a)
                            go.add(b)
                            break
                    else:
                        continue
                    break
                else:
                    found.append((T, {i}, {j}))
        return found

    # -------------------------------------------------------------------------------------------- steps

    def _join(self) -> bool:
        """Joins parts, smaller ones onto larger ones, if nothing else is nearly as good."""
        motions, sizes = self._motions(), np.bincount(self.label)
        held, laid = set[int](), set[int]()
        for m in motions:
            onto, part, T = (m.a, m.b, m.T) if sizes[m.a] >= sizes[m.b] else (m.b, m.a, inverse(m.T))
            rivals = [o.says for o in motions if (o.a, o.b) == (m.a, m.b) and o is not m]
            is_best = m.says >= (_SURE if m.joins else _JOINS) and m.says >= _CLEARLY * max(rivals, default=0.0)
            if is_best and not m.unseen and part not in held and not {onto, part} & laid:
                held.add(onto)
                laid.add(part)
                self._lay(self._members(part), T, onto)
        return bool(laid)

    def _part(self) -> bool:
        """Parts scans that too much speaks against, those that nothing holds together, and those that stand as well
        elsewhere."""
        links, changed = self._links(), False
        for part in self._of_several():
            rest = [int(k) for k in self._members(part)]
            while side := parted(rest, {k: {m: s for m, s in links[k].items() if m in rest} for k in rest}, _BETTER):
                rest = [k for k in rest if k not in side]
                self._lay(side, np.eye(4), self._free())
                changed = True
        for part in self._of_several():
            inside = [int(k) for k in self._members(part)]
            for piece in pieces(inside, {k: {m: s for m, s in links[k].items() if m in inside} for k in inside})[1:]:
                self._lay(piece, np.eye(4), self._free())
                changed = True
        for held, side, m in self._astray(links):
            if not m.unseen and held < _CLEARLY * m.says and m.says <= held + _BETTER:
                others = np.setdiff1d(self._members(m.a), side).tolist()
                self._lay(min(side, others, key=len), np.eye(4), self._free())
                return True
        return changed

    def _free(self) -> int:
        """The number of no part."""
        return int(np.setdiff1d(np.arange(len(self.label)), self.label)[0])

    def _move(self) -> bool:
        """Moves scans to where more speaks for them, the greatest gain of each part first."""
        touched = set[int]()
        for gain, scans, onto, T in sorted(self._gains(), key=lambda found: (-found[0], found[1])):
            parts = {int(self.label[scans[0]]), onto}
            if gain > _BETTER and not parts & touched:
                touched |= parts
                self._lay(scans, T, onto)
        return bool(touched)

    def _gains(self) -> Iterator[tuple[float, list[int], int, Floats]]:
        """What is gained, if some scans are moved onto a part by a motion."""
        links = self._links()
        for m in self._motions():
            for part, onto, T in ((m.b, m.a, m.T), (m.a, m.b, inverse(m.T))):
                members = [int(k) for k in self._members(part)]
                if len(members) > 1 and not m.unseen:
                    there = {k: self._support(k, T @ self.poses[k], onto) for k in members}
                    gain, scans = shifted(members, there, links)
                    if 0 < len(scans) < len(members):
                        yield gain, scans, onto, T
        for held, side, m in self._astray(links):
            if not m.unseen:
                yield m.says - held, side, m.a, m.T

    def _lay(self, scans: list[int] | NDArray[np.int64], T: Floats, part: int) -> None:
        for k in scans:
            self.label[k], self.poses[k] = part, T @ self.poses[k]
