"""The adapters of benchmarks/peers: loaded by path under any name, each for itself where its package is installed."""

import sys
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path

import numpy as np
import pytest

from fieldalign.evaluation import rotation_error, translation_error
from fieldalign.motions import apply, exp_twist, inverse

FOLDER = Path(__file__).parents[2] / "benchmarks" / "peers"
NEEDED = {"pycpd_cpd": "pycpd", "probreg_methods": "probreg", "kiss": "kiss_matcher", "gicp": "small_gicp"}
UNIQUE = np.array([0.3, -0.2, 0.25, 0.1, -0.15, 0.05])

FAKE = '''
import torch
import utils

class Pointnet_Features(torch.nn.Module):
    def __init__(self, dim_k=1024):
        super().__init__()
        self.layer = torch.nn.Linear(3, dim_k)

class AnalyticalPointNetLK(torch.nn.Module):
    def __init__(self, ptnet, device):
        super().__init__()
        self.ptnet, self.device, self.g = ptnet, device, None

    @staticmethod
    def do_forward(net, p0, voxel_coords_p0, p1, voxel_coords_p1, maxiter=10, xtol=1.0e-7, p0_zero_mean=True,
                   p1_zero_mean=True, mode="train", data_type="synthetic", num_random_points=100):
        assert p0.dtype == p1.dtype == torch.float32 and p0.shape == p1.shape == (1, utils.COUNT, 3)
        assert abs(float((p0[0].amax(0) - p0[0].amin(0)).max()) - 1) < 1e-5
        assert (maxiter, xtol, mode, data_type) == (20, 1e-7, "test", "synthetic") and p0_zero_mean and p1_zero_mean
        assert not net.training and float(net.ptnet.layer.weight[0, 0].detach()) == 7
        m0, m1 = p0.mean(1), p1.mean(1)
        U, _, V = torch.linalg.svd((p0[0] - m0).T @ (p1[0] - m1))
        net.g = torch.eye(4)[None]
        net.g[0, :3, :3] = U @ torch.diag(torch.tensor([1.0, 1.0, float(torch.det(U @ V))])) @ V
        net.g[0, :3, 3] = m0[0] - net.g[0, :3, :3] @ m1[0]
'''


@pytest.fixture(scope="module")
def peers():
    spec = spec_from_file_location("any_name", FOLDER / "__init__.py", submodule_search_locations=[str(FOLDER)])
    module = sys.modules[spec.name] = module_from_spec(spec)
    spec.loader.exec_module(module)
    yield module
    for name in [name for name in sys.modules if name.split(".")[0] == spec.name]:
        del sys.modules[name]


METHODS = ["kiss", "ransac", "fgr", "gicp", "gicp-plain", "icp", "icp-point", "icp-plane", "cpd", "filterreg", "svr"]


@pytest.mark.parametrize("name", METHODS)
def test_each_finds_a_small_motion(peers, name, rng):
    module = peers.METHODS[name][0]
    pytest.importorskip(NEEDED.get(module, "open3d"))
    shape = rng.uniform(-1, 1, (4000, 3)) * [1, 0.7, 0.5]
    shape[np.arange(4000), rng.integers(0, 3, 4000)] = rng.choice([-0.3, 0.4, 0.6], 4000)
    T = exp_twist(UNIQUE)
    for init in (T @ exp_twist(0.2 * UNIQUE[::-1]), None):
        found = peers.load(name)(apply(inverse(T), shape), shape, 0.05, 1, init)
        assert rotation_error(found, T) < 5
        assert translation_error(found, T) < 0.05


def test_all_are_there(peers):
    for module, title, _ in peers.METHODS.values():
        assert (FOLDER / f"{module}.py").is_file()
        assert title


def test_thinning_keeps_copies_copies_and_comes_back(peers, rng):
    from importlib import import_module

    thinning = import_module("any_name.thinning")
    points, T = rng.normal(size=(5000, 3)) + 100, exp_twist(UNIQUE)
    source = apply(inverse(T), points)
    for init in (None, T):
        moving, fixed, to_moving, to_fixed = thinning.at_unit_size(source, points, init)
        assert len(moving) == len(fixed) == 2000
        assert np.mean(np.sum(fixed**2, axis=1)) == pytest.approx(1)
        if init is None:
            assert np.abs(moving.mean(axis=0)).max() < 1e-12
    assert np.allclose(moving, fixed)
    assert np.allclose(thinning.as_came(np.eye(3), np.zeros(3), to_moving, to_fixed), T)


@pytest.fixture
def checkout(tmp_path):
    """A folder with the interface of PointNetLK-Revisited; what it has for a network solves pairs of copies."""
    torch = pytest.importorskip("torch")
    (tmp_path / "model.py").write_text(FAKE)
    (tmp_path / "utils.py").write_text("COUNT = 3000\n")
    (tmp_path / "logs").mkdir()
    weights = {"ptnet.layer.weight": torch.full((1024, 3), 7.0), "ptnet.layer.bias": torch.zeros(1024)}
    torch.save(weights, tmp_path / "logs" / "model_trained_on_ModelNet40_model_best.pth")
    return tmp_path


def test_pointnetlk_revisited_from_a_checkout(peers, checkout, rng):
    points, T = rng.uniform(-3, 2, (3000, 3)) + 50, exp_twist(UNIQUE)
    align = peers.load("pointnetlk-revisited", checkout=str(checkout))
    for init in (None, exp_twist(0.5 * UNIQUE)):
        found = align(apply(inverse(T), points), points, 0.02, 1, init)
        assert rotation_error(found, T) < 1e-3
        assert np.abs(apply(found, apply(inverse(T), points)) - points).max() < 1e-4
    assert not {"model", "utils"} & set(sys.modules)
    assert str(checkout) not in sys.path


@pytest.mark.parametrize("missing", ["model.py", "utils.py", "logs/model_trained_on_ModelNet40_model_best.pth"])
def test_pointnetlk_revisited_without_a_file(peers, checkout, rng, missing):
    (checkout / missing).unlink()
    with pytest.raises(FileNotFoundError, match=f"must be a folder with {missing}"):
        peers.load("pointnetlk-revisited", checkout=str(checkout))(*rng.normal(size=(2, 50, 3)), 0.1, 1)


def test_pointnetlk_revisited_without_a_checkout(peers, rng):
    pytest.importorskip("torch")
    with pytest.raises(FileNotFoundError, match=r"must be a folder with model\.py, but None"):
        peers.load("pointnetlk-revisited")(*rng.normal(size=(2, 50, 3)), 0.1, 1)
