"""Clouds without the surfels of a surface, too sparse or too noisy for planes: the paper's method from several turns,
and of the poses where it ends the one that lays the points next to each other."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from ..alignment import align, descend
from ..alignment.copies import closest
from ..arguments import MAX_NEIGHBOURS
from ..fields import PointField, sampled
from ..fields.protocol import Floats
from ..lazy import lazy
from ..motions import apply, exp_twist, inverse, translation
from ..prepared import PreparedCloud
from ..settings import PRESETS, Settings
from ..verdict import Reason
from .pair import Pair
from .refined import Refined, at_copies, last_level, refine

_HARDLY_ANY, _FEW = 400, 1500  # surfels: a surface that is known fills some three thousand voxels
_ALIKE = 1.5      # times as large as the other may a cloud be
_COARSE, _MOST = 2500, 10_000  # points of a cloud, where it is smoothed: for the starts, and for the best few ends
_SMOOTH = 150     # of that share of them are the neighbours that show a surface through noise of a tenth of its size
_FIRST, _LAST = 200, 2000  # pseudo points: from each start, and of the best few poses
_FINALISTS = 3
_DENSER = 4       # times as many points: a much denser cloud
_PROBED = 1000    # points of each cloud that are asked how near the other's are
_SHARE = 0.5      # of them, the nearest ones: the rest may have no partner
_MEETS = 1e-3     # of the distance between neighbouring points: so near, points are the same
_CLEARLY = 0.985  # of the misfit: so much less is more than what noise does
_TURNED = 0.6     # of the angle that is allowed: where the starts around a guess lie
_NARROW = np.radians(70)  # the angle up to which starts around the guess reach everything


def is_for_points(pair: Pair, by_surfels: Reason) -> bool:
    """Whether the points may say more than surfels: these are hardly any; or the pose that they found does not hold,
    and they are too few to show a surface, or the clouds are copies."""
    if pair.allowed is not None or pair.grows or not (pair.source.is_points and pair.target.is_points):
        return False
    sizes = [_size(cloud) for cloud in (pair.source, pair.target)]
    if max(sizes) > _ALIKE * min(sizes):  # a part in a whole: neither fields nor centroids are alike
        return False
    fewest = min(map(len, pair.surfaces()))
    holds = by_surfels.accepts or by_surfels is Reason.AMBIGUOUS
    return fewest < _HARDLY_ANY or (not holds and (fewest < _FEW or pair.source.is_copy_of(pair.target)))


def by_points(pair: Pair, found: Refined, angle: float, seed: int, threads: int) -> Refined:
    """The pose that lays the points of both clouds nearest to each other: the one that the surfels found, or one that
    the paper's method finds from turns within an angle (rad) of the guess, or from all where there is none."""
    exact, coarse, smooth = Points(pair.source, pair.target, 1), _smoothed(pair, _COARSE), _smoothed(pair, _MOST)
    guess = np.eye(4) if pair.guess is None else pair.guess
    turns = [turn @ guess for turn in _turns(angle)]
    if pair.source.is_copy_of(pair.target):
        for turn in turns:
            T = exact.end(exact.laid(turn), _LAST, seed, threads)
            if exact.misfit(T) < _MEETS * exact.spacing:
                return at_copies(pair, _standing(pair, T))

    ends = [coarse.end(coarse.laid(turn), _FIRST, seed, threads) for turn in turns]
    ends = [T for T in ends if pair.is_within(angle, T)] or [guess]
    ends = sorted(ends, key=lambda T: coarse.residual(T, seed, threads))[:_FINALISTS]
    best = min((smooth.end(T, _LAST, seed, threads) for T in ends), key=lambda T: smooth.residual(T, seed, threads))
    # Without noise, single points and planes know more than what is smoothed; with it, they come no nearer.
    sharp = exact.end(best, _LAST, seed, threads)
    if smooth.misfit(sharp) < _CLEARLY * smooth.misfit(best):
        best = sharp
    least, chosen = smooth.misfit(best), _standing(pair, best)
    for rival in (found, refine(pair, pair.pose(best)), _standing(pair, exact.closest(best))):
        T = pair.motion(rival.G)
        if pair.is_within(angle, T) and smooth.misfit(T) < _CLEARLY * least:
            least, chosen = smooth.misfit(T), rival
    return chosen


def _size(cloud: PreparedCloud) -> float:
    """How far the points lie from their middle, as a root mean square."""
    places = cloud.fine.spread(_PROBED)
    return float(np.linalg.norm(places - places.mean(axis=0)) / np.sqrt(len(places)))


def _smoothed(pair: Pair, most: int) -> Points:
    """Both clouds, with so many points at most, and as many neighbours as noise asks for, as far as these allow it."""
    clouds = pair.source, pair.target
    neighbours = int(np.clip(min(most, *(len(cloud.fine) for cloud in clouds)) / _SMOOTH, 1, MAX_NEIGHBOURS))
    if neighbours == 1:
        return Points(*clouds, 1)
    fields = [PointField(cloud.fine.spread(most), threads=cloud.threads) for cloud in clouds]
    return Points(PreparedCloud(fields[0]), PreparedCloud(fields[1]), neighbours)


def _standing(pair: Pair, T: Floats) -> Refined:
    """A pose as it is, and how well it agrees."""
    _, steps = descend(last := last_level(pair), pair.pose(T)[None])
    return Refined(pair.pose(T), steps, last)


@dataclass(frozen=True, eq=False)
class Points:
    """Two clouds of points, each smoothed over so many neighbours."""

    source: PreparedCloud
    target: PreparedCloud
    neighbours: int

    @lazy
    def fields(self) -> tuple[PointField, PointField]:
        """Of source and target."""
        source, target = self.source.field, self.target.field
        assert isinstance(source, PointField)
        assert isinstance(target, PointField)
        return source, target

    @lazy
    def probes(self) -> tuple[Floats, Floats]:
        """Places (m, 3) on the smoothed surface of each."""
        return self._smooth(0, self.fields[0].spread(_PROBED)), self._smooth(1, self.fields[1].spread(_PROBED))

    @lazy
    def spacing(self) -> float:
        """From a point to the next, in the denser cloud."""
        return min(float(np.median(field.spacing(field.spread(_PROBED)))) for field in self.fields)

    def misfit(self, T: Floats) -> float:
        """How far the surfaces are from each other where the source is moved by T (4, 4): the mean of the smaller half
        of the distances, a length; both ways, but from a much denser cloud to the other: that is the other's spacing.
        """
        ways = [(0, 1, T), (1, 0, inverse(T))]
        counts = [len(field) for field in self.fields]
        there = [apply(motion, self.probes[a]) for a, _, motion in ways]
        off = [_mean_of_half(self._smooth(b, x) - x) for x, (_, b, _) in zip(there, ways, strict=True)]
        return sum(away for away, (a, b, _) in zip(off, ways, strict=True) if counts[a] < _DENSER * counts[b])

    def closest(self, T: Floats) -> Floats:
        """T_target_source (4, 4) after the points of the sparser cloud are laid on the nearest ones of the other."""
        source, target = self.fields
        if len(source) <= len(target):
            return closest(target, source.spread(_MOST), T)[0]
        return inverse(closest(source, target.spread(_MOST), inverse(T))[0])

    def laid(self, turn: Floats) -> Floats:
        """A motion (4, 4) that turns as another one does and lays the centroids on each other."""
        R = turn.copy()
        R[:3, 3] = 0
        return translation(self.target.centre) @ R @ translation(-self.source.centre)

    def residual(self, T: Floats, seed: int, threads: int) -> float:
        """How much the fields differ at places all around, where the source is moved by T (4, 4): a mean of distances.
        What the paper's method minimises, but for the squares."""
        settings = self._settings(_LAST)
        pseudo, there = self.target.features(settings, seed, threads)
        here = sampled(self.source.sampled_by(settings, threads), apply(inverse(T), pseudo))
        return float(np.abs(there.value - here.value).mean())

    def end(self, T: Floats, count: int, seed: int, threads: int) -> Floats:
        """Where the paper's method ends from a T_target_source (4, 4), with so many pseudo points."""
        settings = self._settings(count)
        pseudo, features = self.target.features(settings, seed, threads)
        field, centres = self.source.sampled_by(settings, threads), (self.source.centre, self.target.centre)
        return align(field, features, pseudo, T, centres, settings).T_target_source

    def _settings(self, count: int) -> Settings:
        edge = float(np.ptp(self.fields[1].bounds, axis=0).max())
        return replace(PRESETS["object"].scaled(edge), neighbours=self.neighbours, pseudo_count=count)

    def _smooth(self, cloud: int, x: Floats) -> Floats:
        """The means (L, 3) of the points of a cloud that are nearest to places x (L, 3)."""
        field = self.fields[cloud]
        return np.asarray(field.points[field.nearest(x, self.neighbours)[1]].mean(axis=1, dtype=float))


def _mean_of_half(away: Floats) -> float:
    """The mean of the smaller half of the lengths of vectors (n, 3)."""
    lengths = np.sort(np.linalg.norm(away, axis=1))
    return float(lengths[: max(1, int(_SHARE * len(lengths)))].mean())


def _turns(angle: float) -> Iterator[Floats]:
    """Rotations as motions (4, 4), the least first: around none, or the group of the icosahedron, in which no rotation
    is farther than 45 degrees from one of its 60."""
    from scipy.spatial.transform import Rotation  # loaded where it is needed: import fieldalign stays light

    group = Rotation.create_group("I").as_rotvec()
    sizes = np.linalg.norm(group, axis=1)
    if angle < _NARROW:
        axes = group[np.isclose(sizes, np.radians(72))]  # to the twelve corners
        group = np.concatenate([np.zeros((1, 3)), _TURNED * angle * axes / np.radians(72)])
        sizes = np.linalg.norm(group, axis=1)
    for row in np.argsort(sizes, kind="stable"):
        if sizes[row] <= angle + 1e-9:
            yield exp_twist(np.r_[group[row], 0.0, 0.0, 0.0])
