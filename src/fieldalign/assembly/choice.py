"""Which pairs to try, so that few are tried in vain and every scan is joined that can be."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ..fields.protocol import Floats

_AT_FIRST = 3     # likeliest partners of a scan
_THEN = 2         # more of them in each round, for scans whose component is not whole
_MOST = 12        # pairs that a scan asks for, of those that glances propose
_FEW = 12         # scans of which all pairs are tried
_HOPE = 0.005     # the score of a glance that is worth a try
_ALONE = 3        # scans of a component, at most, that are also tried where glances see no hope,
_AT_LAST = 20     # so many pairs of each scan in a round,
_EACH = 10        # until so many pairs were tried for each scan there is

Pairs = list[tuple[int, int]]


class Choice:
    """Pairs in the order in which they are worth trying.

    likeness: (n, n), scores of glances, 0 where two scans were not looked at. ordered: whether successive scans are
    neighbours. known: (n,), which scans can be had at all.
    """

    def __init__(self, likeness: Floats, ordered: bool, known: NDArray[np.bool_]) -> None:
        self._likeness, self._ordered, self._known = likeness, ordered, known
        self._asked = np.zeros(len(known), int)
        self.tried: set[tuple[int, int]] = set()

    def first(self) -> Pairs:
        """Of few scans all pairs; of many each one's likeliest partners, and the next one where they are ordered."""
        scans = np.flatnonzero(self._known)
        if len(scans) <= _FEW:
            return self._new((int(i), int(j)) for i in scans for j in scans if i < j)
        following = pairwise(scans) if self._ordered else ()
        pairs = self._new((int(i), int(j)) for i, j in following)
        return pairs + self._likeliest(scans, np.ones_like(self._likeness, bool), _AT_FIRST)

    def more(self, component: NDArray[np.int64]) -> Pairs:
        """The next likeliest partners in other components (n,), for the scans outside the largest one; then, for those
        that are (nearly) alone, also unlikely ones. None where all are joined or none is left to ask."""
        numbers, of, sizes = np.unique(component[self._known], return_inverse=True, return_counts=True)
        if len(numbers) < 2:
            return []
        outside = component != numbers[sizes.argmax()]
        scans = np.flatnonzero(self._known & outside & (self._asked < _MOST))
        may = component[:, None] != component[None]
        pairs = self._likeliest(scans, may, _THEN)
        if not pairs:
            known = np.flatnonzero(self._known)
            alone = known[(sizes[of] <= _ALONE) & outside[known]]
            left = _EACH * len(known) - len(self.tried)
            may = may & self._known
            pairs = [
                pair for i in alone
                for pair in self._new(((int(i), j) for j in self._partners(i, may)), _AT_LAST)
            ] if left >= _AT_LAST * len(alone) else []
        return pairs

    def _partners(self, i: int, may: NDArray[np.bool_]) -> list[int]:
        """The scans that one may be joined with, the likeliest first."""
        order = np.argsort(-self._likeness[i], kind="stable")
        return [int(j) for j in order if may[i, j] and i != j]

    def _likeliest(self, scans: NDArray[np.int64], may: NDArray[np.bool_], count: int) -> Pairs:
        pairs: Pairs = []
        for i in scans:
            partners = [j for j in self._partners(i, may) if self._likeness[i, j] > _HOPE]
            fresh = self._new(((int(i), j) for j in partners), min(count, _MOST - int(self._asked[i])))
            self._asked[i] += len(fresh)
            pairs += fresh
        return pairs

    def _new(self, pairs: object, most: int | None = None) -> Pairs:
        """Those that were not tried yet, at most so many; from now on they are."""
        fresh: Pairs = []
        for i, j in pairs:  # type: ignore[attr-defined]
            pair = (min(i, j), max(i, j))
            if most is not None and len(fresh) >= most:
                break
            if pair not in self.tried:
                self.tried.add(pair)
                fresh.append(pair)
        return fresh

    def add(self, pairs: Pairs) -> Pairs:
        """Of some pairs those that were not tried yet."""
        return self._new(pairs)
