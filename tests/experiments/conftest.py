"""A small ModelNet40 and a small folder of peers, as people have them on disk."""

import numpy as np
import pytest

PEERS = '''
from functools import partial
from importlib import import_module

METHODS = {
    "gicp": ("means", "Means", {}),
    "icp-point": ("nothing", "Lacks a package", {}),
    "fgr": ("broken", "Raises", {}),
    "needy": ("means", "Needs a checkout", {"checkout": None}),
}


def load(name, **given):
    module, _, options = METHODS[name]
    return partial(import_module(f"{__name__}.{module}").align, **options | given)
'''
MEANS = '''
import numpy as np


def align(source, target, voxel, threads, init=None, checkout=None):
    T = np.eye(4)
    T[:3, 3] = target.mean(axis=0) - source.mean(axis=0)
    return T
'''


def hill(size):
    """The vertices (n, 3) and triangles of a hilly surface without symmetries."""
    u, v = (a.ravel() for a in np.meshgrid(np.linspace(0, 1, 20), np.linspace(0, 0.8, 16), indexing="ij"))
    height = size * (np.exp(-20 * ((u - 0.3) ** 2 + (v - 0.2) ** 2)) + 0.6 * np.sin(3 * u) * v**2)
    a = (16 * np.arange(19)[:, None] + np.arange(15)).ravel()
    return np.c_[u, v, height], np.r_[np.c_[a, a + 16, a + 1], np.c_[a + 1, a + 16, a + 17]]


@pytest.fixture(scope="session")
def small(tmp_path_factory):
    """ModelNet40 with two shapes of unseen categories, one in each split, and gt_poses.csv beside."""
    folder = tmp_path_factory.mktemp("small")
    for category, split, size in (("piano", "train", 0.4), ("sofa", "test", 0.7)):
        vertices, faces = hill(size)
        rows = ["{:.6f} {:.6f} {:.6f}".format(*row) for row in vertices] + ["3 {} {} {}".format(*row) for row in faces]
        file = folder / "ModelNet40" / category / split / f"{category}_0001.off"
        file.parent.mkdir(parents=True)
        file.write_text(f"OFF\n{len(vertices)} {len(faces)} 0\n" + "\n".join(rows) + "\n")
    (folder / "gt_poses.csv").write_text("0.5,0.2,-0.3,0.1,0.4,-0.2\n-0.1,0.6,0.2,0.3,0,0.1\n")
    return folder


@pytest.fixture(scope="session")
def peers(tmp_path_factory):
    """A folder of adapters: one works, one lacks a package, one raises, one needs a checkout."""
    folder = tmp_path_factory.mktemp("peers")
    (folder / "__init__.py").write_text(PEERS)
    (folder / "means.py").write_text(MEANS)
    (folder / "nothing.py").write_text("import a_package_that_nobody_has\n")
    (folder / "broken.py").write_text("def align(*_, **__):\n    raise ValueError('no')\n")
    return folder
