"""The peers, one adapter a file, all with one interface; never imported by src/.

    align(source, target, voxel, threads, init=None) -> T_target_source (4, 4)

source, target: (N, 3) float64. voxel: the length that each peer needs to be told; the benchmark gives the one that
suits the set (a room 0.05 m, a street 0.5 m, an object 0.002 m), while fieldalign is told none. init: (4, 4), where a
peer starts; those that search from any pose ignore it. threads: OMP_NUM_THREADS must say the same, before a peer is
imported: not all of them can be told otherwise.

Each needs its own package when it is loaded, and no other's. The folder can be imported by its path under any name.

TEASER++ is not among them: no package of the index can be built without GitHub. KISS-Matcher holds its solver (GNC on
translation-invariant measurements, graph-theoretic pruning) and comes from the same group. PointNetLK-Revisited is run
from a user's checkout: load("pointnetlk-revisited", checkout=FOLDER).
"""

from __future__ import annotations

from functools import partial
from importlib import import_module

METHODS = {
    "kiss": ("kiss", "KISS-Matcher + small_gicp", {}),
    "kiss-fine": ("kiss", "KISS-Matcher + small_gicp to voxel / 4", {"fine": True}),
    "ransac": ("open3d_ransac", "Open3D FPFH + RANSAC + small_gicp", {}),
    "fgr": ("open3d_fgr", "Open3D FPFH + FGR + ICP", {}),
    "gicp": ("gicp", "small_gicp, three levels, from the guess", {}),
    "gicp-fine": ("gicp", "small_gicp, three levels to voxel / 4, from the guess", {"fine": True}),
    "gicp-plain": ("gicp", "small_gicp, one level, all points, from the guess", {"plain": True}),
    "icp": ("open3d_icp", "Open3D multi-scale ICP, from the guess", {}),
    "icp-point": ("open3d_plain_icp", "Open3D ICP, point to point, from the guess", {}),
    "icp-plane": ("open3d_plain_icp", "Open3D ICP, point to plane, from the guess", {"planes": True}),
    "cpd": ("pycpd_cpd", "pycpd CPD, from the guess", {}),
    "filterreg": ("probreg_methods", "probreg FilterReg, from the guess", {}),
    "svr": ("probreg_methods", "probreg SVR, from the guess", {"method": "svr"}),
    "pointnetlk-revisited": ("pointnetlk_revisited", "PointNetLK-Revisited, from the guess", {"checkout": None}),
}


def load(name: str, **given):
    """The align function of a method; imports its peer. given: options of this call, as checkout=FOLDER of the method
    that is in no package index."""
    module, _, options = METHODS[name]
    return partial(import_module(f"{__name__}.{module}").align, **options | given)
