"""PointNetLK-Revisited (Li, Pontes & Lucey, CVPR 2021), from a user's checkout of its repository
(github.com/Lilac-Lee/PointNetLK_Revisited, MIT).

    load("pointnetlk-revisited", checkout=FOLDER)

FOLDER holds model.py, utils.py and logs/model_trained_on_ModelNet40_model_best.pth, as the repository does. It runs on
the CPU, in float32, as test.py there runs it on shapes (data_type "synthetic"): at most 20 iterations, both clouds
centred on their means. They are scaled so that the target's longest side is 1, as the shapes are that it was trained
on, and thinned to 10,000 points, since its Jacobian takes half a megabyte a point; two copies of one cloud stay copies.

For real scans the authors cut both clouds into the same eight voxels, found in the aligned pose before the motion is
laid on (voxel_after_transf is False). Nobody who looks for the pose can do so, and it is not done here.
"""

from __future__ import annotations

import sys
from contextlib import contextmanager
from functools import lru_cache
from importlib import import_module
from pathlib import Path

import numpy as np

from .thinning import apply, few

WEIGHTS = Path("logs", "model_trained_on_ModelNet40_model_best.pth")
MOST, ITERATIONS, TOLERANCE = 10_000, 20, 1e-7
FEATURES = 1024


def align(source, target, voxel, threads, init=None, checkout=None) -> np.ndarray:
    """From init, or with the centroids laid on each other; checkout: the folder."""
    import torch

    torch.set_num_threads(threads)
    program, network = _loaded(checkout)
    init = np.eye(4) if init is None else init
    a, b = apply(init, few(source, MOST)), few(target, MOST)
    to_unit = np.eye(4)
    to_unit[:3] /= np.ptp(b, axis=0).max()
    to_unit[:3, 3] = -to_unit[:3, :3] @ b.mean(axis=0)
    p1, p0 = (torch.from_numpy(apply(to_unit, cloud)[None].astype(np.float32)) for cloud in (a, b))
    program.do_forward(network, p0, None, p1, None, ITERATIONS, TOLERANCE, True, True, "test", "synthetic")
    found = network.g[0].detach().numpy().astype(float)
    return np.linalg.solve(to_unit, found @ to_unit) @ init


@lru_cache(maxsize=1)
def _loaded(checkout) -> tuple:
    """The class with the program, and the network with its weights; raises FileNotFoundError for another folder."""
    folder = Path(checkout or "")
    for name in (Path("model.py"), Path("utils.py"), WEIGHTS):
        if not checkout or not (folder / name).is_file():
            raise FileNotFoundError(f"the checkout of PointNetLK-Revisited must be a folder with {name}, but "
                                    f"{checkout!r} has none")
    import torch

    with _first_on_path(folder, "model", "utils"):
        model = import_module("model")
    network = model.AnalyticalPointNetLK(model.Pointnet_Features(dim_k=FEATURES), torch.device("cpu"))
    network.load_state_dict(torch.load(folder / WEIGHTS, map_location="cpu", weights_only=True))
    return model.AnalyticalPointNetLK, network.float().eval()


@contextmanager
def _first_on_path(folder: Path, *names: str):
    """Imports modules of these names from the folder, whatever else has such a name; afterwards it is as before."""
    kept = {name: sys.modules.pop(name) for name in names if name in sys.modules}
    sys.path.insert(0, str(folder.absolute()))
    try:
        yield
    finally:
        sys.path.remove(str(folder.absolute()))
        for name in names:
            sys.modules.pop(name, None)
        sys.modules.update(kept)
