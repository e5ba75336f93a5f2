"""What was found of pairs of scans, whom of them to believe, and which scans belong together."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..fields.protocol import Floats
from ..motions import inverse, log_motion, reach_of
from .blame import blamed
from .consensus import Consensus, consensus
from .pair_result import PairResult
from .pose_graph import Edge
from .world import Given

_CLEAR = 0.003  # share of a surface that a sensor looked through: less in a static scene, more where places look alike
_AGREE = 1.5    # more than so many uncertain pairs that agree join what they lie between, unclear ones count less
_AS_BEFORE = 0.1  # voxels: a scan that moves no further lies where it was seen
_OBJECTION, _CHANCE = 20.0, 0.5  # to a pair that was accepted: one that was looked through, and one that was not
_CLOSE, _CLOSER = 1.7, 2.0  # by so much the margin may fall short, the latter where no known sensor objects


class Graph:
    """All that was found of pairs, and what follows from it."""

    def __init__(self, lengths: dict[int, tuple[float, float]], count: int, seed: int) -> None:
        self._lengths, self._count, self._seed = lengths, count, seed
        self.unit = float(np.median([voxel for voxel, _ in lengths.values()])) if lengths else 1.0
        self.results: dict[tuple[int, int], PairResult] = {}
        self._given_up: set[tuple[int, int]] = set()
        self._seen: dict[tuple[int, int], tuple[Floats, float, float | None]] = {}
        self._consensus: Consensus | None = None
        self.component: NDArray[np.int64] = np.arange(count)
        self.components: list[list[int]] = []

    def add(self, results: dict[tuple[int, int], PairResult]) -> None:
        """Takes the results of pairs (i, j), and decides anew whom to believe."""
        self.results |= results
        self.pairs = [pair for pair, r in self.results.items() if usable(r) and pair not in self._given_up]
        if not self.pairs:
            return
        self.edges = [_edge_of(*pair, self.results[pair]) for pair in self.pairs]
        sizes = [(self._lengths[i], self._lengths[j]) for i, j in self.pairs]
        voxels = np.array([max(a[0], b[0]) for a, b in sizes])
        extents = np.array([min(a[1], b[1]) for a, b in sizes])
        self._consensus = consensus(self._count, self.edges, voxels, extents, self._seed)
        self.component = self._joined()
        numbers, sizes_of = np.unique(self.component, return_counts=True)
        self.components = sorted(
            (np.flatnonzero(self.component == c).tolist() for c in numbers[sizes_of > 1]),
            key=lambda members: (-len(members), members),
        )

    def unseen(self, count: int) -> list[tuple[int, int]]:
        """Pairs (i, j) that the tree lays near enough to overlap, of either's nearest few, but of which nobody knows
        yet what they show of each other where they lie."""
        roots = np.zeros(0, int) if self._consensus is None else self._consensus.roots()
        near: list[tuple[int, int]] = []
        for root in np.flatnonzero(np.bincount(roots, minlength=1) > 1):
            members = np.flatnonzero(roots == root)
            places = self.poses[members, :3, 3]
            reach = np.array([self._lengths[int(k)][1] / 2 for k in members])
            away = np.linalg.norm(places[:, None] - places, axis=2)
            rank = np.argsort(np.argsort(away, axis=1, kind="stable"), axis=1)  # 0: the scan itself
            may = (np.minimum(rank, rank.T) <= count) & (away < np.minimum(reach, reach[:, None]))
            near += [(int(members[a]), int(members[b])) for a, b in np.argwhere(np.triu(may, 1))]
        return [pair for pair in near if pair not in self.results and not self._is_as_seen(pair)]

    def saw(self, pair: tuple[int, int], T_ij: Floats, on: float, through: float | None) -> None:
        """Takes what a pair shows of each other at T_ij (4, 4): the share of surface that lies on the other's, and the
        share that was looked through, None where no sensor is known."""
        self._seen[pair] = T_ij, on, through

    def seen(self) -> Iterator[tuple[int, int, float, float | None]]:
        """Pairs i, j that lie where they were seen, and these shares."""
        for pair, (_, on, through) in self._seen.items():
            if self._is_as_seen(pair):
                yield *pair, on, through

    def _is_as_seen(self, pair: tuple[int, int]) -> bool:
        if pair not in self._seen or self._consensus is None:
            return False
        i, j = pair
        off = log_motion(inverse(self._seen[pair][0]) @ inverse(self.poses[i]) @ self.poses[j])
        return reach_of(off, self._lengths[j][1]) <= _AS_BEFORE * self.unit

    def check(self) -> bool:
        """Gives up edges that lay scans where sensors looked through them, and joins what lies well; whether anything
        has changed."""
        if self._consensus is None:
            return False
        before = self.component
        believed = zip(self.edges, self._consensus.believed, strict=True)
        votes = [(e.i, e.j, -clarity(self.results[e.i, e.j])) for e, ok in believed if ok]
        votes += [(i, j, -_says(on, through)) for i, j, on, through in self.seen()]
        guilty = blamed(self._consensus, votes, np.sqrt([edge.strength for edge in self.edges]))
        self._given_up |= {self.pairs[k] for k in guilty}
        self.add({})
        return bool(guilty) or not np.array_equal(before, self.component)

    @property
    def poses(self) -> Floats:
        """The poses (n, 4, 4) along the tree that is believed."""
        return np.tile(np.eye(4), (self._count, 1, 1)) if self._consensus is None else self._consensus.poses

    def believed(self, members: Sequence[int]) -> list[Edge]:
        """The edges between some scans that the others do not contradict."""
        inside = set(members)
        return [e for e, ok in self._judged() if ok and e.i in inside and e.j in inside]

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
        if self._consensus is None:
            return []
        same = [self.component[e.i] == self.component[e.j] for e in self.edges]
        return zip(self.edges, self._consensus.believed & np.array(same), strict=True)

    def _joined(self) -> NDArray[np.int64]:
        """The component (n,) of each scan. One edge joins two scans if it is certain; others, as along a street that
        holds a pose in part only, join where two agree, or where what they lay on each other agrees."""
        assert self._consensus is not None
        label = np.arange(self._count)
        links = [(i, j, _says(on, through)) for i, j, on, through in self.seen()]
        for edge, ok in zip(self.edges, self._consensus.believed, strict=True):
            result = self.results[edge.i, edge.j]
            if ok and is_certain(result):
                label[label == label[edge.j]] = label[edge.i]
            elif ok:
                links.append((edge.i, edge.j, weight_of(result)))
        while True:
            between: dict[tuple[int, int], float] = {}
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
    return result.accepted and (result.evidence is None or (result.evidence.seen_through or 0.0) <= _CLEAR)


def _says(on: float, through: float | None) -> float:
    """What speaks for the pose of a pair that was not registered, an accepted pair being 1; less than 0: against it."""
    if through is None:
        return 0.0
    clear = clarity_of(through)
    return on * (_CHANCE * clear - _OBJECTION * (1 - clear))


def clarity(result: PairResult) -> float:
    """1 where no sensor that is known looked through the other's surface, less where one did."""
    return clarity_of(0.0 if result.evidence is None else result.evidence.seen_through or 0.0)


def clarity_of(seen_through: float) -> float:
    """The same of the share of a surface that was looked through."""
    return 1 / (1 + (seen_through / _CLEAR) ** 2)


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
    is_clear = evidence.seen_through is not None and evidence.seen_through <= _CLEAR
    lenient = replace(evidence, hold=1.0, margin=(_CLOSER if is_clear else _CLOSE) * evidence.margin)
    return clarity(result) * (1.0 if is_clear else 0.5) * lenient.reason.accepts


def _edge_of(i: int, j: int, result: PairResult) -> Edge:
    strength = (result.evidence.strength if result.evidence else 1.0) * weight_of(result)
    return Edge(i, j, result.T_target_source, result.information, result.reference_point, max(strength, 1e-6))
