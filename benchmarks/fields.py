"""Fields of every kind on each other, scans against volumes and meshes, and other freedoms: recall, accuracy, time.

    make bench-fields           (or: python benchmarks/fields.py --output docs/benchmarks)
    python benchmarks/fields.py --quick --only precision --output /tmp/fields

Writes fields.json (a row for each trial), fields.md (the tables that the docs quote) and fields.png into the output
folder, after each part; --only keeps the other parts of a JSON that is there. Data: ../shared/data or $FIELDALIGN_DATA.
All in one process on two cores, methods one after the other on each pair. A quarter of an hour; --quick one minute.
"""

from __future__ import annotations

from two_cores import THREADS

# isort: split
import argparse
import json
import time
import zlib
from collections.abc import Callable, Iterator
from functools import cache, partial
from itertools import product
from pathlib import Path

import cramer_rao
import fields_report as report
import numpy as np
from any_pose import version_of
from columns import Columns
from fields_made import KINDS, NOISE, POINTS, Shape, anywhere, asymmetric, fused, levelled, made, pushed, wrong_pairs
from paper import _processor as processor
from scenes import DATA, OBJECTS, apply, pairs
from scenes import _stanford as stanford
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

import fieldalign as fa
from fieldalign.evaluation import rotation_error

TOLERANCE = 2.0, 0.02  # degrees, and share of the extent: of a right answer on the shapes
SIGMAS = 0.0, NOISE, 2e-3  # of the extent
PEER_POINTS, PEER_REACH, PEER_STEPS = 100_000, 0.02, 100  # on the mesh; of the extent; at most
GUESS = 2.0, 0.02      # degrees and share of the extent by which the guess of the precision's peer is off
OVERLAP = 0.3, 0.0015  # least share of a scan within so many metres of the fused scans


# ------------------------------------------------------------------------------------------------ one answer


def measured(align: Callable, T_true: np.ndarray | None, source: np.ndarray, tolerance: tuple, unit: float = 1.0):
    """What a call answers, a result, a pose or None; and its time, verdict and errors.

    The errors: degrees, shift of the source's middle (N, 3) in the unit, and logarithm of the scale; right where all
    are small. T_true: None where nothing is right.
    """
    time.sleep(0.01)  # threads of the method before go to sleep
    start = time.perf_counter()
    try:
        found = align()
    except fa.FieldalignError as error:  # the trial is lost, not the benchmark
        print(f"   {type(error).__name__}: {error}", flush=True)
        found = None
    reason = "RAISED" if found is None else "OF A PEER"
    row = {"wall_ms": 1e3 * (time.perf_counter() - start), "accepted": False, "reason": reason}
    if isinstance(found, fa.RegistrationResult):
        row |= {"accepted": bool(found.accepted), "reason": found.reason.name}
        row |= {"stages_ms": {stage: 1e3 * seconds for stage, seconds in found.seconds.items()}}
    if T_true is None:
        return found, row
    return found, row | errors(pose_of(found), T_true, source.mean(axis=0, keepdims=True), tolerance, unit)


def pose_of(found) -> np.ndarray | None:
    return found.T_target_source if isinstance(found, fa.RegistrationResult) else found


def errors(T: np.ndarray | None, T_true: np.ndarray, centre: np.ndarray, tolerance: tuple, unit: float) -> dict:
    if T is None:
        return {"deg": None, "shift": None, "growth": None, "right": False}
    size, size_true = (float(np.cbrt(np.linalg.det(M[:3, :3]))) for M in (T, T_true))
    turned = rotation_error(T[:3, :3] / size, T_true[:3, :3] / size_true)
    shifted = float(np.linalg.norm(apply(T, centre) - apply(T_true, centre)) / unit)
    growth = abs(np.log(size / size_true))
    right = turned < tolerance[0] and shifted < tolerance[1] and growth < report.SCALE
    return {"deg": turned, "shift": shifted, "growth": growth, "right": bool(right)}


def in_short(row: dict) -> str:
    if row["reason"] == "RAISED":
        return "RAISED"
    answer = f"{'ok' if row['right'] else 'LOST'} {row['deg']:.2g} deg {row['shift']:.2g} {row['wall_ms']:.0f} ms"
    return answer if row["accepted"] == row["right"] or "PEER" in row["reason"] else f"{answer} BUT {row['reason']}"


def rotated(rows: list, place: int) -> list:
    """The methods in an order that changes from pair to pair."""
    return rows[place % len(rows) :] + rows[: place % len(rows)]


@cache
def chosen(count: int) -> tuple[list[Shape], dict[str, float]]:
    return asymmetric(count)


# ------------------------------------------------------------------------------------------------ every kind on each


def pairings(seed: int, quick: bool) -> dict:
    """All 16 pairings on each shape, its motions the same for all of them."""
    shapes, symmetry = chosen(2 if quick else 24)
    columns = Columns()
    for shape in shapes:
        for row in of_shape(shape, np.random.default_rng([seed, int(shape.name)])):
            columns.add(**row)
    return {"seed": seed, "symmetry": symmetry, "trials": columns.lists()}


def of_shape(shape: Shape, rng: np.random.Generator) -> Iterator[dict]:
    source_from_shape, target_from_shape = (anywhere(shape.extent, rng) for _ in range(2))
    whole, part = shape.surface(POINTS, rng), shape.seen(POINTS, rng)
    sources = {kind: made(kind, shape, source_from_shape, part, rng) for kind in KINDS}
    targets = {kind: made(kind, shape, target_from_shape, part, rng) for kind in KINDS}
    whole_points = made("points", shape, target_from_shape, whole, rng)
    T_true = target_from_shape @ np.linalg.inv(source_from_shape)
    for one, other in product(KINDS, KINDS):
        target = whole_points if one == other == "points" else targets[other]
        seen = part if "points" in (one, other) else whole
        align = partial(fa.register, sources[one], target, threads=THREADS)
        found, row = measured(align, T_true, apply(source_from_shape, seen), TOLERANCE, shape.extent)
        row["off"] = None
        if found is not None:  # where it puts what is seen, in the frame of the shape
            moved = np.linalg.inv(target_from_shape) @ found.T_target_source @ source_from_shape
            row["off"] = shape.off(apply(np.linalg.inv(moved) if other == "points" != one else moved, seen))
        print("pairings", shape.name, one, "on", other, in_short(row), flush=True)
        yield {"shape": shape.name, "source": one, "target": other, **row}


# ------------------------------------------------------------------------------------------------ fused scans


def fusion(seed: int, quick: bool) -> dict:
    """Every second scan is fused; the others are registered against the volume, and against the fused scans' points."""
    columns, volumes = Columns(), Columns()
    for name in ("bunny", "dragon_stand"):
        names, scans, world = stanford(name)
        start = time.perf_counter()
        volume = fused(scans[::2], world[::2])
        volumes.add(object=name, scans=names[::2], voxel=float(volume.spacing[0]), seconds=time.perf_counter() - start)
        points = np.concatenate([apply(W, scan) for W, scan in zip(world[::2], scans[::2], strict=True)])
        tree, targets = cKDTree(points), [("volume", volume), ("points", points)]
        for k, pose in product(range(1, len(scans), 6 if quick else 2), range(1 if quick else 3)):
            overlap = float((tree.query(apply(world[k], scans[k][::10]))[0] < OVERLAP[1]).mean())
            P = anywhere(0.1, np.random.default_rng([seed, k, pose]))
            source, T_true = apply(P, scans[k]), world[k] @ np.linalg.inv(P)
            for target, field in rotated(targets, k // 2 + pose) if overlap > OVERLAP[0] else []:
                align = partial(fa.register, source, field, threads=THREADS)
                _, row = measured(align, T_true, source, OBJECTS)
                columns.add(object=name, scan=names[k], pose=pose, target=target, overlap=overlap, **row)
                print("fusion", name, names[k], pose, target, in_short(row), flush=True)
    return {"seed": seed, "volumes": volumes.lists(), "trials": columns.lists()}


# ------------------------------------------------------------------------------------------------ precision


def precision(seed: int, quick: bool) -> dict:
    """A part of the surface as points against the mesh: the error without noise, and beside the Cramer-Rao bound."""
    shapes, _ = chosen(2 if quick else 24)
    columns = Columns()
    for place, (shape, draw, sigma) in enumerate(product(shapes[:12], range(1 if quick else 4), SIGMAS)):
        rng = np.random.default_rng([seed, int(shape.name), draw])
        for row in against_mesh(shape, sigma, rng, place):
            columns.add(shape=shape.name, draw=draw, sigma=sigma, **row)
            print("precision", shape.name, draw, sigma, row["method"], in_short(row), flush=True)
    return {"seed": seed, "trials": columns.lists()}


def against_mesh(shape: Shape, sigma: float, rng: np.random.Generator, place: int) -> Iterator[dict]:
    source_from_shape, target_from_shape = (anywhere(shape.extent, rng) for _ in range(2))
    part, noise = shape.seen(POINTS, rng), sigma * shape.extent
    source, in_target = apply(source_from_shape, part), apply(target_from_shape, part)
    source += noise * rng.normal(size=part.shape)
    target, T_true = shape.moved(target_from_shape), target_from_shape @ np.linalg.inv(source_from_shape)
    bound = bound_of(in_target, target.sample(in_target).normal, noise or shape.extent)
    guess = pushed(T_true, source.mean(axis=0), np.radians(GUESS[0]), GUESS[1] * shape.extent, rng)
    surface = apply(target_from_shape, shape.surface(PEER_POINTS, rng))
    methods = {
        "fieldalign": partial(fa.register, source, target, threads=THREADS),
        "fieldalign, from the guess": partial(fa.register, source, target, init=guess, threads=THREADS),
        "open3d": by_open3d(source, surface, target.sample(surface).normal, guess, PEER_REACH * shape.extent),
    }
    for method in rotated(list(methods), place):
        found, row = measured(methods[method], T_true, source, TOLERANCE, shape.extent)
        yield {"method": method, **row, **beside(bound, found, T_true, noise, shape.extent)}


def beside(bound: cramer_rao.Bound, found, T_true: np.ndarray, noise: float, extent: float) -> dict:
    """Turn (rad) and shift (share of the extent) of the error, their squares over those of the bound, and the NEES."""
    if found is None:
        return {"rad": None, "share": None, "mean_square": None, "nees": None}
    error = bound.error(pose_of(found), T_true)
    sizes = np.linalg.norm(error[:3]), np.linalg.norm(error[3:])
    row = {"rad": float(sizes[0]), "share": float(sizes[1] / extent)}
    row["mean_square"] = [(size / rms) ** 2 for size, rms in zip(sizes, bound.rms, strict=True)] if noise else None
    row["nees"] = nees(found, T_true) if noise and isinstance(found, fa.RegistrationResult) else None
    return row


def bound_of(points: np.ndarray, normals: np.ndarray, noise: float) -> cramer_rao.Bound:
    """The bound of points (N, 3) against a surface that is known exactly: each measures along its normal."""
    centre = points.mean(axis=0)
    J = np.hstack([np.cross(points - centre, normals), normals])
    return cramer_rao.Bound(noise**2 * np.linalg.inv(J.T @ J), centre, (np.nan, np.nan))


def nees(found: fa.RegistrationResult, T_true: np.ndarray) -> float:
    """The squared error over the stated covariance: 6 on average where it is right."""
    D, centre = T_true @ np.linalg.inv(found.T_target_source), found.reference_point
    x = np.r_[Rotation.from_matrix(D[:3, :3]).as_rotvec(), apply(D, centre[None])[0] - centre]
    return float(x @ found.information @ x)


def by_open3d(source, surface, normals, guess, reach: float) -> Callable[[], np.ndarray]:
    """Open3D's ICP, point to plane, of the source against points on the mesh, all ready."""
    import open3d as o3d

    moving, fixed = (o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points)) for points in (source, surface))
    fixed.normals = o3d.utility.Vector3dVector(normals)
    registration = o3d.pipelines.registration
    estimation = registration.TransformationEstimationPointToPlane()
    criteria = registration.ICPConvergenceCriteria(1e-12, 1e-12, PEER_STEPS)
    return lambda: registration.registration_icp(moving, fixed, reach, guess, estimation, criteria).transformation


# ------------------------------------------------------------------------------------------------ freedoms


def freedoms(seed: int, quick: bool) -> dict:
    """Pairs that are levelled, with dof="levelled" and without; and none that is right, levelled."""
    columns = Columns()
    for place, case in enumerate(pairs("indoor", seed, 2 if quick else None)):
        T_true = levelled(1.0, np.random.default_rng([seed, place]))
        source = apply(np.linalg.inv(T_true) @ case.T_target_source, case.source)
        for dof in rotated([None, "levelled"], place):
            align = partial(fa.register, source, case.target, dof=dof, threads=THREADS)
            _, row = measured(align, T_true, source, case.tolerance)
            columns.add(set="indoor", name=case.name, dof=dof or "all", **row)
            print("freedoms", case.name, dof, in_short(row), flush=True)
    return {"seed": seed, "trials": columns.lists(), "wrong": none_right(seed, quick, levelled, dof="levelled")}


def scales(seed: int, quick: bool) -> dict:
    """Every third real pair with the source at another scale; and none that is right, at any."""
    columns = Columns()
    for name in ("indoor", "objects", "lidar"):
        for place, case in enumerate(pairs(name, seed, 2 if quick else None)):
            if quick or place % 3 == 0:
                factor = factor_of(seed, zlib.crc32(case.name.encode()))
                source, T_true = factor * case.source, case.T_target_source @ np.diag([1 / factor] * 3 + [1])
                align = partial(fa.register, source, case.target, scale=True, threads=THREADS)
                _, row = measured(align, T_true, source, case.tolerance)
                columns.add(set=name, name=case.name, factor=factor, **row)
                print("scales", case.name, f"x {factor:.2f}", in_short(row), flush=True)
    return {"seed": seed, "trials": columns.lists(), "wrong": none_right(seed, quick, anywhere, scale=True)}


def factor_of(*key: int) -> float:
    return float(np.exp(np.random.default_rng(key).uniform(-1, 1)))


def none_right(seed: int, quick: bool, motion: Callable, **options) -> dict:
    """Pairs of which every answer is wrong; with a free scale, at another one."""
    columns = Columns()
    for place, (kind, name, source, target) in enumerate(wrong_pairs(6 if quick else 200, seed, motion)):
        source *= factor_of(seed, place) if "scale" in options else 1
        _, row = measured(partial(fa.register, source, target, **options, threads=THREADS), None, source, ())
        columns.add(kind=kind, name=name, **row)
        print("wrong", options, kind, name, row["reason"], f"{row['wall_ms']:.0f} ms", flush=True)
    return columns.lists()


# ------------------------------------------------------------------------------------------------ command line

PARTS = {"pairings": pairings, "fusion": fusion, "precision": precision, "freedoms": freedoms, "scales": scales}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--only", nargs="+", choices=list(PARTS), help="parts to measure")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--quick", action="store_true", help="a few trials of each part")
    parser.add_argument("--output", type=Path, default=Path("docs/benchmarks"))
    arguments = parser.parse_args()
    if not DATA.is_dir():
        raise SystemExit(f"no data: neither $FIELDALIGN_DATA nor {DATA} is a folder")
    arguments.output.mkdir(parents=True, exist_ok=True)
    earlier = arguments.output / "fields.json"
    results = json.loads(earlier.read_text()) if arguments.only and earlier.exists() else {}
    results |= head(arguments.quick)
    for name in arguments.only or PARTS:
        start = time.perf_counter()
        results[name] = PARTS[name](arguments.seed, arguments.quick)
        results[name]["seconds"] = time.perf_counter() - start
        report.write(results, arguments.output)
    print(report.as_markdown(results))


def head(quick: bool) -> dict:
    installed = ("numpy", "scipy", "libigl", "open3d")
    return {
        "machine": f"{THREADS} cores of {processor()}",
        "date": time.strftime("%Y-%m-%d"),
        "versions": {"fieldalign": fa.__version__} | {name: version_of(name) for name in installed},
        "protocol": {"quick": quick, "threads": THREADS, "tolerance": TOLERANCE, "points": POINTS, "noise": NOISE},
    }


if __name__ == "__main__":
    main()
