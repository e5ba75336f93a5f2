"""Reading whatever a file holds as a field: the triangles of a mesh, a volume, or points."""

from __future__ import annotations

import zipfile
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..clouds.checks import checked_points
from ..clouds.cloud import PointCloud
from ..clouds.files import FORMATS, PathLike, check_existing, errors_naming, logger, read_cloud, split_part
from ..clouds.formats import triangles
from ..clouds.formats.off import read_off
from ..clouds.formats.ply_faces import read_ply_faces
from ..errors import CloudFileError
from ..threads import resolve_threads
from ..whole_file import replacing
from .mesh import MeshField
from .points import PointField
from .protocol import DistanceField, Floats
from .volume_files import read_volume

MESHES = {
    ".ply": read_ply_faces,
    ".stl": triangles.read_stl,
    ".obj": triangles.read_obj_faces,
    ".off": read_off,
}
VOLUMES = (".nrrd", ".nhdr", ".vdb")

_ROUNDED = 1e-5  # of the extent: of more, one is told


def read_field(path: PathLike) -> DistanceField:
    """The distance field of what a file holds.

    .ply, .obj, .off with faces, and .stl: a MeshField, exact against the triangles; a face of more corners is split as
    a fan. .nrrd, .nhdr and .npz with an array `values`: a VolumeField; .vdb is refused with a way out. Everything else
    that read_cloud() reads: a PointField; NaN rows are missing returns and left out.

    Raises CloudFileError where the file is missing, truncated, foreign, promises what it does not hold, or where its
    triangles, values or points are none; MissingExtraError where an extra is absent ("mesh" for triangles).
    """
    shape = read_shape(path)
    if not isinstance(shape, PointCloud):
        return shape
    with errors_naming(split_part(path)[0], "read"):
        threads = resolve_threads(None)
        return PointField(checked_points(shape.points, "points", threads, drop_nan=True), threads=threads)


def read_shape(path: PathLike) -> PointCloud | DistanceField:
    """As read_field(), but points as the cloud that they are in the file, with all that it knows of them."""
    file, part = split_part(path)
    with errors_naming(file, "read"):
        check_existing(file, (*FORMATS, *[s for s in (*MESHES, *VOLUMES) if s not in FORMATS]))
        is_volume = part is None and _is_volume(file)
        if file.suffix.lower() in MESHES:
            cloud, faces = MESHES[file.suffix.lower()](file)
            return MeshField(cloud.points, faces) if len(faces) else cloud
    return read_volume(file) if is_volume else read_cloud(path)


def _is_volume(file: Path) -> bool:
    if file.suffix.lower() != ".npz":
        return file.suffix.lower() in VOLUMES
    with zipfile.ZipFile(file) as archive:
        return "values.npy" in archive.namelist()


def write_mesh(path: PathLike, vertices: Floats, faces: NDArray[np.int64]) -> None:
    """Writes triangles (F, 3) on vertices (V, 3) to .ply, .obj, .off or .stl, which rounds to float32; whole or not at
    all. Raises CloudFileError where the suffix is another, or the file cannot be written."""
    file = Path(path)
    check_mesh_path(file)
    with errors_naming(file, "written"), replacing(file) as temporary:
        triangles.write(temporary, vertices, faces)
    if file.suffix.lower() == ".stl":
        lost = float(np.abs(vertices.astype(np.float32) - vertices).max())
        if lost > _ROUNDED * np.ptp(vertices, axis=0).max():
            logger.warning("%s: .stl files hold float32, which rounds these coordinates by up to %.2g", file, lost)


def check_mesh_path(path: PathLike) -> None:
    """Raises CloudFileError where no mesh can be written to a path."""
    if not is_mesh_path(path):
        raise CloudFileError(f"{path} cannot be written: the suffix of a mesh must be one of {', '.join(MESHES)}")
    if not Path(path).absolute().parent.is_dir():
        raise CloudFileError(f"{path} cannot be written: there is no folder {Path(path).parent}")


def is_mesh_path(path: PathLike) -> bool:
    """Whether a path has the suffix of a mesh."""
    return Path(path).suffix.lower() in MESHES
