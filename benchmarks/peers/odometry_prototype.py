"""The odometry prototype of ../shared/prototype/odometry, the figure to beat; built for the run in a temporary folder.

It is told its voxel, 1 m, and the settings of its run.py. It is no part of this repository: where its source or a
compiler is absent, there is no such column.
"""

from __future__ import annotations

import ctypes
import os
import subprocess
import tempfile
from functools import cache
from pathlib import Path

import numpy as np

_HERE = Path(__file__).resolve().parents[2]
SOURCE = Path(os.environ.get("FIELDALIGN_PROTOTYPE", _HERE.parent / "shared/prototype")) / "odometry/odo.cpp"
FLAGS = "-O3", "-march=x86-64-v3", "-ffast-math", "-shared", "-fPIC"
# As its parameters are laid out; bench.py's defaults with run.py's settings.
SETTINGS = {
    "vox": 1.0, "thin": 0.4, "npts": 1500, "iters": 15, "nmax": 100, "nmin": 5, "maxr": 100, "minr": 0, "mode": 0,
    "neigh": 3, "select": 0, "kscale": 0.33, "sig0": 2.0, "nois": 0.05, "planar": 0.2, "mapthin": 0, "stride": 1,
    "eps": 0.003, "cosmin": 0, "reloc": 5, "lam": 0.3, "kmin": 0.05, "gapmin": 0.3, "two": 3, "dsel": 1, "boot": 0,
    "deskew": 0, "ncap": 30000, "coarse": 0.3, "cm": 3, "cmode": 1, "citers": 30,
}  # fmt: skip


@cache
def _library() -> ctypes.CDLL:
    folder = tempfile.mkdtemp(prefix="prototype-")
    built = Path(folder, "libodo.so")
    subprocess.run(["g++", *FLAGS, "-o", str(built), str(SOURCE)], check=True, capture_output=True)
    library = ctypes.CDLL(str(built))
    pointer = ctypes.c_void_p
    library.odo_new.restype, library.odo_new.argtypes = pointer, [pointer]
    library.odo_free.argtypes = [pointer]
    library.odo_frame.argtypes = [pointer, pointer, pointer, ctypes.c_size_t, pointer, pointer]
    return library


def is_there() -> bool:
    """Whether it can be built here."""
    try:
        return SOURCE.exists() and _library() is not None
    except (OSError, subprocess.CalledProcessError):
        return False


class Odometry:
    """Steps like fieldalign's."""

    def __init__(self) -> None:
        self._settings = np.array(list(SETTINGS.values()), float)
        self._handle = _library().odo_new(self._settings.ctypes.data)

    def step(self, points: np.ndarray) -> np.ndarray:
        """The pose (4, 4) of the sensor; points (N, 3), float32."""
        pose, told = np.empty((4, 4)), np.zeros(12)
        _library().odo_frame(self._handle, points.ctypes.data, None, len(points), pose.ctypes.data, told.ctypes.data)
        return pose

    def __del__(self) -> None:
        if hasattr(self, "_handle"):
            _library().odo_free(self._handle)
