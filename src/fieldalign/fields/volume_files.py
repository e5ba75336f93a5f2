"""Reading volumes from files."""

from __future__ import annotations

import bz2
import gzip
from collections.abc import Callable
from io import BytesIO
from itertools import islice
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from ..clouds.files import PathLike, check_existing, errors_naming
from ..clouds.formats import require_unpacked
from ..clouds.formats.numpy import checked_members
from ..errors import CloudFileError, missing_extra
from .protocol import Floats
from .volume import VolumeField

_KEYS = ("values", "origin", "spacing", "truncation", "seen", "signed")
_PACKED = ("gzip", "gz", "bzip2", "bz2")
_PIECE = 2**20  # bytes
_CROOKED = 1e-6  # of a step: what the rounding of a file leaves


def read_volume(path: PathLike) -> VolumeField:
    """The field of the volume in a file; its format is told by the suffix.

    .npz: the array `values`, and where they are there `origin`, `spacing`, `truncation`, `seen` and `signed`, as
        VolumeField takes them; never unpickled.
    .nrrd, .nhdr: three axes along those of the file's own space, in any order and either way, by its space directions
        and origin, or by spacings from 0; through pynrrd (extra "volume"). A data file must lie beside its header.

    Raises CloudFileError where the file is missing, foreign, promises what it does not hold, or holds no volume that
    VolumeField takes; MissingExtraError where pynrrd is absent.
    """
    file = Path(path)
    with errors_naming(file, "read"):
        check_existing(file, _READERS)
        return VolumeField(**_READERS[file.suffix.lower()](file))


def _read_npz(file: Path) -> dict[str, Any]:
    keys = checked_members(file).keys()
    if "values" not in keys or not keys <= set(_KEYS):
        raise CloudFileError(
            f"must hold the array 'values', and may hold {', '.join(_KEYS[1:])}, but holds {', '.join(keys) or 'none'}"
        )
    with np.load(file, allow_pickle=False) as arrays:
        given = {key: arrays[key] for key in keys}
    return given | {key: given[key].item() for key in ("truncation", "signed") if key in given}


def _read_nrrd(file: Path) -> dict[str, Any]:
    try:
        import nrrd
    except ImportError as error:
        raise missing_extra("volume", "reading .nrrd and .nhdr") from error
    with file.open("rb") as opened:
        header = nrrd.read_header(opened)
        name = header.pop("data file", header.pop("datafile", None))
        with opened if name is None else _beside(file, name).open("rb") as data:
            # It makes room for what is there, not for what the header promises.
            values = nrrd.read_data(header, _plain(data, header), str(file))
    if values.ndim != 3:
        raise CloudFileError(f"must hold a volume of three axes, but has numbers of shape {values.shape}")
    if "space directions" not in header and "spacings" not in header:
        raise CloudFileError("must have 'space directions' or 'spacings', but has neither")
    steps = header["space directions"] if "space directions" in header else np.diag(header["spacings"])
    return _along_space(values, header.get("space origin", np.zeros(3)), np.asarray(steps, float))


def _beside(file: Path, name: str) -> Path:
    """The data file that a header names: one in its folder, since a header has no business elsewhere."""
    if Path(name).name != name or not (file.parent / name).is_file():
        raise CloudFileError(f"must have its data in a file of its own folder, but names {name!r}")
    return file.parent / name


def _plain(data: BinaryIO, header: dict[str, Any]) -> BinaryIO:
    """Where the data begin, without compression: pynrrd would skip and unpack without end."""
    for _ in islice(data, header.pop("line skip", header.pop("lineskip", 0))):
        pass
    if header.get("encoding") not in _PACKED:
        return data
    packed, content = Path(data.name).stat().st_size, bytearray()
    with bz2.BZ2File(data) if header["encoding"].startswith("b") else gzip.GzipFile(fileobj=data) as unpacking:
        while piece := unpacking.read(_PIECE):
            content += piece
            require_unpacked(len(content), packed, "a volume")
    header["encoding"] = "raw"
    return BytesIO(content)


def _along_space(values: NDArray[Any], origin: Floats, steps: Floats) -> dict[str, Any]:
    """The arguments of a VolumeField along the axes of space, from values along them in any order and either way.

    origin: (3,), of the first value. steps: (3, 3), a row for each axis of the values.
    """
    axes = np.abs(steps).argmax(axis=0)
    along = steps[axes].diagonal()
    if steps.shape != (3, 3) or not np.abs(steps[axes] - np.diag(along)).max() <= _CROOKED * np.abs(along).min():
        raise CloudFileError(
            f"must have axes along those of space, but its space directions are {steps.tolist()}: resample it, or "
            "register in its own axes and move the answer"
        )
    turned = np.transpose(values, axes)
    first = origin + np.minimum(along, 0) * (np.array(turned.shape) - 1)
    i, j, k = (slice(None, None, -1 if step < 0 else 1) for step in along)
    return {"values": turned[i, j, k], "origin": first, "spacing": np.abs(along)}


def _refuse_vdb(file: Path) -> dict[str, Any]:
    raise CloudFileError(
        "is an OpenVDB file, which is not read here, since no kept Python package reads it: copy its grid into an "
        "array by OpenVDB's own module, and save that by numpy.savez as values, origin, spacing and truncation"
    )


_READERS: dict[str, Callable[[Path], dict[str, Any]]] = {
    ".npz": _read_npz,
    ".nrrd": _read_nrrd,
    ".nhdr": _read_nrrd,
    ".vdb": _refuse_vdb,
}
