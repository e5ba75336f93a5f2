"""From scans to a model, told in order: glances, pairs, whom to believe, one graph, all fields at once."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from itertools import groupby
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..clock import Clock
from ..dof import Dof
from ..fields.protocol import Floats
from ..motions import inverse
from .assembly import Assembly
from .choice import Choice, Pairs
from .fused import fused
from .graph import Graph
from .joint import Pull
from .looks import Look
from .origins import Origins
from .pair_result import PairResult
from .pose_graph import Edge, linearised, optimise
from .scan import read_scan
from .stages import Glances, Overlaps, Relate, pulls
from .work import Task
from .workshop import Workshop, name_of
from .world import Given, anchored

_TILE = 16          # scans on a side of a tile of glances
_OVERLAP = 0.3      # of either scan: pairs that overlap so much, by their poses, are registered, too
_LOOKS = 40         # rounds in which scans are laid anew by what sensors saw, at most
_NEIGHBOURS = 3     # of these, for each scan
_ROUNDS = 3         # of the joint refinement, at most
_STILL = 2e-3       # voxels: a step that moves no place further is its last
_MODEL = 0.25       # of a component's median voxel: the thinning of its model


def build(shop: Workshop, given: Given, ordered: bool, dof: Dof | None, seed: int) -> Assembly:
    """The whole assembly."""
    clock = Clock()
    lengths, places, origins, broken = shop.thin()
    own, given = Origins(origins, given), given.seen_from(origins)
    clock.lap("read")
    known = np.array([k in lengths for k in range(len(shop.clouds))])
    graph = Graph(lengths, places, len(known), seed)
    likeness = _near(given, lengths) if given.is_useful else _glances(shop, known, graph.unit, dof, seed)
    clock.lap("glance")
    choice = Choice(likeness, ordered, known)
    pairs = choice.first()
    while pairs:
        graph.add(_related(shop, pairs, given, dof, seed))
        clock.lap("pairs")
        _settled(shop, graph)
        clock.lap("check")
        pairs = choice.more(graph.component)
    near = choice.add(_overlapping(graph))
    graph.add(_related(shop, near, graph.guesses(), dof, seed))
    clock.lap("overlaps")
    poses: list[Any] = [None] * len(known)
    covariances: list[Any] = [None] * len(known)
    for members in graph.components:
        placed, known_by = _refined(shop, graph, members, given, dof)
        placed = own.world(members) @ placed
        for row, scan in enumerate(members):
            poses[scan], covariances[scan] = placed[row], known_by[row]
    clock.lap("refine")
    models = []
    for members in graph.components:
        voxel = _MODEL * float(np.median([lengths[k][0] for k in members]))
        models.append(fused(members, lambda k: read_scan(shop.path(k)), poses, voxel, shop.threads))
    clock.lap("fuse")
    return Assembly(
        own.poses(poses), own.covariances(covariances), graph.components, own.pairs(graph.told(believed=True)),
        own.pairs(graph.told(believed=False)), broken | graph.reasons_of([k for k in lengths if poses[k] is None]),
        len(choice.tried), clock.laps, models,
    )


def _glances(shop: Workshop, known: NDArray[np.bool_], unit: float, dof: Dof | None, seed: int) -> Floats:
    """The likeness (n, n) of scans, by a glance at each pair."""
    scans = np.flatnonzero(known)
    tiles = [scans[k : k + _TILE] for k in range(0, len(scans), _TILE)]
    tasks = []
    for a, rows in enumerate(tiles):
        for columns in tiles[a:]:
            names = [name_of(k) for k in rows], [name_of(k) for k in columns]
            tasks.append(Task(f"glance {names[0][0]} {names[1][0]}", tuple(sorted({*names[0], *names[1]})), names))
    likeness = np.zeros((len(known), len(known)))
    found = shop.do("glancing", Glances(unit, seed, dof), tasks, plain=lambda scores: scores)
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


def _settled(shop: Workshop, graph: Graph) -> None:
    """Lays scans by what sensors saw, until nothing changes."""
    for _ in range(_LOOKS):
        asked = _look(shop, graph)
        if not graph.settle() and not asked:
            break


def _look(shop: Workshop, graph: Graph) -> bool:
    """Looks at pairs where they lie near each other: how much overlaps, and was looked through; whether at any."""
    asked = graph.unseen()
    rank = _neighbours_first(len(shop.clouds), [(laid.i, laid.j) for laid in asked])
    tasks = []
    for i, near in groupby(sorted(asked, key=lambda laid: (rank[laid.i], laid.i, laid.j)), key=lambda laid: laid.i):
        pairs = list(near)
        names = [name_of(laid.j) for laid in pairs]
        poses = np.stack([laid.T_ij for laid in pairs])
        tasks.append((pairs, Task(f"overlaps {i}", (name_of(i), *sorted(set(names))), (name_of(i), names, poses))))
    found = shop.do("comparing", Overlaps(graph.unit), [task for _, task in tasks])
    for pairs, task in tasks:
        for laid, shares in zip(pairs, found[task.key].value or [], strict=False):
            graph.saw(laid, Look(*shares))
    return bool(tasks)


def _neighbours_first(count: int, pairs: Pairs) -> NDArray[np.int64]:
    """The rank (n,) of each scan in an order in which scans that make pairs are near each other (Cuthill & McKee 1969),
    so that a worker finds at hand what it has just looked at."""
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import reverse_cuthill_mckee

    i, j = np.array(pairs, int).reshape(-1, 2).T
    ties = csr_array((np.ones(2 * len(i)), (np.r_[i, j], np.r_[j, i])), shape=(count, count))
    return np.argsort(reverse_cuthill_mckee(ties, symmetric_mode=True))


def _overlapping(graph: Graph) -> Pairs:
    """Pairs that were not tried, but overlap well by their poses: each scan's best few."""
    share = graph.overlaps()
    chosen: Pairs = []
    asked: Counter[int] = Counter()
    for i, j in sorted(share, key=lambda pair: -share[pair]):
        if share[i, j] >= _OVERLAP and min(asked[i], asked[j]) < _NEIGHBOURS:
            asked.update((i, j))
            chosen.append((i, j))
    return chosen


def _refined(
    shop: Workshop, graph: Graph, members: list[int], given: Given, dof: Dof | None
) -> tuple[Floats, Floats]:
    """The poses (n, 4, 4) of a component's scans and their covariances (n, 6, 6)."""
    row = {scan: k for k, scan in enumerate(members)}
    edges = [replace(e, i=row[e.i], j=row[e.j]) for e in graph.believed(members)]
    world, poses, anchors = anchored(graph.poses[members], members, given, dof)
    poses = optimise(poses, edges, anchors)
    for _ in range(_ROUNDS):
        system, known = anchors.system(poses), []
        for edge, pull in _pulled(shop, members, poses, edges):
            A_i, A_j = edge.jacobians(poses)
            system.add({edge.i: A_i, edge.j: A_j}, pull.H, pull.g)
            known += [edge] * (edge.i < edge.j)  # the reverse knows the same
        step = system.step()
        poses = anchors.moved(poses, step)
        if max(graph.moved(scan, x) for scan, x in zip(members, step, strict=True)) < _STILL * graph.unit:
            break
    covariances = linearised(poses, known, anchors).covariances()
    return world @ poses, covariances


def _pulled(shop: Workshop, members: list[int], poses: Floats, edges: list[Edge]) -> list[tuple[Edge, Pull]]:
    """What the fields say at the present poses: of each edge, and of its reverse."""
    ends = [(e.i, e.j) for e in edges] + [(e.j, e.i) for e in edges]
    tasks = []
    for i, j in ends:
        a, b = name_of(members[i]), name_of(members[j])
        tasks.append(Task(f"pull {a} {b}", (a, b), (a, b, inverse(poses[i]) @ poses[j])))
    found = shop.do("refining", pulls, tasks)
    return [
        (found[task.key].value.as_edge(*pair, task.data[2], 1.0), found[task.key].value)
        for pair, task in zip(ends, tasks, strict=True) if found[task.key].error is None
    ]
