"""What was found of pairs of scans, whom of them to believe, and which scans belong together."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..fields.protocol import Floats
from .consensus import consensus
from .looks import Laid, Look, Looks
from .pair_result import PairResult
from .parts import CLEAR, Parts, Told, says
from .pose_graph import Edge
from .world import Given

_AGREE = 1.5    # more than so many uncertain pairs that agree join what they lie between, unclear ones count less
_CLOSE = 1.7    # by so much the margin may fall short; by anything where no known sensor objects

Pair = tuple[int, int]


class Graph:
    """All that was found of pairs, and what follows from it.

    Where sensors are known, they decide (parts.py); else what agrees around cycles (consensus.py).
    """

    def __init__(
        self, lengths: dict[int, tuple[float, float]], places: Mapping[int, Floats], count: int, seed: int
    ) -> None:
        """lengths: voxel and extent of each scan that can be had; places: (3,), where it was taken from."""
        self._lengths, self._count, self._seed = lengths, count, seed
        self.unit = float(np.median([voxel for voxel, _ in lengths.values()])) if lengths else 1.0
        reach = np.array([lengths[k][1] / 2 if k in lengths else 0.0 for k in range(count)])
        self.results: dict[Pair, PairResult] = {}
        taken_from = np.stack([places.get(k, np.zeros(3)) for k in range(count)])
        self._looks = Looks(taken_from, reach, self.unit)
        self._parts = Parts(self._looks)
        self._is_seen = False  # whether any sensor is known
        self.edges: list[Edge] = []
        self._believed: NDArray[np.bool_] = np.zeros(0, bool)
        self.poses = np.tile(np.eye(4), (count, 1, 1))
        self.component: NDArray[np.int64] = np.arange(count)
        self.components: list[list[int]] = []

    def add(self, results: dict[Pair, PairResult]) -> None:
        """Takes the results of pairs (i, j), and decides anew whom to believe."""
        self.results |= results
        self.edges = [_edge_of(*pair, r) for pair, r in self.results.items() if usable(r)]
        self._is_seen |= any(r.evidence is not None and r.evidence.seen_through is not None for r in results.values())
        self._parts.add({pair: _told_of(r) for pair, r in results.items() if usable(r)})
        self._decide()

    def _decide(self) -> None:
        if self._is_seen:
            self.poses = self._parts.poses.copy()
            self._believed = np.array([self._parts.agrees((e.i, e.j)) for e in self.edges], bool)
            self.component = self._tied()
        elif self.edges:
            sizes = [(self._lengths[e.i], self._lengths[e.j]) for e in self.edges]
            voxels = np.array([max(a[0], b[0]) for a, b in sizes])
            extents = np.array([min(a[1], b[1]) for a, b in sizes])
            found = consensus(self._count, self.edges, voxels, extents, self._seed)
            self.poses, self._believed = found.poses, found.believed
            self.component = self._joined()
        numbers, sizes_of = np.unique(self.component, return_counts=True)
        self.components = sorted(
            (np.flatnonzero(self.component == c).tolist() for c in numbers[sizes_of > 1]),
            key=lambda members: (-len(members), members),
        )

    def unseen(self) -> list[Laid]:
        """Pairs that lie near enough to overlap, but of which nobody knows yet what they show of each other there."""
        if self._is_seen:
            return self._parts.unseen()
        return [at for at in self._near() if (at.i, at.j) not in self.results and self._looks.find(at) is None]

    def saw(self, laid: Laid, look: Look) -> None:
        """Takes what a pair shows where it is laid."""
        self._looks.add(laid, look)

    def settle(self) -> bool:
        """Lays scans anew by what was seen; whether anything has changed."""
        changed = self._is_seen and self._parts.settle()
        self._decide()
        return changed

    def overlaps(self) -> dict[Pair, float]:
        """What share of their surface pairs show of each other where they lie, of those that were looked at."""
        return {(at.i, at.j): look.on for at in self._near() if (look := self._looks.find(at)) is not None}

    def _near(self) -> Iterator[Laid]:
        return self._looks.within(self.poses, self._parts.label if self._is_seen else self.component)

    def believed(self, members: Sequence[int]) -> list[Edge]:
        """The edges between some scans that the others do not contradict."""
        inside = set(members)
        return [e for e, ok in self._judged() if ok and e.i in inside and e.j in inside]

    def moved(self, scan: int, twist: Floats) -> float:
        """How far a twist (6,) in its own frame moves what a scan shows, at most."""
        return self._looks.moved(scan, twist)

    def guesses(self) -> Given:
        """The poses, as a guess for pairs within a component."""
        return Given(list(self.poses), None, (), is_rough=False)

    def told(self, believed: bool) -> list[tuple[int, int, PairResult]]:
        """The pairs that are believed, or not."""
        return [(e.i, e.j, self.results[e.i, e.j]) for e, ok in self._judged() if ok == believed]

    def reasons_of(self, scans: Iterable[int]) -> dict[int, str]:
        """Why scans are in no component."""
        return {k: self._reason_of(k) for k in scans}

    def _judged(self) -> Iterable[tuple[Edge, bool]]:
        same = np.array([self.component[e.i] == self.component[e.j] for e in self.edges], bool)
        return zip(self.edges, self._believed & same, strict=True)

    def _tied(self) -> NDArray[np.int64]:
        """The component (n,) of each scan: the believed edges tie them."""
        label = np.arange(self._count)
        for edge, ok in zip(self.edges, self._believed, strict=True):
            if ok:
                label[label == label[edge.j]] = label[edge.i]
        return label

    def _joined(self) -> NDArray[np.int64]:
        """The component (n,) of each scan. One edge joins two scans if it is certain; others, as along a street that
        holds a pose in part only, join where two agree."""
        label, links = np.arange(self._count), []
        for edge, ok in zip(self.edges, self._believed, strict=True):
            result = self.results[edge.i, edge.j]
            if ok and is_certain(result):
                label[label == label[edge.j]] = label[edge.i]
            elif ok:
                links.append((edge.i, edge.j, weight_of(result)))
        while True:
            between: dict[Pair, float] = {}
            for i, j, agrees in links:
                a, b = sorted((int(label[i]), int(label[j])))
                between[a, b] = between.get((a, b), 0) + agrees * (a != b)
            best = max(between, key=lambda pair: (between[pair], pair), default=(0, 0))
            if between.get(best, 0) <= _AGREE:
                return label
            label[label == best[1]] = best[0]

    def _reason_of(self, scan: int) -> str:
        asked = [(r.evidence.strength if r.evidence else 0.0, r) for pair, r in self.results.items() if scan in pair]
        if not asked:
            return "no other scan looks like it: no pair was worth a registration"
        if any(result.accepted for _, result in asked):
            return "the pairs that were accepted with it are contradicted by the others"
        best = max(asked, key=lambda pair: pair[0])[1]
        return f"none of {len(asked)} registrations was accepted; the best: {best.verdict}"


def is_certain(result: PairResult) -> bool:
    """Whether a pair alone joins two scans: it is accepted, and no sensor that is known looked through the other's
    surface, not even through as much as furniture that was moved."""
    return result.accepted and (result.evidence is None or (result.evidence.seen_through or 0.0) <= CLEAR)


def clarity(result: PairResult) -> float:
    """1 where no sensor that is known looked through the other's surface, less where one did."""
    seen_through = 0.0 if result.evidence is None else result.evidence.seen_through or 0.0
    return 1 / (1 + (seen_through / CLEAR) ** 2)


def usable(result: PairResult) -> bool:
    """Whether a pair says something of its poses: it is accepted, or would be if its pose were held on all sides and
    other poses agreed somewhat less; less suffices where a sensor is known and did not look through the other."""
    return weight_of(result) > 0


def accepted_if_held(result: PairResult) -> bool:
    """Whether a pair is accepted, or would be if its pose were held on all sides, as it is not along a street."""
    evidence = result.evidence
    return result.accepted or (evidence is not None and replace(evidence, hold=1.0).reason.accepts)


def weight_of(result: PairResult) -> float:
    """What a pair counts for where several must agree: 1 if it would be accepted but for what does not hold it."""
    evidence = result.evidence
    if accepted_if_held(result):
        return clarity(result)
    if evidence is None:
        return 0.0
    is_clear = evidence.seen_through is not None and evidence.seen_through <= CLEAR
    lenient = replace(evidence, hold=1.0, margin=np.inf if is_clear else _CLOSE * evidence.margin)
    return clarity(result) * (1.0 if is_clear else 0.5) * lenient.reason.accepts


def _edge_of(i: int, j: int, result: PairResult) -> Edge:
    strength = (result.evidence.strength if result.evidence else 1.0) * weight_of(result)
    return Edge(i, j, result.T_target_source, result.information, result.reference_point, max(strength, 1e-6))


def _told_of(result: PairResult) -> Told:
    through = None if result.evidence is None else result.evidence.seen_through
    strength = result.evidence.strength if result.evidence else 1.0
    if through is None and is_certain(result):
        through = 0.0  # no sensor of this pair is known, but of others: the verdict alone speaks for it
    look = Look(max(result.overlap, result.overlap_target), through)
    return Told(result.T_target_source, says(look), strength * weight_of(result), is_certain(result))
