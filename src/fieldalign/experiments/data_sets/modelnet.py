"""ModelNet40 (Wu et al., CVPR 2015) in the layouts that are in use.

| layout | what it holds | from |
| --- | --- | --- |
| ModelNet40 | CATEGORY/test/CATEGORY_0001.off, meshes | modelnet.cs.princeton.edu |
| modelnet40_normal_resampled | CATEGORY/CATEGORY_0001.txt, 10,000 points each, modelnet40_test.txt | PointNet++ |
| modelnet40_ply_hdf5_2048 | *.h5 of 2048 points a shape, test_files.txt, shape_names.txt; extra 'hdf5' | PointNet |
| modelnet40/CATEGORY.npz | `names`, `xyz` (n, 10000, 3): test shapes of two categories | this project's part |

PointNetLK-Revisited tests on the vertices of the meshes of both splits ("all": its test.py asks for train=-1), with the
motions of gt_poses.csv in an order of its own.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache, partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...arguments import check_one_of
from ...clouds.formats import require_unpacked
from ...errors import DataSetError, missing_extra
from ...odometry.sequences.folders import natural_order
from .files import PathLike, arrays_in, as_folder, first_of, inside, names_in, nothing_of, points_of
from .shapes import Shape, Stored, mesh_in

UNSEEN = (
    "laptop", "mantel", "monitor", "night_stand", "person", "piano", "plant", "radio", "range_hood", "sink", "sofa",
    "stairs", "stool", "table", "tent", "toilet", "tv_stand", "vase", "wardrobe", "xbox",
)
"""The 20 categories on which PointNetLK and PointNetLK-Revisited test, having been trained on the others:
dataset/modelnet40_half2.txt of github.com/Lilac-Lee/PointNetLK_Revisited."""

SPLITS = ("test", "train", "all")
LAYOUTS = (
    "ModelNet40 (CATEGORY/test/CATEGORY_0001.off)",
    "modelnet40_normal_resampled (modelnet40_test.txt, CATEGORY/CATEGORY_0001.txt)",
    "modelnet40_ply_hdf5_2048 (test_files.txt, shape_names.txt, *.h5)",
    "modelnet40/CATEGORY.npz with the arrays names and xyz",
)


def shapes(folder: PathLike, categories: Sequence[str] | None = None, split: str = "test") -> list[Shape]:
    """The shapes of ModelNet40 in a folder, by category, then by number.

    folder: of one of the layouts, or one that holds such a folder. categories: None: UNSEEN; where the folder has none
    of these, as this project's part of the set, all that it has. split: "test", "train" or "all".

    Raises DataSetError where there is nothing of it; MissingExtraError for .h5 files without the extra 'hdf5'.
    """
    check_one_of("split", split, SPLITS)
    place = as_folder(folder)
    splits = ("train", "test") if split == "all" else (split,)
    found = (
        first_of(_in_off, inside(place, "ModelNet40"), splits)
        or first_of(_in_text, inside(place, "modelnet40_normal_resampled"), splits)
        or first_of(_in_hdf5, inside(place, "modelnet40_ply_hdf5_2048"), splits)
        or first_of(_in_npz, inside(place, "modelnet40"), splits)
    )
    if not found:
        raise nothing_of("ModelNet40", place, LAYOUTS)
    return sorted(chosen(found, categories, UNSEEN, place), key=_order)


def chosen(found: list[Shape], categories: Sequence[str] | None, unseen: Sequence[str], place: Path) -> list[Shape]:
    """The shapes of these categories; of None, those of the unseen ones, or where there are none of them, all.

    Raises DataSetError where there is nothing of the categories that are asked for.
    """
    wanted = [shape for shape in found if shape.category in (unseen if categories is None else categories)]
    if categories is None:
        return wanted or found
    if not wanted:
        held = ", ".join(sorted({shape.category for shape in found}))
        raise DataSetError(f"{place} holds no shapes of the categories {', '.join(categories)}, but of {held}")
    return wanted


def _order(shape: Shape) -> tuple[object, ...]:
    return shape.category, natural_order(Path(shape.name))


def _in_off(place: Path, splits: Sequence[str]) -> list[Shape]:
    files = [file for split in splits for file in place.glob(f"*/{split}/*.off")]
    return [Shape(file.parts[-3], file.stem, partial(mesh_in, file)) for file in files]


def _in_text(place: Path, splits: Sequence[str]) -> list[Shape]:
    lists = [place / f"modelnet40_{split}.txt" for split in splits]
    names = [name for file in lists if file.is_file() for name in names_in(file)]
    categories = [name.rpartition("_")[0] for name in names]
    files = [place / category / f"{name}.txt" for category, name in zip(categories, names, strict=True)]
    return [Shape(file.parent.name, file.stem, partial(_cloud_in, file)) for file in files]


def _cloud_in(file: Path) -> Stored:
    return Stored(points_of(str(file)))


def _in_hdf5(place: Path, splits: Sequence[str]) -> list[Shape]:
    lists = [place / f"{split}_files.txt" for split in splits]
    files = [place / Path(line).name for file in lists if file.is_file() for line in names_in(file)]
    categories = names_in(place / "shape_names.txt") if files else []
    return [shape for file in files for shape in _rows_of_hdf5(file, categories)]


def _rows_of_hdf5(file: Path, categories: list[str]) -> list[Shape]:
    labels = _hdf5(file, "label", ...).ravel()
    if labels.size and not 0 <= labels.min() <= labels.max() < len(categories):
        raise DataSetError(f"{file} has labels from {labels.min()} to {labels.max()}, but shape_names.txt has "
                           f"{len(categories)} names")
    named = [(categories[int(label)], row) for row, label in enumerate(labels)]
    return [Shape(name, f"{name}_{file.stem}_{row}", partial(_row_of_hdf5, file, row)) for name, row in named]


def _row_of_hdf5(file: Path, row: int) -> Stored:
    return Stored(np.asarray(_hdf5(file, "data", row), float))


def _hdf5(file: Path, name: str, rows: Any) -> NDArray[Any]:
    try:
        import h5py
    except ImportError as error:
        raise missing_extra("hdf5", f"reading {file.name}") from error
    try:
        with h5py.File(file, "r") as arrays:
            require_unpacked(arrays[name].nbytes, file.stat().st_size, f"an array {name!r}")
            return np.asarray(arrays[name][rows])
    except (OSError, KeyError, ValueError) as error:
        raise DataSetError(f"{file} cannot be read as an .h5 of ModelNet40 with data and label: {error}") from error


def _in_npz(place: Path, splits: Sequence[str]) -> list[Shape]:
    if "test" not in splits:
        return []
    return [
        Shape(file.stem, str(name), partial(_row_of_npz, file, row))
        for file in place.glob("*.npz")
        for row, name in enumerate(arrays_in(file, "names")[0])
    ]


def _row_of_npz(file: Path, row: int) -> Stored:
    return Stored(np.asarray(_clouds_in(file)[row], float))


@lru_cache(maxsize=1)
def _clouds_in(file: Path) -> NDArray[Any]:
    """All clouds of a category: an .npz gives no single one without reading all."""
    return arrays_in(file, "xyz")[0]
