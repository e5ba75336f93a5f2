"""Joint refinement: the pseudo points of every scan speak to the fields of all scans that it overlaps, at once.

Each pair of overlapping scans adds the Gauss-Newton terms of its last level, at the present poses, to one system over
all poses: no pair settles alone what the others must take as it is.
"""

from __future__ import annotations

from dataclasses import dataclass

from ..alignment import descend
from ..fields.protocol import Floats
from ..methods.pair import Pair
from ..methods.refined import Refined, certainty, last_level
from ..prepared import PreparedCloud
from ..scale import common_voxel
from .pose_graph import Edge

_RESOLUTION = 1e-6  # of a voxel: residuals are not weighed as if they were known better


@dataclass(frozen=True, eq=False)
class Pull:
    """How the fields of two scans pull at their relative pose: H (6, 6) and g (6,) of a twist on the left of T_ij,
    about `reference` (3,) in the frame of scan i, in units of the residuals' variance; and what is known of it."""

    H: Floats
    g: Floats
    information: Floats
    reference: Floats
    kept: int

    def as_edge(self, i: int, j: int, T_ij: Floats, strength: float) -> Edge:
        """What is known, as an edge between the poses of scans i and j."""
        return Edge(i, j, T_ij, self.information, self.reference, strength)


def pull(scan_i: PreparedCloud, scan_j: PreparedCloud, T_ij: Floats) -> Pull:
    """The terms of scan j's pose T_ij (4, 4) in the frame of scan i, linearised there."""
    pair = Pair(scan_j, scan_i, common_voxel(scan_j.scale, scan_i.scale))
    G = pair.pose(T_ij)
    _, steps = descend(stage := last_level(pair), G[None])
    known, seen = certainty(pair, Refined(G, steps, stage))
    variance = stage.rmse**2 + (_RESOLUTION * pair.voxel) ** 2
    # A pose of the held target moves with the twist, that of a held source against it.
    sign = 1.0 if pair.is_swapped else -1.0
    return Pull(
        H=seen.T @ stage.curvature[:6, :6] @ seen / variance,
        g=sign * seen.T @ stage.gradient[:6] / variance,
        information=known.information,
        reference=known.reference_point,
        kept=int(stage.totals[3]),
    )
