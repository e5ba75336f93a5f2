"""KITTI's measure of odometry: the drift over segments of 100 to 800 m (Geiger, Lenz & Urtasun, CVPR 2012)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..motions import Matrix, inverse
from .pose_error import rotation_errors, translation_errors

LENGTHS = (100.0, 200.0, 300.0, 400.0, 500.0, 600.0, 700.0, 800.0)
STEP = 10


@dataclass(frozen=True, eq=False)
class SegmentErrors:
    """The drift over m segments, each divided by its nominal length.

    first, last: (m,), the rows of the poses that a segment goes between. lengths: (m,), nominal, metres.
    translation: (m,), RTE per length. rotation: (m,), RRE per length, degrees / metre.

    The averages are the benchmark's: the mean over all segments of all lengths alike, so that short segments, of which
    there are more, count more than long ones. NaN where the drive is shorter than the shortest segment.
    """

    first: NDArray[np.int64]
    last: NDArray[np.int64]
    lengths: Matrix
    translation: Matrix
    rotation: Matrix

    def __len__(self) -> int:
        return len(self.lengths)

    @property
    def translation_percent(self) -> float:
        """t_err: the mean over all segments, percent."""
        return 100 * _mean(self.translation)

    @property
    def rotation_deg_per_m(self) -> float:
        """r_err: the mean over all segments, degrees / metre."""
        return _mean(self.rotation)

    @property
    def rotation_deg_per_100m(self) -> float:
        """The same in degrees / 100 metres, as papers have it."""
        return 100 * self.rotation_deg_per_m

    def of_length(self, length: float) -> SegmentErrors:
        """Those of one nominal length."""
        rows = self.lengths == length
        return SegmentErrors(self.first[rows], self.last[rows], self.lengths[rows], self.translation[rows],
                             self.rotation[rows])

    def to_dict(self) -> dict[str, Any]:
        """The averages, over all and by length; None where there is no segment."""
        by_length = {f"{length:g}": self.of_length(length)._averages() for length in np.unique(self.lengths).tolist()}
        return self._averages() | {"by_length_m": by_length}

    def _averages(self) -> dict[str, Any]:
        means = ("translation_percent", "rotation_deg_per_m", "rotation_deg_per_100m")
        return {"segments": len(self)} | {name: getattr(self, name) if len(self) else None for name in means}


def segment_errors(
    truth: Matrix, poses: Matrix, lengths: tuple[float, ...] = LENGTHS, step: int = STEP
) -> SegmentErrors:
    """The drift of poses (n, 4, 4) as KITTI's development kit measures it, against the truth (n, 4, 4), row for row.

    A segment begins at every step-th pose and ends at the first whose path from there, along the truth, is longer than
    its length; its error is that of the motion between the two.
    """
    gone = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(truth[:, :3, 3], axis=0), axis=1))])
    begins = np.arange(0, len(truth), step)
    first, nominal = (values.ravel() for values in np.meshgrid(begins, np.asarray(lengths, float), indexing="ij"))
    last = np.searchsorted(gone, gone[first] + nominal, side="right")
    first, last, nominal = (values[last < len(truth)] for values in (first, last, nominal))
    T, T_true = inverse(poses[first]) @ poses[last], inverse(truth[first]) @ truth[last]
    return SegmentErrors(first, last, nominal, translation_errors(T, T_true) / nominal,
                         rotation_errors(T, T_true) / nominal)


def _mean(values: Matrix) -> float:
    return float(values.mean()) if len(values) else float("nan")
