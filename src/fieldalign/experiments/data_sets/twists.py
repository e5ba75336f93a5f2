"""The motions that the paper's experiments lay onto aligned clouds, as twists (w, v): radians, the cloud's unit.

Where the paper's text leaves open how a motion is drawn, the files of its authors' program tell (`paper_pairs`): angle
and length of v uniform, each about or along a uniform direction.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from ...arguments import as_count
from ...errors import DataSetError
from ...motions import Matrix, as_rigid, log_motion
from .files import PathLike, array_in, number_blocks


def from_csv(path: PathLike) -> Matrix:
    """The twists (n, 6) of PointNetLK-Revisited's gt_poses.csv; each turns by 40 degrees exactly."""
    return number_blocks(Path(path), 6, "twists (w, v)")


def drawn(rng: np.random.Generator, count: int, degrees: float = 45.0, length: float = 0.8) -> Matrix:
    """Twists (count, 6) as the paper's text says: rotations in [0, 45] degrees, translations in [0, 0.8].

    Assumed, since the text is silent: angle and length are uniform in these ranges, axis and direction uniform on the
    sphere, and the length is that of v, as in the twists that the authors' program was run on.
    """
    as_count(count, "count", 1)
    axes, ways = (direction / np.linalg.norm(direction, axis=1, keepdims=True) for direction in
                  rng.normal(size=(2, count, 3)))
    angle, far = rng.uniform(size=(2, count, 1))
    return np.hstack([np.radians(degrees) * angle * axes, length * far * ways])


def drawn_for_kitti(rng: np.random.Generator, count: int, degrees: float = 1.0, length: float = 1.0) -> Matrix:
    """Twists (count, 6) of motions whose angles about x, y and z (in this order, about axes that stay) and whose shifts
    along them are uniform in [-1, 1] degree and [-1, 1] m.

    So DeepCLR's program draws them (github.com/mhorn11/deepclr, scripts/converter/kitti_pairs_test.py), whose protocol
    the paper follows without telling it.
    """
    T = np.tile(np.eye(4), (as_count(count, "count", 1), 1, 1))
    angles, T[:, :3, 3] = rng.uniform(-degrees, degrees, (count, 3)), rng.uniform(-length, length, (count, 3))
    T[:, :3, :3] = Rotation.from_euler("xyz", angles, degrees=True).as_matrix()
    return np.array([log_motion(motion) for motion in T])


@dataclass(frozen=True, eq=False)
class ProgramPair:
    """A shape and the twist (6,) that the authors' program was run on; set: "gtcsv" or "paper", as it was drawn."""

    shape: str
    set: str
    twist: Matrix


def program_pairs(path: PathLike) -> list[ProgramPair]:
    """The pairs of `paper_pairs/synthetic_pairs.json` or `modelnet10k_pairs.json`, where half of the shapes are not in
    this project's part. Raises DataSetError where the file is none of these."""
    try:
        entries = json.loads(Path(path).read_text(encoding="utf-8"))
        rows = [(e["name"], e["set"], e["twist"]) if isinstance(e, dict) else e for e in entries]
        pairs = [ProgramPair(str(name), str(kind), np.array(twist, float)) for name, kind, twist in rows]
    except (OSError, ValueError, TypeError, KeyError) as error:
        raise DataSetError(f"{path} is no list of shapes, sets and twists: {error}") from error
    if not pairs or any(pair.twist.shape != (6,) or not np.isfinite(pair.twist).all() for pair in pairs):
        raise DataSetError(f"{path} must hold twists of six finite numbers, but holds others or none")
    return pairs


def demo_motions(path: PathLike) -> Matrix:
    """The motions P (n, 4, 4) of `paper_pairs/demo_perturb100.npy`: the source is P p1, the answer the inverse of P."""
    motions = array_in(Path(path))
    if motions.ndim != 3 or not len(motions):
        raise DataSetError(f"{path} must hold motions (n, 4, 4), but holds an array of shape {motions.shape}")
    return np.array([as_rigid(motion, f"motion {row} of {path}") for row, motion in enumerate(motions)])
