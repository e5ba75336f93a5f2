"""Pairs of 3DMatch's fragments (Zeng et al., CVPR 2017) in the layouts that are in use.

| layout | what it holds |
| --- | --- |
| geometric registration benchmark | SCENE/cloud_bin_*.ply, SCENE-evaluation/gt.log and gt.info: 3DMatch |
| Predator's | 3DMatch/SCENE and 3DLoMatch/SCENE with gt.log, gt.info, gt_overlap.log, also in `configs/benchmarks` |
| Deep Global Registration's | SCENE@seq-01_000.npz with `pcd`, SCENE@seq-01-0.70.txt |
| this project's part | 3dmatch/*.npz, indoor_fragments/frag_*.npz and pairs.txt |

Predator (Huang et al., CVPR 2021): 3DMatch's pairs overlap by more than 0.3, 3DLoMatch's by 0.1 to 0.3. Its fragments
are .pth, which are pickles and never loaded; those of the benchmark, or .npy, may lie in the same places.
Deep Global Registration's lists are of fragments that lie in one frame and overlap by 0.7 or more: PointNetLK-Revisited
tests on them, and so does Table II of the paper: benchmark "aligned".
indoor_fragments are of one office, and no part of 3DMatch. What the numbers of gt.log and gt.info mean: gt_log.py.
The benchmark's error of a pose T is e^T info e / info[0, 0], where e is the shift and the vector part of the unit
quaternion of inverse(T_gt) T; it is right up to 0.2^2, and neighbours (j = i + 1) do not count.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ... import _core
from ...arguments import check_one_of, check_positive
from ...clouds.thinning import thin
from ...errors import DataSetError
from ...motions import Matrix, apply, as_rigid, inverse
from ...odometry.sequences.folders import natural_order
from ...threads import resolve_threads
from .files import PathLike, array_in, arrays_in, as_folder, inside, names_in, nothing_of, number_blocks, points_of
from .gt_log import read_truth

SCENES = (
    "7-scenes-redkitchen",
    "sun3d-home_at-home_at_scan1_2013_jan_1",
    "sun3d-home_md-home_md_scan9_2012_sep_30",
    "sun3d-hotel_uc-scan3",
    "sun3d-hotel_umd-maryland_hotel1",
    "sun3d-hotel_umd-maryland_hotel3",
    "sun3d-mit_76_studyroom-76-1studyroom2",
    "sun3d-mit_lab_hj-lab_hj_tea_nov_2_2012_scan1_erika",
)
"""The test scenes of the benchmark."""

ALIGNED_SCENES = tuple(sorted({*SCENES, "sun3d-home_bksh-home_bksh_oct_30_2012_scan2_erika"} - {SCENES[1]}))
"""Those of the aligned pairs (dataset/test_3dmatch.txt of PointNetLK-Revisited): one is another."""

OVERLAPS = {"3DMatch": (0.3, 1.0), "3DLoMatch": (0.1, 0.3), "aligned": (0.7, 1.0)}
BENCHMARKS = tuple(OVERLAPS)
LAYOUTS = (
    "SCENE-evaluation/gt.log beside SCENE/cloud_bin_*.ply",
    "3DMatch/SCENE/gt.log and 3DLoMatch/SCENE/gt.log (also in benchmarks or configs/benchmarks) beside such fragments",
    "SCENE@seq-01-0.70.txt beside SCENE@seq-01_000.npz (benchmark 'aligned')",
    "3dmatch/*.npz and indoor_fragments/pairs.txt",
)

_FRAGMENT = re.compile(r"cloud_bin_(\d+)\.(ply|npy|npz|pcd)")
_ANOTHER_PLACE = ("fragments", "3DMatch", "test", "data/test", "data/indoor/test", "indoor/test", "data")
_TRUTHS = ("benchmarks", "configs/benchmarks", "metadata/benchmarks", "data/benchmarks", "fragments")


@dataclass(frozen=True, eq=False)
class FragmentPair:
    """Two fragments of a scene and the motion between them, in metres.

    name: unlike any other's. source, target: their files, as `fa.read_cloud` takes them. T_target_source: (4, 4), the
    truth. overlap: as the set gives it, None where it does not: of gt_overlap.log, the share of the target (3 cm); of
    pairs.txt, of the source (5 cm). information: (6, 6), translation first, of gt.info; None without. i, j: the numbers
    of target and source in the scene, None where they have none.
    """

    scene: str
    name: str
    source: str
    target: str
    T_target_source: Matrix
    overlap: float | None = None
    information: Matrix | None = None
    i: int | None = None
    j: int | None = None

    @property
    def group(self) -> str:
        """What its results are summed up with: the scene."""
        return self.scene

    def clouds(self) -> tuple[Matrix, Matrix]:
        """The points of source and target, (N, 3) and (M, 3) float64; raises CloudFileError where a file has none."""
        return points_of(self.source), points_of(self.target)


def pairs(folder: PathLike, benchmark: str = "3DMatch") -> list[FragmentPair]:
    """The pairs of a benchmark in a folder, by scene, then by i and j.

    benchmark: "3DMatch", "3DLoMatch", or "aligned": pairs of one frame (the truth is the identity) that overlap by 0.7
    or more, onto which the paper lays drawn motions. In this project's part, the pairs of such an overlap, at the truth
    that they have.

    Raises DataSetError where there is nothing of it, or where fragments or numbers are missing.
    """
    check_one_of("benchmark", benchmark, BENCHMARKS)
    place = as_folder(folder)
    found = _of_lists(place) if benchmark == "aligned" else _of_benchmark(place, benchmark)
    found = found or _of_part(place, benchmark)
    if not found:
        raise nothing_of(f"3DMatch (benchmark {benchmark!r})", place, LAYOUTS)
    return found


def overlap_of(pair: FragmentPair, distance: float = 0.03, voxel: float = 0.01, threads: int | None = None) -> float:
    """The share of the target's points that have a source point within `distance`, at the true pose, after thinning.

    So Predator works out what it selects the pairs by: 3 cm, after thinning at 1 cm, of the fragment with the lower
    number (scripts/cal_overlap.py). Its 3.75 cm are what it trains with. voxel=0: no thinning.
    """
    check_positive("distance", distance)
    source, target = pair.clouds()
    if voxel:
        source, target = (np.asarray(thin(points, voxel, threads=threads).points) for points in (source, target))
    cores = resolve_threads(threads)
    away, _ = _core.PointTree(apply(pair.T_target_source, source), cores).nearest(target, 1, cores)
    return float((away <= distance).mean())


def demo_pair(folder: PathLike) -> FragmentPair:
    """The pair of PointNetLK-Revisited's demonstration in `pointnetlk`: demo_pair.npz, whose p1 is the source, at the
    pose of demo_target_from_source_icp.npy, where the surfaces agree. Raises DataSetError where it is not there."""
    place = as_folder(folder)
    file, pose = (place / "pointnetlk" / name for name in ("demo_pair.npz", "demo_target_from_source_icp.npy"))
    if not (file.is_file() and pose.is_file()):
        raise nothing_of("PointNetLK-Revisited's demonstration", place, (f"pointnetlk/{file.name} and {pose.name}",))
    T = as_rigid(array_in(pose), str(pose))
    return FragmentPair("demo", "pointnetlk/demo_pair", f"{file}#p1", f"{file}#p0", T)


# ------------------------------------------------------------------------------------------------------ the benchmark


def _of_benchmark(place: Path, benchmark: str) -> list[FragmentPair]:
    truths = {scene: where for scene in SCENES if (where := _truth_folder(place, benchmark, scene)) is not None}
    return [pair for scene, where in truths.items() for pair in _of_scene(place, scene, where)]


def _truth_folder(place: Path, benchmark: str, scene: str) -> Path | None:
    names = [f"{benchmark}/{scene}"] + ([f"{scene}-evaluation"] if benchmark == "3DMatch" else [])
    places = [where / name for name in names for where in inside(place, *_TRUTHS)]
    return next((where for where in places if (where / "gt.log").is_file()), None)


def _of_scene(place: Path, scene: str, where: Path) -> Iterator[FragmentPair]:
    fragments = _fragments(place, scene)
    truth = read_truth(where)
    for (i, j), pose in sorted(truth.poses.items()):
        if i not in fragments or j not in fragments:
            missing = i if i not in fragments else j
            raise DataSetError(
                f"{where / 'gt.log'} names fragment {missing} of {scene}, but {place} holds no "
                f"{scene}/cloud_bin_{missing} that ends in .ply, .npy, .npz or .pcd (a .pth is a pickle, never "
                "loaded: convert it)"
            )
        yield FragmentPair(
            scene, f"{scene}/{i}_{j}", fragments[j], fragments[i], pose,
            overlap=truth.overlaps.get((i, j)), information=truth.information.get((i, j)), i=i, j=j,
        )


def _fragments(place: Path, scene: str) -> dict[int, str]:
    """The files of a scene's fragments by number, from the first place that has any."""
    for where in inside(place, *_ANOTHER_PLACE):
        if (where / scene).is_dir():
            matches = ((_FRAGMENT.fullmatch(file.name), file) for file in sorted((where / scene).iterdir()))
            found = {int(match[1]): str(file) for match, file in matches if match}
            if found:
                return found
    return {}


# ------------------------------------------------------------------------------------------ aligned pairs, and the part


def _of_lists(place: Path) -> list[FragmentPair]:
    """Deep Global Registration's fragments lie in one frame for each sequence, and its lists name two files a line."""
    found = []
    for where in inside(place, "threedmatch"):
        for scene in ALIGNED_SCENES:
            for listed in sorted(where.glob(f"{scene}*0.70.txt"), key=natural_order):
                found += [_aligned(where, scene, line.split(), listed) for line in names_in(listed)]
    return found


def _aligned(where: Path, scene: str, words: Sequence[str], listed: Path) -> FragmentPair:
    if len(words) < 2 or not all((where / word).is_file() for word in words[:2]):
        raise DataSetError(f"{listed} must name two files of {where} in each line, but has {' '.join(words)[:100]!r}")
    target, source = words[:2]
    name = f"{Path(target).stem}/{Path(source).stem}"
    return FragmentPair(scene, name, f"{where / source}#pcd", f"{where / target}#pcd", np.eye(4))


def _of_part(place: Path, benchmark: str) -> list[FragmentPair]:
    files = sorted((place / "3dmatch").glob("*.npz")) if benchmark != "3DLoMatch" else []
    found = [_of_npz(file) for file in files]
    if benchmark == "aligned":
        found = [replace(pair, overlap=overlap_of(pair)) for pair in found]
    lowest, highest = OVERLAPS[benchmark]
    all_of_them = found + _of_office(place / "indoor_fragments")
    return [pair for pair in all_of_them if pair.overlap is None or lowest < pair.overlap <= highest]


def _of_npz(file: Path) -> FragmentPair:
    numbers = re.search(r"_(\d+)_(\d+)$", file.stem)
    i, j = map(int, numbers.groups()) if numbers else (None, None)
    scene = file.stem[: numbers.start()] if numbers else file.stem
    T = as_rigid(arrays_in(file, "target_from_source")[0], f"target_from_source of {file}")
    return FragmentPair(scene, f"3dmatch/{file.stem}", f"{file}#source", f"{file}#target", T, i=i, j=j)


def _of_office(where: Path) -> list[FragmentPair]:
    listed = where / "pairs.txt"
    if not listed.is_file():
        return []
    rows = number_blocks(listed, 7, "rows i, j, overlap and four more")
    files = {number: where / f"frag_{number:02d}.npz" for number in sorted({int(k) for k in rows[:, :2].ravel()})}
    world_from = {
        number: as_rigid(arrays_in(file, "world_from_fragment")[0], f"world_from_fragment of {file}")
        for number, file in files.items()
    }
    return [
        FragmentPair(
            "office", f"indoor_fragments/{i}_{j}", f"{files[j]}#xyz", f"{files[i]}#xyz",
            inverse(world_from[i]) @ world_from[j], overlap=float(overlap), i=i, j=j,
        )
        for i, j, overlap in ((int(row[0]), int(row[1]), row[2]) for row in rows)
    ]


