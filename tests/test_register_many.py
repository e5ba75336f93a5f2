"""Many pairs: what one registration gives, wherever it runs, whatever breaks, and never twice."""

import json
import subprocess
import sys
import textwrap
import time
from functools import partial
from pathlib import Path

import numpy as np
import pytest

import fieldalign as fa
from fieldalign.assembly import pairs
from fieldalign.assembly.executor import Dask, Processes, Serial
from fieldalign.assembly.pair_result import PairResult
from fieldalign.motions import apply, exp_twist

T = exp_twist(np.array([0.5, -1, 0.7, 0.3, 0.2, -0.4]))
SMALL = 1e-9


def lump(seed):
    """A lopsided ball: 2000 points, a unique pose."""
    rng = np.random.default_rng(seed)
    directions, bumps = (x / np.linalg.norm(x, axis=1)[:, None] for x in (rng.normal(size=(n, 3)) for n in (2000, 6)))
    radius = 1 + np.exp(4 * (directions @ bumps.T - 1)) @ rng.uniform(0.2, 0.7, 6)
    return directions * radius[:, None] * [1, 0.8, 0.6]


@pytest.fixture(scope="module")
def scans(tmp_path_factory):
    """Two lumps as files, each as it is and moved by T, one of them truncated, and pairs of them."""
    folder = tmp_path_factory.mktemp("scans")
    for seed in (0, 1):
        fa.write_cloud(folder / f"{seed}.ply", lump(seed))
        fa.write_cloud(folder / f"{seed}_moved.ply", apply(T, lump(seed)))
    (folder / "broken.ply").write_bytes((folder / "0.ply").read_bytes()[:-1000])
    names = ["0 0_moved", "0 1", "broken 1", "1 1_moved", "1 nowhere", "0_moved 0"]
    return [tuple(str(folder / f"{name}.ply") for name in pair.split()) for pair in names]


@pytest.fixture(scope="module")
def serial(scans):
    return fa.register_many(scans)


def bits(results):
    return [
        (r.source, r.target, r.reason, r.error, r.evidence, np.array([r.overlap, r.overlap_target, r.rmse]).tobytes(),
         r.T_target_source.tobytes(), r.information.tobytes(), r.reference_point.tobytes())
        for r in results
    ]


def lines_of(folder):
    return (folder / "record.jsonl").read_text().splitlines()


# ----------------------------------------------------------------------------------------------------------- the answer


def test_the_results_are_those_of_register_in_the_order_of_the_pairs(scans, serial):
    assert [(r.source, r.target) for r in serial] == scans
    assert [r.reason.value for r in serial] == ["accepted", "ambiguous", "failed", "accepted", "failed", "accepted"]
    assert np.allclose(serial[0].T_target_source, T, atol=SMALL)
    expected = [PairResult.of(*pair, fa.register(*pair)) for pair in scans[:2]]
    assert bits(serial[:2]) == bits(expected)
    assert serial[0].verdict == fa.register(*scans[0]).verdict


def test_a_broken_scan_is_told_in_its_pairs(serial):
    assert "broken.ply" in serial[2].error
    assert serial[4].error.endswith("nowhere.ply does not exist")
    assert serial[4].verdict == f"{fa.Reason.FAILED} {serial[4].error}"
    assert not serial[4].accepted
    assert np.isnan(serial[4].T_target_source).all()


@pytest.mark.parametrize("executor", [Processes(2), Dask("local", 2)], ids=lambda executor: type(executor).__name__)
def test_the_same_bits_everywhere(scans, serial, executor):
    if isinstance(executor, Dask):
        pytest.importorskip("distributed", reason="the extra dask is not installed")
    assert bits(fa.register_many(scans, executor=executor)) == bits(serial)


def test_clouds_in_memory(serial):
    one, other = fa.PointCloud(lump(0)), apply(T, lump(0))
    given = [(one, other), (one, np.zeros((0, 3))), (fa.prepare(one), other, T)]
    results = fa.register_many(given)
    assert bits(results[:1])[0][2:] == bits(serial[:1])[0][2:]
    assert "cloud 2 must hold at least 3 distinct points" in results[1].error
    assert results[2].reason is fa.Reason.ACCEPTED_NEAR_INIT
    assert (results[2].source, results[2].target) == ("cloud 3", "cloud 1")


def test_a_cloud_is_made_ready_once_and_equal_pairs_are_one(monkeypatch, scans):
    calls = []
    for name in ("prepare_named", "register"):
        real = getattr(pairs, name)
        told = partial(lambda name, real, *given, **options: calls.append(name) or real(*given, **options), name, real)
        monkeypatch.setattr(pairs, name, told)
    first, second, back = fa.register_many([scans[0], scans[0], scans[0][::-1]])
    assert sorted(calls) == ["prepare_named", "prepare_named", "register", "register"]
    assert first is second
    assert np.allclose(back.T_target_source, np.linalg.inv(T), atol=SMALL)


def test_keywords_are_handed_on():
    pair = lump(0), apply(T, lump(0)), T
    options = {"search_angle": 20.0, "dof": "levelled", "seed": 3}
    expected = fa.register(pair[0], pair[1], init=T, **options)
    assert bits(fa.register_many([pair], **options))[0][2:] == bits([PairResult.of("", "", expected)])[0][2:]
    flat = lump(0)[:, :2]
    assert fa.register_many([(flat, flat, np.eye(3))])[0].T_target_source.shape == (3, 3)
    scaled = fa.register_many([(lump(0), 2 * lump(0))], scale=True)[0]
    assert scaled.information.shape == (7, 7)


def test_progress_is_told(scans):
    told = []
    fa.register_many(scans[:2], progress=lambda *numbers: told.append(numbers))
    assert told == [(0, 2), (1, 2), (2, 2)]
    assert fa.register_many([]) == []


@pytest.mark.parametrize("number", [0, 1, 2])
def test_a_result_comes_back_from_json_bit_by_bit(serial, number):
    again = PairResult.from_dict(json.loads(json.dumps(serial[number].to_dict(), allow_nan=False)))
    assert bits([again]) == bits([serial[number]])
    assert again.seconds == serial[number].seconds
    assert again.to_dict() == serial[number].to_dict()


@pytest.mark.parametrize(
    ("pairs", "options", "words"),
    [
        ([("a.ply",)], {}, r"pairs\[0\] must be \(source, target\)"),
        (["ab"], {}, r"pairs\[0\] must be"),
        ([("a", "b"), ("a", "b", "c")], {}, r"init of pairs\[1\] must be a \(4, 4\) matrix of numbers"),
        ([("a", "b", [1, 2])], {}, r"init of pairs\[0\] must be a \(4, 4\) matrix, but has shape"),
        ([], {"search_radius": -1}, "search_radius must be a positive number"),
        ([], {"method": "icp"}, "method must be one of"),
        ([], {"dof": "sideways"}, "dof must name freedoms"),
        ([], {"seed": -1}, "seed must be"),
        ([], {"threads": 0}, "threads must be"),
        ([], {"executor": 0}, "executor must be"),
    ],
)
def test_what_is_wrong_for_all_is_one_error(pairs, options, words):
    with pytest.raises(fa.ArgumentError, match=words):
        fa.register_many(pairs, **options)


def test_a_guess_that_is_no_pose_is_its_pairs_failure():
    result = fa.register_many([(lump(0), lump(0), np.diag([2, 2, 2, 1]))])[0]
    assert "init must be rigid" in result.error


# ----------------------------------------------------------------------------------------------------------- the record


def test_a_run_goes_on_where_it_ended(tmp_path, scans, serial):
    told = []
    some = fa.register_many(scans[:3], run_folder=tmp_path / "run")
    results = fa.register_many(scans, run_folder=tmp_path / "run", progress=lambda *numbers: told.append(numbers))
    assert bits(some) == bits(serial[:3])
    assert bits(results) == bits(serial)
    assert told == [(k, 4) for k in range(5)]  # three more, and the one that had failed
    assert len(lines_of(tmp_path / "run")) == (1 + 3) + (1 + 4)  # each with the scans that it brought
    again = fa.register_many(scans, run_folder=tmp_path / "run", progress=lambda *numbers: told.append(numbers))
    assert bits(again) == bits(serial)
    assert told[5:] == [(k, 2) for k in range(3)]


def test_a_pair_that_failed_is_tried_again(tmp_path, scans, serial):
    """Its scan was out of reach for a while."""
    path, away = Path(scans[0][0]), tmp_path / "away"
    fa.write_cloud(tmp_path / "0.ply", fa.read_cloud(path))
    pairs = [(str(tmp_path / "0.ply"), scans[0][1])]

    def vanishes(finished, of):
        if finished == 0:
            (tmp_path / "0.ply").rename(away)

    failed = fa.register_many(pairs, run_folder=tmp_path / "run", progress=vanishes)
    assert "does not exist" in failed[0].error
    away.rename(tmp_path / "0.ply")
    assert fa.register_many(pairs, run_folder=tmp_path / "run")[0].T_target_source.tobytes() == (
        serial[0].T_target_source.tobytes())


def test_other_settings_and_changed_scans_are_one_clear_error(tmp_path):
    fa.write_cloud(tmp_path / "a.ply", lump(0))
    pairs = [(tmp_path / "a.ply", lump(1))]
    run = tmp_path / "run"
    fa.register_many(pairs, run_folder=run)
    with pytest.raises(fa.RunError, match="the setting seed was 0, but is 1"):
        fa.register_many(pairs, run_folder=run, seed=1)
    with pytest.raises(fa.RunError, match="the scan cloud 0 was"):
        fa.register_many([(pairs[0][0], lump(2))], run_folder=run)
    fa.write_cloud(tmp_path / "a.ply", lump(3)[:-1])
    with pytest.raises(fa.RunError, match=r"the scan .*a\.ply was"):
        fa.register_many(pairs, run_folder=run)


def test_an_error_in_between_leaves_the_record_valid(tmp_path, scans, serial):
    def interrupt(finished, of):
        if finished == 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        fa.register_many(scans, run_folder=tmp_path, executor=2, progress=interrupt)
    assert len(lines_of(tmp_path)) == 1 + 2
    assert bits(fa.register_many(scans, run_folder=tmp_path)) == bits(serial)


class Slow(Serial):
    """Takes its time, so that it can be killed in the middle."""

    def run(self, *given):
        for done in super().run(*given):
            time.sleep(0.3)
            yield done


def test_a_client_that_is_killed_goes_on(tmp_path, scans, serial):
    program = f"""
        import sys
        sys.path.insert(0, {str(Path(__file__).parent)!r})
        import fieldalign as fa
        from test_register_many import Slow
        fa.register_many({scans!r}, run_folder={str(tmp_path)!r}, executor=Slow())
    """
    client = subprocess.Popen([sys.executable, "-c", textwrap.dedent(program)])
    while not (tmp_path / "record.jsonl").exists() or len(lines_of(tmp_path)) < 3:
        assert client.poll() is None
        time.sleep(0.02)
    client.kill()
    client.wait()
    before, told = lines_of(tmp_path), []
    recorded = [line for line in before if '"error":null' in line]
    results = fa.register_many(scans, run_folder=tmp_path, progress=lambda *numbers: told.append(numbers))
    assert bits(results) == bits(serial)
    assert told[0] == (0, len(scans) - len(recorded))
    assert len(lines_of(tmp_path)) == len(before) + len(scans) - len(recorded)
