"""3DMatch's pairs in each of their layouts, written and read back; and the part that comes with the project."""

import pickle

import numpy as np
import pytest

import fieldalign as fa
from fieldalign.errors import ArgumentError, DataSetError
from fieldalign.experiments.data_sets import three_d_match
from fieldalign.experiments.data_sets.gt_log import read_truth
from fieldalign.experiments.data_sets.three_d_match import overlap_of, pairs
from fieldalign.motions import apply, inverse

KITCHEN, STUDY = three_d_match.SCENES[0], three_d_match.SCENES[6]
NUMBERS = (0, 2, 10)


@pytest.fixture
def scene(corner, any_motion, rng):
    """Three fragments of one room, of the same 2000 points, in frames of their own; and the poses of these frames."""
    world_from = {number: any_motion(rng, 2.0) for number in NUMBERS}
    return {number: apply(inverse(T), corner[:2000]) for number, T in world_from.items()}, world_from


def write_fragments(folder, fragments, suffix=".ply"):
    folder.mkdir(parents=True, exist_ok=True)
    for number, points in fragments.items():
        fa.write_cloud(folder / f"cloud_bin_{number}{suffix}", points)


def write_truth(folder, world_from, which=((2, 10), (0, 10), (0, 2)), overlaps=None, number="%.12f"):
    folder.mkdir(parents=True, exist_ok=True)
    log, info = "", ""
    for i, j in which:
        rows = inverse(world_from[i]) @ world_from[j]
        head = f"{i}\t {j}\t {len(world_from)}\t\n"
        log += head + "".join("\t ".join(number % value for value in row) + "\t\n" for row in rows)
        info += head + "".join("\t".join(f"{100 * i + j + r + c}" for c in range(6)) + "\n" for r in range(6))
    (folder / "gt.log").write_text(log)
    (folder / "gt.info").write_text(info)
    if overlaps:
        (folder / "gt_overlap.log").write_text("".join(f"{i},{j},{value:.4f}\n" for (i, j), value in overlaps.items()))


def lie_on_each_other(pair):
    source, target = pair.clouds()
    return np.abs(apply(pair.T_target_source, source) - target).max() < 1e-5


@pytest.mark.parametrize("within", ["", "fragments", "data/indoor/test"])
def test_the_geometric_registration_benchmark(within, tmp_path, scene):
    fragments, world_from = scene
    for name in (STUDY, KITCHEN):
        write_fragments(tmp_path / within / name, fragments)
    write_truth(tmp_path / ("" if "data" in within else within) / f"{KITCHEN}-evaluation", world_from, number="%15.8e")
    write_truth(tmp_path / f"{STUDY}-evaluation", world_from, which=((0, 2),))
    found = pairs(tmp_path)
    assert [(p.scene, p.i, p.j) for p in found] == [(KITCHEN, 0, 2), (KITCHEN, 0, 10), (KITCHEN, 2, 10), (STUDY, 0, 2)]
    assert [p.name for p in found[:2]] == [f"{KITCHEN}/0_2", f"{KITCHEN}/0_10"]
    assert all(lie_on_each_other(pickle.loads(pickle.dumps(p))) for p in found)
    assert all(p.overlap is None for p in found)
    assert found[2].information[1, 3] == 214
    assert found[2].information.shape == (6, 6)
    with pytest.raises(DataSetError, match="holds nothing of 3DMatch"):
        pairs(tmp_path, "3DLoMatch")


@pytest.mark.parametrize("place", ["", "benchmarks", "configs/benchmarks"])
@pytest.mark.parametrize("suffix", [".ply", ".npy"])
def test_predators_layout(place, suffix, tmp_path, scene):
    fragments, world_from = scene
    write_fragments(tmp_path / KITCHEN, fragments, suffix)
    overlaps = {(0, 2): 0.35, (0, 10): 0.2, (2, 10): 0.1234}
    write_truth(tmp_path / place / "3DMatch" / KITCHEN, world_from, ((0, 2),), overlaps)
    write_truth(tmp_path / place / "3DLoMatch" / KITCHEN, world_from, ((0, 10), (2, 10)), overlaps)
    (high,), low = pairs(tmp_path), pairs(tmp_path, "3DLoMatch")
    assert (high.i, high.j, high.overlap) == (0, 2, 0.35)
    assert [(p.i, p.j, p.overlap) for p in low] == [(0, 10, 0.2), (2, 10, 0.1234)]
    assert all(lie_on_each_other(p) for p in [high, *low])


def test_a_fragment_that_is_missing_is_named(tmp_path, scene):
    fragments, world_from = scene
    write_fragments(tmp_path / KITCHEN, fragments)
    write_truth(tmp_path / f"{KITCHEN}-evaluation", world_from)
    (tmp_path / KITCHEN / "cloud_bin_10.ply").rename(tmp_path / KITCHEN / "cloud_bin_10.pth")
    with pytest.raises(DataSetError, match=rf"names fragment 10 of {KITCHEN}.*a \.pth is a pickle, never loaded"):
        pairs(tmp_path)


def test_logs_that_are_broken(tmp_path, scene):
    _, world_from = scene
    write_truth(tmp_path, world_from)
    log = (tmp_path / "gt.log").read_text()
    for text, words in (
        (log.rsplit("\n", 2)[0], r"gt\.log must hold pairs i, j, count and their poses"),  # a pose of 3 rows
        (log.replace("1.000000000000", "nan"), "numbers that are not finite"),
        (log.replace("1.000000000000", "one"), r"gt\.log cannot be read as pairs"),
        (log.replace("1.000000000000", "2.0"), r"the pose of pair \(2, 10\) in .*gt\.log must end in the row 0 0 0 1"),
        ("", "but holds 0 numbers"),
    ):
        (tmp_path / "gt.log").write_text(text)
        with pytest.raises(ArgumentError, match=words):
            read_truth(tmp_path)
    (tmp_path / "gt.log").write_text(log)
    (tmp_path / "gt.info").write_text((tmp_path / "gt.info").read_text()[:-30])
    with pytest.raises(DataSetError, match=r"gt\.info must hold pairs i, j, count and matrices"):
        read_truth(tmp_path)
    with pytest.raises(DataSetError, match=r"holds no gt\.log"):
        read_truth(tmp_path / "nowhere")


def test_aligned_pairs_of_lists(tmp_path, corner):
    scene = three_d_match.ALIGNED_SCENES[0]
    names = [f"{scene}@seq-01_{k:03d}.npz" for k in range(3)]
    for name in names:
        np.savez(tmp_path / name, pcd=corner[:100], color=corner[:100])
    lines = f"{names[0]} {names[2]} 0.81\n{names[1]} {names[2]} 0.7\n"
    (tmp_path / f"{scene}@seq-01-0.70.txt").write_text(lines)
    (tmp_path / f"{scene}@seq-01-0.50.txt").write_text(f"{names[0]} {names[1]} 0.5\n")
    found = pairs(tmp_path, "aligned")
    assert [p.name for p in found] == [f"{scene}@seq-01_{i:03d}/{scene}@seq-01_002" for i in (0, 1)]
    assert all(np.array_equal(p.T_target_source, np.eye(4)) for p in found)
    assert np.array_equal(found[0].clouds()[0], corner[:100])
    (tmp_path / names[1]).unlink()
    with pytest.raises(DataSetError, match=r"0\.70\.txt must name two files"):
        pairs(tmp_path, "aligned")


def test_the_share_that_overlaps(tmp_path, scene, corner):
    """The source is half of the target: all of it lies on the target, but half of the target lies on it."""
    fragments, world_from = scene
    write_fragments(tmp_path / KITCHEN, {0: fragments[0], 2: fragments[2][corner[:2000, 0] < 1.5]})
    write_truth(tmp_path / f"{KITCHEN}-evaluation", world_from, ((0, 2),))
    (pair,) = pairs(tmp_path)
    expected = (corner[:2000, 0] < 1.5).mean()
    assert abs(overlap_of(pair, distance=1e-4, voxel=0) - expected) < 1e-12
    assert expected < overlap_of(pair, distance=0.3) < expected + 0.3
    with pytest.raises(ArgumentError, match="distance must be a positive number"):
        overlap_of(pair, distance=0)


def test_clouds_lose_what_is_missing(tmp_path, scene):
    fragments, world_from = scene
    holes = fragments[2].copy()
    holes[::7] = np.nan
    write_fragments(tmp_path / KITCHEN, {0: fragments[0], 2: holes})
    write_truth(tmp_path / f"{KITCHEN}-evaluation", world_from, ((0, 2),))
    (pair,) = pairs(tmp_path)
    source, target = pair.clouds()
    assert (len(source), len(target)) == (2000 - len(holes[::7]), 2000)
    write_fragments(tmp_path / KITCHEN, {2: np.full((5, 3), np.nan)})
    with pytest.raises(DataSetError, match=r"cloud_bin_2\.ply must hold finite points, but holds none"):
        pair.clouds()


def test_a_folder_without_it(tmp_path):
    for benchmark in three_d_match.BENCHMARKS:
        with pytest.raises(DataSetError, match=rf"holds nothing of 3DMatch \(benchmark '{benchmark}'\); looked for"):
            pairs(tmp_path, benchmark)
    with pytest.raises(ArgumentError, match="benchmark must be one of 3DMatch, 3DLoMatch, aligned"):
        pairs(tmp_path, "4DMatch")


def test_the_scenes():
    assert len(set(three_d_match.SCENES)) == len(set(three_d_match.ALIGNED_SCENES)) == 8


def test_the_part(data):
    high, low, aligned = (pairs(data, benchmark) for benchmark in three_d_match.BENCHMARKS)
    assert len(high) == 36
    assert len(low) == 9
    assert {p.name for p in aligned} <= {p.name for p in high}
    assert len({p.name for p in high + low}) == 45
    assert all(p.overlap > 0.7 for p in aligned)
    for pair in (high[0], high[10], low[0]):
        assert overlap_of(pair, distance=0.05, voxel=0.02) > 0.1
    kitchen = next(p for p in high if p.name == "3dmatch/redkitchen_0_1")
    assert (kitchen.scene, kitchen.i, kitchen.j) == ("redkitchen", 0, 1)
