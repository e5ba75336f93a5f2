"""The vertices of 80 meshes that the authors' program was run on, with the motions: `paper_pairs` of ../shared/data."""

from __future__ import annotations

from functools import partial
from pathlib import Path

import numpy as np

from .files import PathLike, arrays_in
from .shapes import Shape, Stored
from .twists import ProgramPair, program_pairs

UNIQUE, SYMMETRIC = "unique", "symmetric"
_WITHOUT_UNIQUE_ANSWER = frozenset((
    "l_sphere", "t_ico4", "t_ico4uv", "t_sphere", "t_unit_sphere", "t_torus", "t_capsule", "t_round", "t_ballA",
    "t_ballB", "l_halftunnel", "l_cube_40k", "l_bumpy-cube", "t_box", "t_octagonal_pocket", "t_soup",
))


def program_clouds(folder: PathLike) -> list[tuple[Shape, ProgramPair]]:
    """Each cloud with the motion that it was given; none where the folder has none. A shape's category says whether its
    pose is unique: 17 of the clouds are symmetric, or a soup. Raises DataSetError for files that are not what they
    should be."""
    clouds, pairs = (Path(folder, name) for name in ("synthetic_clouds.npz", "synthetic_pairs.json"))
    if not (clouds.is_file() and pairs.is_file()):
        return []
    return [(_shape(clouds, pair.shape), pair) for pair in program_pairs(pairs)]


def _shape(file: Path, name: str) -> Shape:
    category = SYMMETRIC if name.rpartition(".")[0] in _WITHOUT_UNIQUE_ANSWER else UNIQUE
    return Shape(category, name, partial(_stored, file, name))


def _stored(file: Path, name: str) -> Stored:
    return Stored(np.asarray(arrays_in(file, name)[0], float))
