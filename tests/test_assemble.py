"""Many scans: each in its place or left out with a reason, the same anywhere, and never done twice."""

import json

import numpy as np
import pytest

import fieldalign as fa
from fieldalign.assembly import stages
from fieldalign.assembly.executor import Processes, Serial
from fieldalign.clouds.simulated import Box, Cylinder, Scene, Sphere, simulate_room
from fieldalign.motions import apply, exp_twist, inverse, log_motion, translation

WIDE = 200, 110  # degrees


def hall():
    """A place unlike any room: long, narrow and high, with crates, drums and balls."""
    rng = np.random.default_rng(11)
    size = np.array([8.5, 3.8, 3.4])
    shell = [Box(tuple(size / 2 + (size / 2 + 0.05) * side), tuple(np.where(side, 0.1, size + 0.2)))
             for side in np.vstack([np.eye(3), -np.eye(3)])]
    places = rng.uniform([0.5, 0.3, 0], [8, 3.5, 0], (18, 3))
    places = places[np.abs(places[:, 1] - 1.9) > 0.6]
    crates = [Box((x, y, h / 2), (w, d, h), yaw=3 * w) for (x, y, _), (w, d, h) in
              zip(places, rng.uniform([0.3, 0.2, 0.4], [1.1, 0.7, 1.9], (len(places), 3)), strict=True)]
    drums = [Cylinder((x, 0.5, 0), (x + 0.4, 0.6, 1.1), 0.3) for x in (1.7, 5.2)]
    balls = [Sphere((2.5, 3.1, 0.4), 0.4), Sphere((6.1, 1.9, 2.9), 0.35), Sphere((7.6, 0.6, 2.0), 0.3)]
    return Scene((*shell, *crates, *drums, *balls)), size


def scans_of(scene, size, count=3, points=5000):
    """Scans in the frames of their sensors, levelled, and world_from_scan of each."""
    made = []
    for k in range(count):
        T = exp_twist(np.array([0, 0, 0.3 * k, 0, 0, 0]))
        T[:3, 3] = size[0] / 2 + 0.35 * k - 0.4, size[1] / 2 - 0.2 * k + 0.2, 1.5 + 0.2 * (k == 1)
        made.append((scene.scan(T, points, 0.004, WIDE, seed=k).points, T))
    return made


def degrees(T):
    return np.degrees(np.linalg.norm(log_motion(T)[:3]))


def check_truth(found, truth, members, angle=1.0, shift=0.03):
    """Relative to the first of them."""
    first = members[0]
    for k in members:
        E = inverse(inverse(truth[first]) @ truth[k]) @ inverse(found.poses[first]) @ found.poses[k]
        assert degrees(E) < angle
        assert np.linalg.norm(E[:3, 3]) < shift


def bits(found):
    plain = found.to_dict()
    for edge in plain["edges"] + plain["doubted"]:
        edge.pop("seconds", None)
    del plain["seconds"]
    return json.dumps(plain), [
        (m.points.tobytes(), m.normals.tobytes(), m.attributes["scan"].tobytes()) for m in found.models
    ]


@pytest.fixture(scope="module")
def places():
    """Three scans of a room, and of a hall."""
    room = simulate_room(0)
    return {"room": scans_of(room, room.size), "hall": scans_of(*hall())}


@pytest.fixture(scope="module")
def heap(places, any_motion):
    """Six scans of two places in any order and pose, one of them twice, one of five equal points, one of a ball: the
    clouds, world_from_cloud of those of places, and what each is of."""
    rng = np.random.default_rng(3)
    made = [(cloud, T, kind) for kind, scans in places.items() for cloud, T in scans]
    made.append(made[1])
    ball = rng.normal(size=(4000, 3)) * [1, 1, 0.98]
    made += [(np.ones((5, 3)), np.eye(4), "broken"), (ball / np.linalg.norm(ball, axis=1)[:, None], np.eye(4), "ball")]
    clouds, truth, kinds = [], [], []
    for k in rng.permutation(len(made)):
        cloud, T, kind = made[k]
        moved = any_motion(rng, 5.0)
        clouds.append(apply(moved, cloud))
        truth.append(T @ inverse(moved))
        kinds.append(kind)
    return clouds, truth, kinds


@pytest.fixture(scope="module")
def serial(heap):
    return fa.assemble(heap[0], threads=1)


def members_of(kinds, kind):
    return [k for k, one in enumerate(kinds) if one == kind]


@pytest.fixture(scope="module")
def levelled(places):
    """Three scans of one room as their sensors, which know which way is up, saw it."""
    return [cloud for cloud, _ in places["room"]], [T for _, T in places["room"]]


# ----------------------------------------------------------------------------------------------------------- the answer


def test_each_scan_is_where_it_was(heap, serial):
    _, truth, kinds = heap
    assert serial.components == [members_of(kinds, "room"), members_of(kinds, "hall")]  # of four scans and of three
    for members in serial.components:
        check_truth(serial, truth, members)
        assert np.allclose(serial.poses[members[0]], np.eye(4), atol=1e-12)


def test_a_scan_that_came_twice_lies_on_itself(heap, serial):
    clouds, truth, kinds = heap
    ones = members_of(kinds, "room")
    sensors = [apply(truth[k], clouds[k])[:50] for k in ones]
    i, j = next((a, b) for a in range(4) for b in range(a) if np.allclose(sensors[a], sensors[b]))
    apart = inverse(truth[ones[i]]) @ truth[ones[j]]
    found = inverse(serial.poses[ones[i]]) @ serial.poses[ones[j]]
    assert np.linalg.norm(log_motion(inverse(apart) @ found)) < 0.002


def test_what_is_left_out_has_a_reason(heap, serial):
    _, _, kinds = heap
    (broken,), (ball,) = members_of(kinds, "broken"), members_of(kinds, "ball")
    assert set(serial.left_out) == {broken, ball}
    assert f"clouds[{broken}]" in serial.left_out[broken]
    assert "distinct" in serial.left_out[broken]
    assert serial.left_out[ball].startswith(("none of ", "no other scan looks like it"))
    assert serial.poses[broken] is serial.covariances[ball] is serial.poses[ball] is None


def test_the_rest_of_the_answer(heap, serial):
    _, truth, kinds = heap
    assert serial.tried == 28  # all pairs of the eight that can be read
    for i, j, result in serial.edges:
        assert kinds[i] == kinds[j]
        assert degrees(inverse(result.T_target_source) @ inverse(truth[i]) @ truth[j]) < 2
    first = [members[0] for members in serial.components]
    for members in serial.components:
        for k in members:
            C = serial.covariances[k]
            assert np.allclose(C, C.T)
            assert not C.any() if k in first else np.linalg.eigvalsh(C).min() > 0
    assert len(serial.models) == 2
    for members, model in zip(serial.components, serial.models, strict=True):
        assert set(model.attributes["scan"].tolist()) <= set(members)
        assert model.normals is not None
    assert json.loads(json.dumps(serial.to_dict()))["components"] == serial.components
    assert repr(serial).startswith("Assembly(7 of 9 scans in 2 components")


def test_processes_give_the_same_bits(levelled):
    clouds = [*levelled[0], np.ones((5, 3))]
    found = fa.assemble(clouds, executor=Processes(2), threads=1)
    assert found.components == [[0, 1, 2]]
    assert bits(found) == bits(fa.assemble(clouds, executor=Serial(1)))


# --------------------------------------------------------------------------------------------- places that look alike


@pytest.fixture(scope="module")
def twins():
    """Two scans of each of two rooms of one size, which differ by what stands in them."""
    size = np.array([6.0, 4.5, 2.7])
    shell = [Box(tuple(size / 2 + (size / 2 + 0.05) * side), tuple(np.where(side, 0.1, size + 0.2)))
             for side in np.vstack([np.eye(3), -np.eye(3)])]
    built_in = [Box((1.5, 2.2, 2.55), (0.4, 4.5, 0.3)), Box((0.4, 0.4, 1.35), (0.8, 0.8, 2.7), yaw=0.4),
                Box((5.6, 3.6, 1.1), (0.8, 1.8, 2.2)), Box((5.0, 0.5, 0.5), (1.6, 1.0, 1.0), yaw=0.2),
                Box((2.5, 4.2, 1.0), (1.4, 0.5, 2.0)), Cylinder((0.7, 2.6, 0), (0.7, 2.6, 2.7), 0.25)]
    built_in += [Sphere((4.3, 3.9, 0.5), 0.5), Box((0.3, 1.4, 1.6), (0.5, 0.9, 0.6), yaw=0.3)]
    desks = [Box((1.4, 3.6, 0.3), (0.6, 0.6, 0.6))]
    others = [Box((3.4, 0.6, 0.3), (0.6, 0.6, 0.6))]
    return [cloud for things in (desks, others) for cloud, _ in scans_of(Scene((*shell, *built_in, *things)), size, 2)]


def test_rooms_that_look_alike_are_told_apart_by_what_was_looked_through(twins):
    """Who does not know where the sensors stood takes them for one."""
    assert fa.assemble(twins, threads=1).components != [[0, 1], [2, 3]]
    assert fa.assemble(twins, sensor_at_origin=True, threads=1).components == [[0, 1], [2, 3]]


def test_a_viewpoint_says_where_the_sensor_stood(twins, any_motion):
    rng = np.random.default_rng(8)
    moved = []
    for cloud in twins:
        T = any_motion(rng, 4.0)
        moved.append(fa.PointCloud(apply(T, cloud), viewpoint=T))
    assert fa.assemble(moved, threads=1).components == [[0, 1], [2, 3]]


# -------------------------------------------------------------------------------------------------- what can be told it


def test_poses_with_sigma_say_where_the_world_is(levelled):
    clouds, truth = levelled
    rng = np.random.default_rng(5)
    poses = [T @ exp_twist(rng.normal(size=6) * np.r_[[np.radians(1)] * 3, [0.05] * 3]) for T in truth]
    found = fa.assemble(clouds, poses=poses, pose_sigma=(1.0, 0.05), threads=1)
    assert found.components == [[0, 1, 2]]
    check_truth(found, truth, [0, 1, 2])
    for T, P, C in zip(truth, found.poses, found.covariances, strict=True):
        x = log_motion(inverse(P) @ T)
        assert x @ np.linalg.solve(C, x) < 25  # 6 on average
        assert 0.015 < np.sqrt(np.trace(C[3:, 3:])) < 0.09  # the mean of three, each 0.087


@pytest.mark.parametrize("seed", [1, 2])
def test_places_alone_say_where_the_world_is(levelled, any_motion, seed):
    """As GPS gives them: no turn is known, and the places are, to 2 cm."""
    clouds, truth = levelled
    world = translation([400_000.0, 5_000_000.0, 100.0]) @ any_motion(np.random.default_rng(seed), 1.0)
    poses = [translation((world @ T)[:3, 3]) for T in truth]
    found = fa.assemble(clouds, poses=poses, pose_sigma=(180.0, 0.02), threads=1)
    assert found.components == [[0, 1, 2]]
    check_truth(found, truth, [0, 1, 2])
    for P, T in zip(poses, found.poses, strict=True):
        assert np.linalg.norm(P[:3, 3] - T[:3, 3]) < 0.02


def test_fixed_scans_do_not_move(levelled):
    clouds, truth = levelled
    found = fa.assemble(clouds, poses=[None, truth[1], None], fixed=[1], threads=1)
    assert np.allclose(found.poses[1], truth[1], rtol=0, atol=1e-12)
    assert not found.covariances[1].any()
    for T, P in zip(truth, found.poses, strict=True):
        assert np.allclose(T, P, atol=0.02)


def test_a_guess_that_is_none_does_no_harm(levelled, any_motion):
    clouds, truth = levelled
    rng = np.random.default_rng(4)
    poses = [any_motion(rng, 9.0) for _ in clouds]
    found = fa.assemble(clouds, poses=poses, threads=1)
    assert found.components == [[0, 1, 2]]
    check_truth(found, truth, [0, 1, 2])
    assert np.allclose(found.poses[0], poses[0], rtol=0, atol=1e-12)


def test_levelled_scans_stay_levelled(levelled):
    clouds, truth = levelled
    found = fa.assemble(clouds, dof="levelled", threads=1)
    assert found.components == [[0, 1, 2]]
    check_truth(found, truth, [0, 1, 2])
    for T in found.poses:
        assert np.allclose(T[2, :3], [0, 0, 1], rtol=0, atol=1e-14)
        assert np.allclose(T[:3, 2], [0, 0, 1], rtol=0, atol=1e-14)


def test_a_fixed_pose_of_what_only_shifts_is_kept(levelled):
    """What turns all scans alike is no matter of theirs."""
    clouds, truth = levelled
    clouds = [cloud @ T[:3, :3].T for cloud, T in zip(clouds, truth, strict=True)]
    world = exp_twist(np.array([0.0, 0, 1.0, 2, 3, 4]))
    found = fa.assemble(clouds, poses=[world, None, None], fixed=[0], dof="translation", threads=1)
    assert found.components == [[0, 1, 2]]
    assert np.allclose(found.poses[0], world, rtol=0, atol=1e-12)
    for k in (1, 2):
        expected = world @ translation(truth[k][:3, 3] - truth[0][:3, 3])
        assert np.allclose(found.poses[k], expected, atol=0.02)


def test_scans_in_order_are_assembled(levelled):
    clouds, truth = levelled
    found = fa.assemble(clouds, ordered=True, threads=1)
    check_truth(found, truth, [0, 1, 2])


def test_progress_is_told(levelled):
    told = []
    fa.assemble(levelled[0][:2], progress=lambda *one: told.append(one), threads=1)
    assert [one for one in told if one[0] == "reading"] == [("reading", k, 2) for k in range(3)]
    assert ("registering", 1, 1) in told
    assert all(0 <= finished <= of for _, finished, of in told)


# -------------------------------------------------------------------------------------------------------- interruptions


def keys_of(folder):
    return [json.loads(line[9:])["key"] for line in (folder / "record.jsonl").read_text().splitlines()[1:]]


def test_a_run_that_was_killed_goes_on(levelled, tmp_path, monkeypatch):
    clouds, _ = levelled
    expected, done = fa.assemble(clouds, threads=1), []

    def interrupts(stage, finished, of):
        if stage == "registering" and finished == 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        fa.assemble(clouds, run_folder=tmp_path / "run", progress=interrupts, threads=1)
    recorded = keys_of(tmp_path / "run")
    assert sum(key.startswith("pair") for key in recorded) == 2

    register = stages.register
    monkeypatch.setattr(stages, "register", lambda *args, **rest: done.append(1) or register(*args, **rest))
    found = fa.assemble(clouds, run_folder=tmp_path / "run", executor=Serial(1), threads=1)
    assert len(done) == 1  # of three pairs
    after = keys_of(tmp_path / "run")
    assert after[: len(recorded)] == recorded
    assert len(set(after)) == len(after)
    assert bits(found) == bits(expected)

    monkeypatch.setattr(stages, "register", pytest.fail)
    assert bits(fa.assemble(clouds, run_folder=tmp_path / "run", threads=1)) == bits(expected)
    assert keys_of(tmp_path / "run") == after
    for changed in ({"seed": 1}, {"dof": "levelled"}, {"ordered": True}):
        with pytest.raises(fa.RunError, match="holds a run of other inputs"):
            fa.assemble(clouds, run_folder=tmp_path / "run", threads=1, **changed)
    with pytest.raises(fa.RunError, match="scan 000002 was"):
        fa.assemble([*clouds[:2], clouds[0]], run_folder=tmp_path / "run", threads=1)


# --------------------------------------------------------------------------------------------------------------- errors


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"poses": [None]}, "poses must be one for each of the 3 clouds"),
        ({"poses": [np.eye(3), None, None]}, r"poses\[0\] must be a \(4, 4\) matrix"),
        ({"pose_sigma": (1, 1)}, "there are none"),
        ({"poses": [np.eye(4)] * 3, "pose_sigma": (0, 1)}, "pose_sigma"),
        ({"fixed": [0]}, "fixed must be indices of clouds whose pose is given, but holds 0"),
        ({"poses": [np.eye(4), None, None], "fixed": [1]}, "but holds 1"),
        ({"poses": [np.eye(4), None, None], "fixed": [-3]}, "but holds -3"),
        ({"dof": "yaw"}, "dof of an assembly must be levelled, planar or translation, but is 'yaw'"),
        ({"dof": fa.Dof("levelled", axis=(1, 0, 0))}, "dof of an assembly"),
        ({"seed": -1}, "seed"),
        ({"threads": 0}, "threads"),
        ({"executor": 0}, "executor must be"),
    ],
)
def test_arguments_that_do_not_go_together(levelled, changes, words):
    with pytest.raises(fa.ArgumentError, match=words):
        fa.assemble(levelled[0], **changes)


@pytest.mark.parametrize("sigma", [(1,), (1, 2, 3), 1.0, ("a", "b")])
def test_a_sigma_that_is_none(levelled, sigma):
    with pytest.raises(fa.ArgumentError, match="pose_sigma"):
        fa.assemble(levelled[0], poses=[np.eye(4)] * 3, pose_sigma=sigma)


@pytest.mark.parametrize("fixed", [[1.5], ["a"], 0])
def test_a_fixed_scan_that_is_none(levelled, fixed):
    with pytest.raises(fa.ArgumentError, match="fixed"):
        fa.assemble(levelled[0], poses=[np.eye(4)] * 3, fixed=fixed)


@pytest.mark.parametrize("count", [0, 1])
def test_one_cloud_is_too_few(levelled, count):
    with pytest.raises(fa.ArgumentError, match=f"clouds must be at least two, but are {count}"):
        fa.assemble(levelled[0][:count])


def test_nothing_but_broken_scans_is_an_answer():
    found = fa.assemble([np.ones((5, 3)), np.ones((5, 3)), "nowhere.ply"], threads=1)
    assert found.components == found.edges == list(found.models) == []
    assert sorted(found.left_out) == [0, 1, 2]
    assert "nowhere.ply does not exist" in found.left_out[2]
    assert found.poses == [None] * 3
