"""What the commands move, write and draw: clouds, meshes and volumes alike; and what can be written at all."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

import fieldalign as fa

from .. import whole_file
from ..errors import ArgumentError

if TYPE_CHECKING:
    from ..fields import DistanceField
    from ..motions import Matrix

    Shape: TypeAlias = fa.PointCloud | DistanceField

_DRAWN = 30_000  # places that stand for a surface in a picture


def check_output(path: str | None, source: Shape | None = None) -> None:
    """Raises where a source cannot be written to a path; without a source, where none could be."""
    if path is None:
        return
    from ..clouds.files import writer_of
    from ..fields import MeshField
    from ..fields.files import check_mesh_path, is_mesh_path

    if isinstance(source, MeshField) or (source is None and is_mesh_path(path)):
        check_mesh_path(path)
    elif source is None or isinstance(source, fa.PointCloud):
        writer_of(path)
    else:
        raise ArgumentError(f"{path} cannot be written: the source must be points or triangles, but is a volume")


def check_folder(*paths: str | None) -> None:
    """Raises before any work where a file cannot be written after it."""
    for path in paths:
        if path is not None and path != "-" and not Path(path).absolute().parent.is_dir():
            raise ArgumentError(f"{path} cannot be written: there is no folder {Path(path).parent}")


def made_folder(path: str) -> Path:
    """The folder of --output, made where it is not there."""
    folder = Path(path)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ArgumentError(f"--output {path} cannot be made: {error.strerror or error}") from error
    return folder


def write_text(path: str | None, text: str) -> None:
    """Writes a file, whole or not at all; nothing for None and for "-", which is stdout."""
    if path is not None and path != "-":
        whole_file.write_text(text, path)


def check_picture(path: str | None) -> None:
    """Raises where a picture cannot be written to a path."""
    if path is not None:
        from ..reports.figure_file import checked_path

        checked_path(path)


def is_page_path(path: str) -> bool:
    """Whether a path asks for a page, not for a picture."""
    return Path(path).suffix.lower() in (".html", ".htm")


def check_report(path: str | None) -> None:
    """Raises where a page cannot be written to a path."""
    if path is not None:
        from ..reports.page import checked_page_path

        checked_page_path(path)


def write_moved(path: str, source: Shape, T: Matrix) -> None:
    """Writes a cloud, or the triangles of a mesh, moved by T (4, 4)."""
    from ..fields import MeshField
    from ..fields.files import write_mesh
    from ..motions import apply

    if isinstance(source, MeshField):
        write_mesh(path, apply(T, source.vertices), source.faces)
    elif isinstance(source, fa.PointCloud):
        fa.write_cloud(path, source.transformed(T))


def drawn(shape: Shape) -> fa.PointCloud:
    """A cloud as it is, or places on a surface."""
    from ..fields import spread_over

    return shape if isinstance(shape, fa.PointCloud) else fa.PointCloud(spread_over(shape, _DRAWN))
