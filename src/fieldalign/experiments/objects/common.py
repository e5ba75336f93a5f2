"""What the experiments on objects share: the methods, the motions, and the shapes that they are laid onto."""

from __future__ import annotations

from functools import partial
from pathlib import Path

import numpy as np

from ...errors import DataSetError
from ...motions import Matrix, exp_twist
from ...settings import PRESETS
from ..case import Case, Moved
from ..columns import ByPaper, Column
from ..data_sets import modelnet, shapenet, twists
from ..data_sets.files import inside
from ..data_sets.shapes import Shape

PAPER = Column("paper", "the paper's method, cube [-1, 1]^3", ByPaper(PRESETS["object"]))
PAPER_NEAR = Column("paper-near", "the paper's method, cube [-0.5, 0.5]^3", ByPaper(PRESETS["object-near"]))
PEERS = (
    "icp-point", "icp-plane", "icp", "gicp-plain", "gicp", "kiss", "ransac", "fgr", "filterreg", "svr", "cpd",
)
SOME_PEERS = "icp-point", "icp-plane", "gicp", "kiss", "filterreg", "cpd"  # where there are many cases
VOXEL = 0.02  # of shapes whose longest edge is 1: what suits them
NEAR, ROUGH = (1.0, 0.01), (5.0, 0.05)  # degrees and lengths: by either, the rim of the shape is off by as much

GUESS = (
    "What is known beforehand, as in the paper: the motion turns by at most 45 degrees. fieldalign is told so (the "
    "guess is the identity, and 5 degrees are left as slack) but for the column without a guess; the paper's method "
    "and those that start from a guess start with the centroids laid on each other, as the authors' program does."
)
SIZE = "Shapes are scaled so that the longest edge of their box is 1, and lengths are in this unit."
SYMMETRY = (
    "Errors modulo symmetry are counted from the nearest pose that lays the shape on itself as the true one does, "
    "within 1 % of its size."
)

GTCSV, AS_TEXT = "twists of gt_poses.csv", "twists as the text says"
SETS = {"gtcsv": GTCSV, "paper": AS_TEXT}  # as the program's pairs call them


def copies(shapes: list[Shape], data: Path, seed: int, of: str = "") -> list[Case]:
    """The vertices of each shape and the same ones moved: by row k of gt_poses.csv for shape k, where the file is
    there, and by a motion drawn as the text says. of: what the groups' names begin with."""
    drawn = twists.drawn(np.random.default_rng(seed), len(shapes))
    sets = {AS_TEXT: drawn} if (listed := _gt_poses(data)) is None else {GTCSV: listed, AS_TEXT: drawn}
    return [
        copy(shape, row[k % len(row)], of + group) for group, row in sets.items() for k, shape in enumerate(shapes)
    ]


def copy(shape: Shape, twist: Matrix, group: str, name: str = "") -> Case:
    """The vertices of a shape and the same ones moved."""
    T = exp_twist(twist)
    return Case(f"{shape.name} {name or group}", group, Moved(shape.vertices, T), T, shape=shape.vertices)


def _gt_poses(data: Path) -> Matrix | None:
    """The twists of PointNetLK-Revisited's file, in the folder or beside it; None without one."""
    files = (where / "gt_poses.csv" for place in (data, data.parent) for where in inside(place, "pointnetlk"))
    return next((twists.from_csv(file) for file in files if file.is_file()), None)


def surfaces(data: Path) -> list[Shape]:
    """The shapes of ModelNet40 as meshes, or where there are none, those of ShapeNet: points may be drawn from them as
    dense as is wanted. Raises DataSetError where there are neither."""
    for read in (partial(modelnet.shapes, split="test"), shapenet.shapes):
        try:
            shapes = read(data)
        except DataSetError:
            continue
        if shapes[0].read().triangles is not None:
            return shapes
    raise DataSetError(f"{data} holds no meshes, of neither ModelNet40 nor ShapeNet, to draw points from")
