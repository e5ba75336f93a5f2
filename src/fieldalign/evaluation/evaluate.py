"""The front door: a trajectory against the truth, by all the measures that are in use."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from ..errors import ArgumentError
from ..motions import Matrix
from ..odometry.trajectory import Trajectory
from .absolute import absolute_errors
from .association import associated
from .pose_error import PoseErrors
from .relative import relative_errors
from .segments import SegmentErrors, segment_errors

_ALIGNED = {"positions": "aligned by all positions", "origin": "aligned by the first pose", "none": "not aligned"}


@dataclass(frozen=True, eq=False)
class Evaluation:
    """What a trajectory is off the truth, row for row of the poses that belong together.

    trajectory, truth: these poses, both in the truth's world; T_truth_trajectory: (4, 4), what took the trajectory
        there. poses: how many the trajectory and the truth had before.
    absolute: ATE, of each pose. relative: RPE, of each pair; delta, unit, all_pairs: which pairs.
    segments: KITTI's measure.
    """

    trajectory: Trajectory
    truth: Trajectory
    T_truth_trajectory: Matrix
    poses: tuple[int, int]
    absolute: PoseErrors
    relative: PoseErrors
    segments: SegmentErrors
    alignment: str
    delta: float
    unit: str
    all_pairs: bool

    def to_dict(self) -> dict[str, Any]:
        """All of it in numbers and strings, ready for JSON."""
        return {
            "paired": len(self.truth),
            "poses": {"trajectory": self.poses[0], "truth": self.poses[1]},
            "length": float(self.truth.distances[-1]),
            "alignment": self.alignment,
            "T_truth_trajectory": self.T_truth_trajectory.tolist(),
            "kitti": self.segments.to_dict(),
            "ate": self.absolute.to_dict(),
            "rpe": {"delta": self.delta, "unit": self.unit, "all_pairs": self.all_pairs} | self.relative.to_dict(),
        }

    def __str__(self) -> str:
        s = self.segments
        drift = (
            f"{s.translation_percent:.4g} %, {s.rotation_deg_per_100m:.4g} deg / 100 m "
            f"(mean of {len(s)} segments of 100 to 800 m)" if len(s) else "no segment: the drive is below 100 m"
        )
        return (
            f"{len(self.truth)} poses paired, of {self.poses[0]} and {self.poses[1]} of the truth, over "
            f"{self.truth.distances[-1]:.6g} m\n"
            f"KITTI  {drift}\n"
            f"ATE    {_told(self.absolute)} ({_ALIGNED[self.alignment]})\n"
            f"RPE    {_told(self.relative)} (over {self.delta:g} {self.unit}{', all pairs' if self.all_pairs else ''})"
        )


def evaluate(
    trajectory: Trajectory,
    truth: Trajectory,
    *,
    max_difference: float | None = 0.01,
    alignment: str = "positions",
    delta: float = 1,
    unit: str = "frames",
    all_pairs: bool = False,
) -> Evaluation:
    """How far a trajectory is from the truth, both of the same sensor.

    max_difference: seconds between poses that belong together; None: the poses belong together row for row.
    alignment: for ATE, "positions", "origin" or "none"; see `absolute_errors`. delta, unit, all_pairs: for RPE, see
    `relative_errors`. KITTI's measure asks for nothing.

    Raises ArgumentError where no poses belong together, and for arguments out of range.
    """
    if max_difference is not None:
        paired_truth, paired = associated(truth, trajectory, max_difference)
    elif len(trajectory) == len(truth) > 0:
        paired_truth, paired = truth, trajectory
    else:
        raise ArgumentError(f"trajectory must have as many poses as the truth to be compared row for row, but has "
                            f"{len(trajectory)}, the truth {len(truth)}")
    absolute, T = absolute_errors(paired_truth.poses, paired.poses, alignment)
    return Evaluation(
        trajectory=paired.in_world(T),
        truth=paired_truth,
        T_truth_trajectory=T,
        poses=(len(trajectory), len(truth)),
        absolute=absolute,
        relative=relative_errors(paired_truth.poses, paired.poses, delta, unit, all_pairs),
        segments=segment_errors(paired_truth.poses, paired.poses),
        alignment=alignment,
        delta=delta,
        unit=unit,
        all_pairs=all_pairs,
    )


def _told(errors: PoseErrors) -> str:
    plain = errors.to_dict()
    move, turn = plain["translation"], plain["rotation_deg"]
    if move is None or turn is None:
        return "no pair is so far apart"
    rmse, largest = (f"{move[name]:.4g} m, {turn[name]:.4g} deg" for name in ("rmse", "maximum"))
    return f"rmse {rmse}; largest {largest}"
