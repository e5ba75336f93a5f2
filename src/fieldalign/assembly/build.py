"""From scans to a model, told in order: glances, pairs, whom to believe, one graph, all fields at once."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..clock import Clock
from ..dof import Dof
from ..fields.protocol import Floats
from ..motions import inverse
from ..verdict import Evidence
from .assembly import Assembly
from .choice import Choice, Pairs
from .consensus import Consensus, consensus
from .fused import fused
from .joint import Pull
from .pair_result import PairResult
from .pose_graph import Edge, linearised, optimise
from .scan import read_scan
from .stages import Glances, Overlaps, Relate, pulls
from .work import Task
from .workshop import Workshop, name_of
from .world import Given, anchored

_TILE = 16          # scans on a side of a tile of glances
_OVERLAP = 0.3      # of either scan: pairs that overlap so much, by their poses, are registered, too
_NEIGHBOURS = 3     # of these, for each scan
_ROUNDS = 3         # of the joint refinement
_MODEL = 0.25       # of a component's median voxel: the thinning of its model


def build(shop: Workshop, given: Given, ordered: bool, dof: Dof | None, seed: int) -> Assembly:
    """The whole assembly."""
    clock = Clock()
    lengths, broken = shop.thin()
    clock.lap("read")
    known = np.array([k in lengths for k in range(len(shop.clouds))])
    likeness = _near(given, lengths) if given.is_useful else _glances(shop, known, dof, seed)
    clock.lap("glance")
    graph = _Graph(lengths, len(known), seed)
    choice = Choice(likeness, ordered, known)
    pairs = choice.first()
    while pairs:
        graph.add(_related(shop, pairs, given, dof, seed))
        pairs = choice.more(graph.component)
    clock.lap("pairs")
    graph.add(_related(shop, choice.add(_overlapping(shop, graph)), graph.guesses(), dof, seed))
    clock.lap("overlaps")
    poses: list[Any] = [None] * len(known)
    covariances: list[Any] = [None] * len(known)
    for members in graph.components:
        placed, known_by = _refined(shop, graph, members, given, dof)
        for row, scan in enumerate(members):
            poses[scan], covariances[scan] = placed[row], known_by[row]
    clock.lap("refine")
    models = []
    for members in graph.components:
        voxel = _MODEL * float(np.median([lengths[k][0] for k in members]))
        models.append(fused(members, lambda k: read_scan(shop.path(k)), poses, voxel, shop.threads))
    clock.lap("fuse")
    return Assembly(
        poses, covariances, graph.components, graph.told(believed=True), graph.told(believed=False),
        broken | graph.reasons_of([k for k in lengths if poses[k] is None]), len(choice.tried), clock.laps, models,
    )


class _Graph:
    """All that was found of pairs, and what follows from it."""

    def __init__(self, lengths: dict[int, tuple[float, float]], count: int, seed: int) -> None:
        self._lengths, self._count, self._seed = lengths, count, seed
        self.results: dict[tuple[int, int], PairResult] = {}
        self._consensus: Consensus | None = None
        self.component: NDArray[np.int64] = np.arange(count)
        self.components: list[list[int]] = []

    def add(self, results: dict[tuple[int, int], PairResult]) -> None:
        """Takes the results of pairs (i, j), and decides anew whom to believe."""
        self.results |= results
        self.pairs = [pair for pair, result in self.results.items() if usable(result)]
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
        """The component (n,) of each scan. One edge joins two scans if it is accepted; edges that hold a pose in part
        only, as along a street, join where at least two agree."""
        assert self._consensus is not None
        label = np.arange(self._count)
        weak: list[Edge] = []
        for edge, ok in zip(self.edges, self._consensus.believed, strict=True):
            if ok and self.results[edge.i, edge.j].accepted:
                label[label == label[edge.j]] = label[edge.i]
            elif ok:
                weak.append(edge)
        while True:
            between: dict[tuple[int, int], int] = {}
            for edge in weak:
                a, b = sorted((int(label[edge.i]), int(label[edge.j])))
                between[a, b] = between.get((a, b), 0) + (a != b)
            joined = [pair for pair, number in between.items() if number >= 2]
            if not joined:
                return label
            label[label == joined[0][1]] = joined[0][0]

    def _reason_of(self, scan: int) -> str:
        asked = [(r.evidence.strength if r.evidence else 0.0, r) for pair, r in self.results.items() if scan in pair]
        if not asked:
            return "no other scan looks like it: no pair was worth a registration"
        if any(result.accepted for _, result in asked):
            return "the pairs that were accepted with it are contradicted by the others"
        best = max(asked, key=lambda pair: pair[0])[1]
        return f"none of {len(asked)} registrations was accepted; the best: {best.verdict}"


def usable(result: PairResult) -> bool:
    """Whether a pair says something of its poses: it is accepted, or would be if its pose were held on all sides."""
    if result.accepted:
        return True
    evidence: Evidence | None = result.evidence
    return evidence is not None and replace(evidence, hold=1.0).reason.accepts


def _edge_of(i: int, j: int, result: PairResult) -> Edge:
    strength = result.evidence.strength if result.evidence else 1.0
    return Edge(i, j, result.T_target_source, result.information, result.reference_point, max(strength, 1e-3))


def _glances(shop: Workshop, known: NDArray[np.bool_], dof: Dof | None, seed: int) -> Floats:
    """The likeness (n, n) of scans, by a glance at each pair."""
    scans = np.flatnonzero(known)
    tiles = [scans[k : k + _TILE] for k in range(0, len(scans), _TILE)]
    tasks = []
    for a, rows in enumerate(tiles):
        for columns in tiles[a:]:
            names = [name_of(k) for k in rows], [name_of(k) for k in columns]
            tasks.append(Task(f"glance {names[0][0]} {names[1][0]}", tuple(sorted({*names[0], *names[1]})), names))
    likeness = np.zeros((len(known), len(known)))
    found = shop.do("glancing", Glances(seed, dof), tasks, plain=lambda scores: scores)
    for task in tasks:
        done = found[task.key]
        if done.error is None:
            side, other = ([int(name) for name in names] for names in task.data)
            likeness[np.ix_(side, other)] += np.array(done.value)
    return likeness + likeness.T


def _near(given: Given, lengths: dict[int, tuple[float, float]]) -> Floats:
    """The likeness (n, n) of scans whose poses are known: how near they lie, in their extents."""
    likeness = np.zeros((len(given.poses), len(given.poses)))
    places = {k: pose[:3, 3] for k, pose in enumerate(given.poses) if pose is not None and k in lengths}
    for i, here in places.items():
        for j, there in places.items():
            apart = float(np.linalg.norm(here - there)) / (lengths[i][1] / 2 + lengths[j][1] / 2)
            likeness[i, j] = max(0.0, 1 - apart) if i != j else 0.0
    return likeness


def _related(
    shop: Workshop, pairs: Pairs, given: Given, dof: Dof | None, seed: int
) -> dict[tuple[int, int], PairResult]:
    """The registrations of pairs (i, j), scan j on scan i."""
    tasks = []
    for i, j in pairs:
        a, b = name_of(i), name_of(j)
        guess = given.between(i, j)
        tasks.append(Task(f"pair {a} {b}{'' if guess is None else ' near'}", (a, b), (a, b, guess, given.is_rough)))
    found = shop.do("registering", Relate(seed, dof, shop.threads), tasks, PairResult.to_dict, PairResult.from_dict)
    results = {}
    for (i, j), task in zip(pairs, tasks, strict=True):
        done = found[task.key]
        results[i, j] = done.value if done.error is None else PairResult.failed(name_of(j), name_of(i), done.error)
    return results


def _overlapping(shop: Workshop, graph: _Graph) -> Pairs:
    """Pairs that were not tried, but overlap well by their poses: each scan's best few."""
    candidates = []
    for members in graph.components:
        places = {k: graph.poses[k][:3, 3] for k in members}
        reach = {k: graph._lengths[k][1] / 2 for k in members}
        candidates += [
            (i, j) for i in members for j in members
            if i < j and (i, j) not in graph.results and np.linalg.norm(places[i] - places[j]) < min(reach[i], reach[j])
        ]
    tasks = []
    for i, j in candidates:
        names = name_of(i), name_of(j)
        tasks.append(Task(f"overlap {i} {j}", names, (*names, inverse(graph.poses[i]) @ graph.poses[j])))
    found = shop.do("comparing", Overlaps(), tasks)
    share = {pair: found[task.key].value or 0.0 for pair, task in zip(candidates, tasks, strict=True)}
    chosen: Pairs = []
    asked = dict.fromkeys(range(len(shop.clouds)), 0)
    for i, j in sorted(share, key=lambda pair: -share[pair]):
        if share[i, j] >= _OVERLAP and min(asked[i], asked[j]) < _NEIGHBOURS:
            asked[i], asked[j] = asked[i] + 1, asked[j] + 1
            chosen.append((i, j))
    return chosen


def _refined(
    shop: Workshop, graph: _Graph, members: list[int], given: Given, dof: Dof | None
) -> tuple[Floats, Floats]:
    """The poses (n, 4, 4) of a component's scans and their covariances (n, 6, 6)."""
    row = {scan: k for k, scan in enumerate(members)}
    edges = [replace(e, i=row[e.i], j=row[e.j]) for e in graph.believed(members)]
    world, poses, anchors = anchored(graph.poses[members], members, given, dof)
    poses = optimise(poses, edges, anchors)
    for _ in range(_ROUNDS):
        system = anchors.system(poses)
        for edge, pull in _pulled(shop, members, poses, edges, both_ways=True):
            A_i, A_j = edge.jacobians(poses)
            system.add({edge.i: A_i, edge.j: A_j}, pull.H, pull.g)
        poses = anchors.moved(poses, system.step())
    final = [edge for edge, _ in _pulled(shop, members, poses, edges, both_ways=False)]
    covariances = linearised(poses, final, anchors).covariances()
    poses = world @ poses
    for scan in set(given.fixed) & set(members):
        poses[row[scan]] = given.poses[scan]  # to the last bit
    return poses, covariances


def _pulled(
    shop: Workshop, members: list[int], poses: Floats, edges: list[Edge], both_ways: bool
) -> list[tuple[Edge, Pull]]:
    """What the fields say at the present poses: of each edge, and of its reverse."""
    ends = [(e.i, e.j) for e in edges] + [(e.j, e.i) for e in edges if both_ways]
    tasks = []
    for i, j in ends:
        a, b = name_of(members[i]), name_of(members[j])
        tasks.append(Task(f"pull {a} {b}", (a, b), (a, b, inverse(poses[i]) @ poses[j])))
    found = shop.do("refining", pulls, tasks)
    return [
        (found[task.key].value.as_edge(*pair, task.data[2], 1.0), found[task.key].value)
        for pair, task in zip(ends, tasks, strict=True) if found[task.key].error is None
    ]
