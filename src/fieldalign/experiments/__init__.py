"""The paper's experiments, one command each (docs/experiments.md): `EXPERIMENTS[name](request)` runs one."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from typing import TypeAlias

from .request import Report, Request

__all__ = ["NAMES", "Report", "Request", "run"]

Run: TypeAlias = Callable[[Request], Report]

# name on the command line: file and function there
NAMES: dict[str, tuple[str, str]] = {
    "modelnet40": ("accuracy", "MODELNET40"),
    "shapenet": ("accuracy", "SHAPENET"),
    "success-rate": ("accuracy", "SUCCESS_RATE"),
    "efficiency": ("efficiency", "efficiency"),
    "density": ("robustness", "DENSITY"),
    "noise": ("robustness", "NOISE"),
    "distance-field": ("distance_field", "distance_field"),
    "pseudo-sets": ("pseudo_sets", "pseudo_sets"),
    "data-examples": ("data_examples", "data_examples"),
    "3dmatch": ("three_d_match", "EXPERIMENT"),
    "kitti": ("kitti", "EXPERIMENT"),
    "kitti-trajectory": ("kitti_trajectory", "run"),
    "ablation": ("ablation", "EXPERIMENT"),
}


def run(name: str, request: Request) -> Report:
    """Runs the experiment of a name of NAMES; only what it needs is imported."""
    module, function = NAMES[name]
    found: Run = getattr(import_module(f".{module}", __name__), function)
    return found(request)
