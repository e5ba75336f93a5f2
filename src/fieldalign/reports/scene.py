"""What the viewer of a report draws: both clouds thinned and packed, the motion between them, where to look from."""

from __future__ import annotations

import base64
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..assembly.pair_result import PairResult
from ..fields import PointField
from ..fields.protocol import Floats
from ..methods.pair import Pair
from ..methods.refined import last_level
from ..motions import apply, growth, inverse, log_motion, size_of, translation
from ..prepared import PreparedCloud
from ..result import RegistrationResult
from ..scale import common_voxel
from ..scaled import ScaledCloud
from . import views
from .closeness import Closeness, closeness
from .pose_forms import in_space

MOST_POINTS = 100_000  # of each cloud: 1.5 MB in a page
_PSEUDO = 5000
_FULL = 98.0           # per cent of the points that meet have a fainter colour than the fullest


@dataclass(frozen=True, eq=False)
class Scene:
    """Places (n, 3) of both clouds, each in its own frame, and how near each comes to the other after the motion.

    T: (4, 4), T_target_source, a rigid motion or a similarity. limit: the distance at which colours are full. voxel:
    how near is near. pseudo: pseudo points (L, 3), in the frame of the source or of the target: pseudo_of.
    """

    source: PreparedCloud
    target: PreparedCloud
    places: tuple[Floats, Floats]
    near: tuple[Closeness, Closeness]
    T: Floats
    limit: float
    voxel: float
    pseudo: Floats | None
    pseudo_of: str


def scene_of(
    result: RegistrationResult | PairResult, source: PreparedCloud, target: PreparedCloud, most: int = MOST_POINTS,
    with_pseudo: bool = True,
) -> Scene:
    """The scene of a result, of each cloud so many points; what the registration made of the clouds is used again."""
    T = in_space(result.T_target_source)
    size = size_of(T)
    as_large = source if np.isclose(size, 1, rtol=1e-12, atol=0) else ScaledCloud(source, size)
    rigid = T @ growth(1 / size)
    voxel = common_voxel(as_large.scale, target.scale)
    places = _drawn(source, most), _drawn(target, most)
    near = (
        closeness(size * places[0], as_large, target, rigid, voxel),
        closeness(places[1], target, as_large, inverse(rigid), voxel),
    )
    met = np.abs(np.concatenate([one.distance[one.meets] for one in near]))
    limit = max(float(np.percentile(met, _FULL)), 1e-12 * target.extent) if len(met) else voxel
    pseudo, of = _pseudo_points(result, Pair(as_large, target, voxel), size) if with_pseudo else (None, "target")
    return Scene(source, target, places, near, T, limit, voxel, pseudo, of)


def viewer_data(scene: Scene, others: tuple[RegistrationResult, ...] = ()) -> dict[str, Any]:
    """The scene in numbers and base64, about the middle of the target; others: poses that may be looked at, too."""
    middles = np.median(scene.places[0], axis=0), np.median(scene.places[1], axis=0)
    origin = middles[1]
    up = views.level(scene.places[1], np.array([0.0, 0.0, 1.0]))
    ahead = views.ahead(np.zeros(3) if scene.target.eye is None else scene.target.eye, scene.places[1], up)
    heights = np.concatenate([apply(scene.T, scene.places[0]) @ up, scene.places[1] @ up]) - origin @ up
    ceiling = views.ceiling(heights)
    clouds = {
        name: _packed(places, near, scene.limit, middle, origin)
        for name, places, near, middle in zip(("source", "target"), scene.places, scene.near, middles, strict=True)
    }
    poses = [scene.T, *(in_space(other.T_target_source) for other in others)]
    packed = None if scene.pseudo is None else {"of": scene.pseudo_of, **_quantised(scene.pseudo, origin)}
    return {
        "clouds": clouds,
        "motions": [_motion(T, middles[0], origin) for T in poses],
        "pivot": (middles[0] - origin).tolist(),
        "pseudo": packed,
        "up": up.tolist(),
        "oblique": views.obliquely(up, ahead)[2].tolist(),
        "side": (-ahead).tolist(),
        "ceiling": ceiling if np.isfinite(ceiling) else None,
        "signed": scene.near[0].signed,
        "words": _words(scene),
    }


def _words(scene: Scene) -> dict[str, str]:
    """What the page says of the scene."""
    source, target = (f"{len(places):,}" for places in scene.places)
    near = scene.near[0]
    return {
        "source": source, "target": target, "voxel": f"{scene.voxel:.2g}", "limit": f"{scene.limit:.2g}",
        "low": f"−{scene.limit:.2g}" if near.signed else "0", "side": near.side,
        "story": f"Two point clouds in 3D: {source} points of the source and {target} of the target, the source where "
        "it came from and where the result takes it. The verdict, the tables and the charts say the same in words.",
    }


def _drawn(cloud: PreparedCloud, most: int) -> Floats:
    """Some points of a cloud, the same ones each time, or places on a surface."""
    points = cloud.field.points if isinstance(cloud.field, PointField) else cloud.fine.points
    if len(points) > most:
        points = points[np.sort(np.random.default_rng(0).choice(len(points), most, replace=False))]
    return np.ascontiguousarray(points, float)


def _pseudo_points(result: RegistrationResult | PairResult, pair: Pair, size: float) -> tuple[Floats | None, str]:
    """The third set, in the frame of the cloud that it was drawn on, and which one that is."""
    if result.evidence is None:  # the paper's method
        return pair.target.last_pseudo_points, "target"
    places = last_level(pair).planes.mean + pair.moving.surface(pair.voxel).origin
    places = places[:: max(1, len(places) // _PSEUDO)]
    return (places / size, "source") if pair.is_swapped else (places, "target")


def _motion(T: Floats, pivot: Floats, origin: Floats) -> dict[str, Any]:
    """A similarity as a growth about the pivot, then a screw motion by a twist (w, v); places count from the origin."""
    size = size_of(T)
    rigid = T @ translation(pivot) @ growth(1 / size) @ translation(-pivot)
    return {"twist": log_motion(translation(-origin) @ rigid @ translation(origin)).tolist(), "growth": size}


def _packed(places: Floats, near: Closeness, limit: float, middle: Floats, origin: Floats) -> dict[str, Any]:
    """A cloud: coordinates in 16 bits, normals and distances in 8, and about how far its points lie apart."""
    reach = float(np.mean((places - middle) ** 2))
    return _quantised(places, origin) | {
        "normals": _base64(np.rint(127 * near.normal).astype(np.int8)),
        "states": _base64(near.state),
        "distances": _base64(np.rint(127 * np.clip(near.distance / limit, -1, 1)).astype(np.int8)),
        "spacing": float(np.sqrt(12 * reach / len(places))),
    }


def _quantised(places: Floats, origin: Floats) -> dict[str, Any]:
    """Places (n, 3) as 16-bit steps from the middle of their bounds; a step is the same length along all axes."""
    low, high = places.min(axis=0), places.max(axis=0)
    middle, half = (low + high) / 2, max(float((high - low).max()) / 2, 1e-300)
    steps = np.rint((places - middle) / half * 32767).astype("<i2")
    return {"points": _base64(steps), "centre": (middle - origin).tolist(), "half": half}


def _base64(array: NDArray[Any]) -> str:
    return base64.b64encode(np.ascontiguousarray(array).tobytes()).decode("ascii")
