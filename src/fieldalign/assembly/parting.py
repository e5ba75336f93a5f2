"""Which scans of a part had better go: sums over links, each what speaks for two scans being laid as they are."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from typing import TypeAlias

import numpy as np

Links: TypeAlias = Mapping[int, Mapping[int, float]]  # of each scan, by the other one; against it: less than 0

_SEEDS = 3    # beginnings that are tried, the most promising
_SWEEPS = 10  # in which scans change the side
_FINE, _BOUND = 1e4, 10**8  # flows are whole numbers; what is never cut


def pieces(members: Sequence[int], links: Links) -> list[list[int]]:
    """The members of a part in pieces that nothing but what speaks against them ties together."""
    free, found = set(members), []
    while free:
        piece, rim = set(), [min(free)]
        while rim:
            k = rim.pop()
            if k in free:
                free.remove(k)
                piece.add(k)
                rim += [j for j, says in links[k].items() if says > 0 and j in free]
        found.append(sorted(piece))
    return found


def parted(members: Sequence[int], links: Links, least: float) -> list[int]:
    """The scans that had better be parted from the others, since more than `least` speaks against those being laid with
    these; none where a part is best whole."""
    against = sorted((says, i, j) for i in members for j, says in links[i].items() if says < 0 and i < j)
    best, chosen = -least, list[int]()
    for _, i, j in against[:_SEEDS]:
        side = _side(i, j, members, links)
        between = sum(says for k in side for m, says in links[k].items() if m not in side)
        if between < best:
            best, chosen = between, sorted(side)
    return chosen


def _side(i: int, j: int, members: Sequence[int], links: Links) -> set[int]:
    """The scans that hang on i rather than on j: each joins the side that more speaks for, the clearest first, and
    changes it where it turns out to stand on the wrong one."""
    side, pull = dict[int, int](), defaultdict[int, float](float)

    def put(k: int, sign: int) -> None:
        step, side[k] = sign - side.get(k, 0), sign
        for m, says in links[k].items():
            pull[m] += step * says

    put(i, 1)
    put(j, -1)
    free = set(members) - {i, j}
    while free and pull[k := max(free, key=lambda m: (abs(pull[m]), -m))]:
        free.remove(k)
        put(k, 1 if pull[k] > 0 else -1)
    for _ in range(_SWEEPS):
        astray = [k for k in sorted(side) if k not in (i, j) and pull[k] * side[k] < 0]
        for k in astray:
            put(k, -side[k])
        if not astray:
            break
    return {k for k, sign in side.items() if sign > 0}


def seam(ours: Sequence[int], theirs: Sequence[int], members: Sequence[int], links: Links) -> tuple[float, list[int]]:
    """What holds some scans of a part and others together at the weakest place between them (the least cut, by the
    greatest flow; Ford & Fulkerson 1956), and the scans on the other ones' side of it."""
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import breadth_first_order, maximum_flow

    row = {k: r for r, k in enumerate(members)}
    ties = [(row[k], row[m], round(_FINE * says)) for k in members for m, says in links[k].items() if says > 0]
    start, end = len(row), len(row) + 1
    ties += [(start, row[k], _BOUND) for k in ours] + [(row[k], end, _BOUND) for k in theirs]
    rows, columns, held = np.array(ties, np.int32).T
    flow = maximum_flow(csr_array((held, (rows, columns)), shape=(end + 1, end + 1)), start, end)
    taken = np.asarray(flow.flow[rows, columns]).ravel()
    free = held > taken
    left = csr_array((np.ones(free.sum()), (rows[free], columns[free])), shape=(end + 1, end + 1))
    reached = set(breadth_first_order(left, start, return_predecessors=False).tolist())
    return flow.flow_value / _FINE, [k for k in members if row[k] not in reached]


def shifted(members: Sequence[int], there: Mapping[int, float], links: Links) -> tuple[float, list[int]]:
    """The scans of a part of which most is gained if they go elsewhere together, where `there` says what speaks for
    each; and that gain. They leave what speaks for them here, and take along what ties them to each other."""
    best, chosen = 0.0, list[int]()
    for seed in sorted((k for k in members if there.get(k, 0) > 0), key=lambda k: (-there[k], k))[:_SEEDS]:
        gain = {k: there.get(k, 0.0) - sum(links[k].values()) for k in members}
        side, total, k = list[int](), 0.0, seed
        while True:
            side.append(k)
            total += gain.pop(k)
            for m, says in links[k].items():
                if m in gain:
                    gain[m] += 2 * says  # neither leaves the other
            if total > best:
                best, chosen = total, sorted(side)
            if not gain:
                break
            k = max(gain, key=lambda m: (gain[m], -m))
    return best, chosen
