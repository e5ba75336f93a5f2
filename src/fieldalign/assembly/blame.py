"""Which edges of a tree to give up: those that lay scans where the sensors of others looked through them.

A wrong edge between places that look alike may close no cycle that would contradict it. But it lays all scans of its
one side on those of the other, and of these pairs, which nobody registered, many contradict each other.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeAlias

from ..fields.protocol import Floats
from .consensus import Consensus

Vote: TypeAlias = tuple[int, int, float]  # two scans, and what speaks against how the tree lays them, less what for it


def blamed(tree: Consensus, votes: Sequence[Vote], strength: Floats) -> set[int]:
    """The edges, by their number, that explain what speaks against: of what those before do not explain, each the one
    with the most against it, for its strength (m,)."""
    left = {k: path for k, (i, j, _) in enumerate(votes) if (path := tree.path(i, j))}
    found: set[int] = set()
    while True:
        excess: dict[int, float] = {}
        for k, path in left.items():
            for edge in path:
                excess[edge] = excess.get(edge, 0.0) + votes[k][2]
        worst = max(excess, key=lambda edge: (excess[edge] / strength[edge], -edge), default=-1)
        if worst < 0 or excess[worst] <= 0:
            return found
        found.add(worst)
        left = {k: path for k, path in left.items() if worst not in path}
