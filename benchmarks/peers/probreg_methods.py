"""probreg: FilterReg and SVR, rigid. Its CPD is left out: pycpd's converges further; and GMMTree: it never ends on the
vertices of an icosphere.

Settings are its own, but FilterReg updates its variance (update_sigma2), as in its paper, and runs on until the
likelihood changes by less than 1e-6: without, its default, an indoor pair turned by up to 45 degrees ends 18 degrees
off instead of 0.3. It has no wheels: pip builds it, in a minute or two, with a C++ compiler. It is therefore not in the
extra `bench`; `pip install probreg` (0.3.8) works beside NumPy 2 and Open3D 0.20.
"""

from __future__ import annotations

import numpy as np
from probreg import filterreg, l2dist_regs

from .thinning import as_came, at_unit_size


def align(source, target, voxel, threads, init=None, method="filterreg") -> np.ndarray:
    """From init, or with the centroids laid on each other; of 2000 points of each cloud."""
    moving, fixed, to_moving, to_fixed = at_unit_size(source, target, init)
    found = _METHODS[method](moving, fixed)
    return as_came(found.rot, found.t, to_moving, to_fixed)


def _filterreg(moving, fixed):
    return filterreg.registration_filterreg(moving, fixed, update_sigma2=True, tol=1e-6).transformation


_METHODS = {"filterreg": _filterreg, "svr": l2dist_regs.registration_svr}
