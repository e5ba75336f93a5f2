"""What an assembly answers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from ..clouds.cloud import PointCloud
from ..fields.protocol import Floats
from .pair_result import PairResult


@dataclass(frozen=True, eq=False)
class Assembly:
    """Scans in one frame, as many as belong together.

    poses: world_from_cloud (4, 4) of each, or None where it was left out.
    covariances: (6, 6) of each, twist order (w, v), on the right of the pose (in the scan's own frame), relative to the
        first scan of its component, or to the given poses; None where it was left out.
    components: lists of indices, largest first; each has a world frame of its own: that of the given poses, or that of
        its first scan.
    edges: (i, j, result), the pairs that were accepted and believed; the result's T maps cloud j into the frame of
        cloud i.
    doubted: (i, j, result), accepted pairs that the others contradict.
    left_out: by index, why a scan is in no component.
    tried: how many pairs were registered. seconds: time by stage.
    models: one fused, thinned cloud per component, with normals; attribute "scan": the index that each point came from.
    """

    poses: list[Floats | None]
    covariances: list[Floats | None]
    components: list[list[int]]
    edges: list[tuple[int, int, PairResult]]
    doubted: list[tuple[int, int, PairResult]]
    left_out: Mapping[int, str]
    tried: int
    seconds: Mapping[str, float]
    models: Sequence[PointCloud]

    def to_dict(self) -> dict[str, Any]:
        """The assembly without its models, in lists, numbers and strings, ready for JSON."""
        return {
            "poses": [None if pose is None else pose.tolist() for pose in self.poses],
            "covariances": [None if C is None else C.tolist() for C in self.covariances],
            "components": self.components,
            "edges": [{"i": i, "j": j} | result.to_dict() for i, j, result in self.edges],
            "doubted": [{"i": i, "j": j} | result.to_dict() for i, j, result in self.doubted],
            "left_out": {str(k): reason for k, reason in self.left_out.items()},
            "tried": self.tried,
            "seconds": dict(self.seconds),
        }

    def __repr__(self) -> str:
        placed = sum(map(len, self.components))
        return (
            f"Assembly({placed} of {len(self.poses)} scans in {len(self.components)} components, {len(self.edges)} "
            f"edges of {self.tried} pairs)"
        )
