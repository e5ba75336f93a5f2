"""What the viewer of a report draws: both clouds thinned and packed, the motion between them, where to look from."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..fields import PointField
from ..fields.protocol import Floats
from ..methods.pair import Pair
from ..methods.refined import last_level
from ..motions import apply, growth, inverse, log_motion, size_of, translation
from ..prepared import PreparedCloud
from ..result import RegistrationResult
from ..scale import common_voxel
from ..scaled import ScaledCloud
from . import packing, views
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
    T_target_source: Floats, source: PreparedCloud, target: PreparedCloud, most: int = MOST_POINTS,
    result: RegistrationResult | None = None,
) -> Scene:
    """The scene of a pose, of each cloud so many points; what the registration made of the clouds is used again.
    result: the one whose pseudo points are shown, too."""
    T = in_space(T_target_source)
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
    pseudo, of = (None, "target") if result is None else _pseudo_points(result, Pair(as_large, target, voxel), size)
    return Scene(source, target, places, near, T, limit, voxel, pseudo, of)


def viewer_data(scene: Scene, others: Mapping[str, Floats] | None = None, name: str = "the result") -> dict[str, Any]:
    """The scene in numbers and base64, about the middle of the target; name: of its pose; others: poses (4, 4) or
    (3, 3) that may be looked at, too, by name."""
    middles = np.median(scene.places[0], axis=0), np.median(scene.places[1], axis=0)
    origin = middles[1]
    up = views.upright(scene.places[1])
    ahead = views.ahead(np.zeros(3) if scene.target.eye is None else scene.target.eye, scene.places[1], up)
    heights = np.concatenate([apply(scene.T, scene.places[0]) @ up, scene.places[1] @ up]) - origin @ up
    poses = {name: scene.T} | {name: in_space(T) for name, T in (others or {}).items()}
    pseudo = None if scene.pseudo is None else {"of": scene.pseudo_of, **packing.quantised(scene.pseudo, origin)}
    return packing.outlook(up, ahead, heights) | {
        "clouds": {
            name: _packed(places, near, scene.limit, origin)
            for name, places, near in zip(("source", "target"), scene.places, scene.near, strict=True)
        },
        "motions": [{"name": name} | _motion(T, middles[0], origin) for name, T in poses.items()],
        "pivot": (middles[0] - origin).tolist(),
        "pseudo": pseudo,
        "signed": scene.near[0].signed,
        "words": _words(scene),
    }


def _packed(places: Floats, near: Closeness, limit: float, origin: Floats) -> packing.Packed:
    """A cloud, and how near it comes to the other."""
    return packing.cloud(places, near.normal, origin) | {
        "states": packing.as_base64(near.state),
        "distances": packing.as_base64(np.rint(127 * np.clip(near.distance / limit, -1, 1)).astype(np.int8)),
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
    return np.ascontiguousarray(points[packing.some(len(points), most)], float)


def _pseudo_points(result: RegistrationResult, pair: Pair, size: float) -> tuple[Floats | None, str]:
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
