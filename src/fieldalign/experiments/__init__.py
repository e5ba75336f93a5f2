"""The paper's experiments, one command each (docs/experiments.md): `run(name, request)` runs one."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from typing import TypeAlias

from .request import Report, Request

__all__ = ["NAMES", "Report", "Request", "run"]

Run: TypeAlias = Callable[[Request], Report]

# name on the command line: file and function there
NAMES: dict[str, tuple[str, str]] = {
    "modelnet40": ("objects.accuracy", "MODELNET40"),
    "shapenet": ("objects.accuracy", "SHAPENET"),
    "success-rate": ("objects.accuracy", "SUCCESS_RATE"),
    "efficiency": ("objects.efficiency", "efficiency"),
    "density": ("objects.robustness", "DENSITY"),
    "noise": ("objects.robustness", "NOISE"),
    "distance-field": ("pictures.distance_field", "distance_field"),
    "pseudo-sets": ("pictures.pseudo_sets", "pseudo_sets"),
    "data-examples": ("pictures.data_examples", "data_examples"),
    "3dmatch": ("scenes.three_d_match", "EXPERIMENT"),
    "kitti": ("scenes.kitti", "EXPERIMENT"),
    "kitti-trajectory": ("scenes.trajectory", "run"),
    "ablation": ("scenes.ablation", "EXPERIMENT"),
}


def run(name: str, request: Request) -> Report:
    """Runs the experiment of a name of NAMES; only what it needs is imported."""
    module, function = NAMES[name]
    found: Run = getattr(import_module(f".{module}", __name__), function)
    return found(request)
