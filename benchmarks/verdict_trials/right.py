"""Right pairs: all of the any-pose benchmark, and rooms whose furniture was moved."""

from __future__ import annotations

import zlib
from functools import partial

import numpy as np
import scenes
import simulations
from scenes import SETS

from fieldalign.clouds.simulated import Room, Scene

from .clouds import Scan, rng_of
from .trial import HIGH, LOW, REGISTER, RIGHT, VOXELS, Trial


def right_pairs() -> list[Trial]:
    """The pairs of the any-pose benchmark, each from two poses; the second tells where the sensors stood."""
    found = []
    for name in RIGHT:
        for seed in (0, 1):
            for recipe in SETS[name].recipes(seed):
                overlap = LOW if name == "low" or recipe.group in ("overlap 0.3", "overlap 0.1") else HIGH
                make = partial(_moved_pair, name, recipe, seed)
                label = f"{recipe.name} s{seed}"
                found.append(Trial("right", name, _scene_of(name, recipe), label, VOXELS[name], make, overlap))
    return found


def _moved_pair(name: str, recipe: scenes.Recipe, seed: int) -> tuple:
    target, source, T, _ = recipe.make()
    eye = np.zeros(3) if seed == 1 and name in ("lidar", "simulated") else None
    P = scenes._motion(SETS[name], source.mean(axis=0), np.random.default_rng([seed, zlib.crc32(recipe.name.encode())]))
    moved = Scan(source, eye).moved(P).given()
    return moved, Scan(target, eye).given(), T @ np.linalg.inv(P), SETS[name].tolerance, None, REGISTER


def _scene_of(name: str, recipe: scenes.Recipe) -> str:
    """The place that a pair was taken at; pairs of one place never lie in both halves."""
    if name in ("indoor", "low"):
        return "office" if recipe.group == "fragments" else "kitchen"
    if name == "lidar":
        return "kitti00" if recipe.name.startswith("kitti00") or recipe.name.endswith(" 000") else "kitti far"
    if name == "objects":
        return recipe.group
    first, second, *_ = recipe.name.split()
    return f"room {second}" if name == "simulated" else first


def changed(rooms: int = 14) -> list[Trial]:
    """Rooms of which the target's sensor sees two or three pieces of furniture taken away or moved: right pairs."""
    return [
        Trial(
            kind="right",
            set="changed",
            scene=f"room {number}",
            name=f"changed room {number} overlap {overlap}",
            voxel=VOXELS["simulated"],
            make=partial(_changed_pair, number, overlap),
            overlap=HIGH,
        )
        for overlap in (0.9, 0.7, 0.5)
        for number in range(1500, 1500 + rooms)
    ]


def _changed_pair(number: int, overlap: float, rays: int = 30_000) -> tuple:
    rng = rng_of("changed", number, overlap)
    _, source, T, made = simulations.simulate(number, overlap=overlap, rays=(rays, rays))
    pose = made.world_from_target
    while True:
        target = _rearranged(made.room, rng).scan(pose, rays, made.noise, seed=2 * number + 1).points
        if np.linalg.norm(target, axis=1).min() > 0.3:  # nothing was put right before the sensor
            break
    eye = np.zeros(3) if number % 2 else None
    middle = source.mean(axis=0)
    P = scenes._motion(SETS["simulated"], middle, rng)
    moved = Scan(source, eye).moved(P).given()
    return moved, Scan(target, eye).given(), T @ np.linalg.inv(P), scenes.INDOOR, None, REGISTER


def _rearranged(room: Room, rng: np.random.Generator) -> Scene:
    """The room with two or three pieces taken away, or moved by about half a metre."""
    solids = list(room.primitives)
    size = np.array(room.size)
    for _ in range(rng.integers(2, 4)):
        centres = np.array([solid.center for solid in solids])
        small = np.array([solid.reach < 1.3 for solid in solids])  # no wall, floor, beam or chimney
        loose = small & ((centres > 0.02) & (centres < size - 0.02)).all(axis=1)
        heart = centres[rng.choice(np.flatnonzero(loose))]
        piece = loose & (np.linalg.norm((centres - heart)[:, :2], axis=1) < 0.6)
        x, y = rng.uniform(0.3, 0.7, 2) * rng.choice((-1, 1), 2)
        away = rng.uniform() < 0.5
        moved = [] if away else [s.moved((x, y, 0.0)) for s, belongs in zip(solids, piece, strict=True) if belongs]
        solids = [solid for solid, belongs in zip(solids, piece, strict=True) if not belongs] + moved
    return Scene(tuple(solids))
