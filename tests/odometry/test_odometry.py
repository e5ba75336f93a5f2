"""Odometry: down a street that is known exactly, and through what goes wrong on the way."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

import fieldalign as fa
from fieldalign import Tracking

CYCLE, PERIOD = 25, 0.1  # scans after which the street is the same again, seconds between them


def run(drive, scans, edit=lambda k, points, times: (points, times), **kwargs):
    """The odometry after some scans, and by scan its pose and what was said of it."""
    odometry = fa.Odometry(**kwargs)
    told = {}
    for k in scans:
        scan = edit(k, *drive.scan(k))
        if scan is not None:
            told[k] = odometry.step(*scan), odometry.last
    return odometry, told


def reasons(told):
    return {result.reason for _, result in told.values()}


@pytest.fixture(scope="module")
def plain(drive):
    return run(drive, range(2 * CYCLE))


# ------------------------------------------------------------------------------------------------- the usual way


def test_the_drive_is_followed(drive, plain, off):
    _, told = plain
    errors = np.array([off(pose, drive.pose(k)) for k, (pose, _) in told.items()])
    assert errors[:, 0].max() < 0.03
    assert errors[:, 1].max() < 1.5e-3
    assert reasons(told) == {Tracking.FIRST, Tracking.TRACKED}


def test_each_scan_counts_as_what_it_is_seen_from_unless_deskewed(drive, plain):
    thick = run(drive, range(CYCLE), deskew=False)[0]
    sharp = run(drive, range(CYCLE))[0]
    spread = [np.median(drive.distance(o.map.points)) for o in (sharp, thick)]
    assert spread[0] < 0.01
    assert spread[1] > 2 * spread[0]


def test_the_map_has_points_and_normals(plain):
    cloud = plain[0].map
    assert len(cloud) > 300
    assert np.allclose(np.linalg.norm(cloud.normals, axis=1), 1)
    assert cloud.attributes["count"].min() >= 5


def test_the_trajectory_is_kept(plain, drive):
    odometry, told = plain
    stamps, poses = odometry.trajectory.times, odometry.trajectory.poses
    assert np.array_equal(odometry.trajectory.covariances[5], told[5][1].covariance)
    assert np.array_equal(poses, np.stack([pose for pose, _ in told.values()]))
    assert np.allclose(np.diff(stamps), PERIOD)
    middle = (drive.scan(0)[1].min() + drive.scan(0)[1].max()) / 2
    assert np.isclose(stamps[0], middle, atol=1e-9)


def test_what_is_said_of_a_step(plain):
    last = plain[0].last
    assert last.tracked
    assert str(last.reason).startswith("Tracked")
    assert last.agreement > 0.8
    assert last.points > 500
    assert last.iterations >= 1
    assert set(last.seconds) == {"thin", "align", "map"}
    assert last.unobservable.shape == (6, 0)
    assert last.freedoms == ()


def test_a_pose_at_a_stated_moment(drive, plain, off):
    odometry = fa.Odometry()
    for k in range(CYCLE):
        end = PERIOD * (k + 1)
        pose = odometry.step(*drive.scan(k), stamp=end)
        assert odometry.last.stamp == pytest.approx(end)
    truth = np.linalg.inv(drive.pose_at(PERIOD / 2)) @ drive.pose_at(PERIOD * CYCLE)
    assert off(pose, truth)[0] < 0.03


def test_times_may_be_counted_from_the_stamp_or_from_each_sweep(drive, plain):
    _, told = plain
    wanted = told[CYCLE - 1][0]
    for stamp in (True, False):
        odometry = fa.Odometry()
        for k in range(CYCLE):
            points, times = drive.scan(k)
            middle = (times.min() + times.max()) / 2
            pose = odometry.step(points, times - middle, stamp=middle + 1e6 if stamp else None)
        assert np.allclose(pose, wanted, atol=2e-3)


def test_without_times_scans_count(drive):
    _, told = run(drive, range(5), lambda k, points, times: (points, None))
    assert [result.stamp for _, result in told.values()] == [0, 1, 2, 3, 4]


def test_the_unit_does_not_matter(drive, plain):
    _, told = run(drive, range(CYCLE), lambda k, points, times: (1024 * points, times))
    for k, (pose, _) in told.items():
        wanted = plain[1][k][0].copy()
        wanted[:3, 3] *= 1024
        assert np.allclose(pose, wanted, atol=1e-3)


def test_the_same_bits_beside_other_work(drive, plain):
    with ThreadPoolExecutor(3) as pool:
        runs = list(pool.map(lambda _: run(drive, range(CYCLE))[0].trajectory.poses, range(3)))
    for poses in runs:
        assert np.array_equal(poses, plain[0].trajectory.poses[:CYCLE])


def test_clouds_arrays_and_float64_are_one(drive):
    points, times = drive.scan(0)
    one, other = fa.Odometry(), fa.Odometry()
    for k in range(3):
        points, times = drive.scan(k)
        a = one.step(points, times)
        b = other.step(fa.PointCloud(points.astype(float), times=times))
    assert np.array_equal(a, b)


def test_the_map_is_bounded_and_the_drive_without_end(drive, off):
    odometry = fa.Odometry()
    sizes = []
    for k in range(30 * CYCLE):
        pose = odometry.step(*drive.scan(k))
        if k % CYCLE == CYCLE - 1:
            sizes.append(len(odometry._tracker.map.fine))
    assert max(sizes[10:]) < 1.1 * max(sizes[4:8])
    assert off(pose, drive.pose(30 * CYCLE - 1))[0] < 0.01 * 8.0 * PERIOD * 30 * CYCLE


# ------------------------------------------------------------------------------------------------------ certainty


def test_errors_are_those_that_the_covariance_states(drive, plain):
    _, told = plain
    ratios = []
    for k in range(5, 2 * CYCLE):
        step = np.linalg.inv(told[k - 1][0]) @ told[k][0]
        truth = np.linalg.inv(drive.pose(k - 1)) @ drive.pose(k)
        error = np.linalg.inv(step) @ truth
        R = told[k][0][:3, :3]
        twist = np.r_[R @ axial(error[:3, :3]), R @ error[:3, 3]]
        covariance = told[k][1].covariance + told[k - 1][1].covariance
        ratios.append(twist @ np.linalg.solve(covariance, twist))
    assert 0.5 < np.median(ratios) < 12  # of chi-square with 6 degrees: 5.3


def axial(R):
    return np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]]) / 2


def test_a_covariance_is_one(plain):
    for _, result in plain[1].values():
        assert np.allclose(result.covariance, result.covariance.T)
        assert np.linalg.eigvalsh(result.covariance)[0] > -1e-15


def test_a_bare_tunnel_does_not_shrink_the_motion(dark):
    _, told = run(dark, range(64))
    late = [result for k, (_, result) in told.items() if k >= 50]
    assert all(result.reason is Tracking.DEGENERATE for result in late)
    assert not any(result.tracked for result in late)
    gone = told[63][0][0, 3]
    assert gone == pytest.approx(dark.pose(63)[0, 3], rel=0.03)
    assert np.abs(told[63][0][1:3, 3] - dark.pose(63)[1:3, 3]).max() < 0.03


def test_a_bare_tunnel_says_along_which_axis(dark):
    _, told = run(dark, range(64))
    last = told[63][1]
    (freedom,) = last.freedoms
    assert freedom.kind == "slide"
    assert abs(freedom.axis[0]) > 0.99
    spread = np.sqrt(np.diag(last.covariance)[3:])
    assert spread[0] > 10 * spread[1:].max()
    assert spread[0] > np.sqrt(told[52][1].covariance[3, 3])  # it grows while nothing is seen


# --------------------------------------------------------------------------------------------------------- faults


def nothing(points, times):
    return points[:0], times[:0]


def missing_returns(points, times):
    return np.full_like(points, np.nan), times


def zeros(points, times):
    return np.zeros_like(points), times


@pytest.mark.parametrize("spoil", [nothing, missing_returns, zeros])
def test_a_scan_without_points(drive, off, spoil):
    _, told = run(drive, range(40), lambda k, *scan: spoil(*scan) if k == 30 else scan)
    assert told[30][1].reason is Tracking.EMPTY
    assert off(told[30][0], drive.pose(30))[0] < 0.05  # the prediction
    assert told[30][1].covariance[3, 3] > told[29][1].covariance[3, 3]
    assert {told[k][1].reason for k in range(31, 40)} == {Tracking.TRACKED}
    assert off(told[39][0], drive.pose(39))[0] < 0.04


def test_scans_without_points_at_first(drive, off):
    _, told = run(drive, range(30), lambda k, *scan: nothing(*scan) if k < 2 else scan)
    assert [told[k][1].reason for k in range(4)] == [Tracking.EMPTY, Tracking.EMPTY, Tracking.FIRST, Tracking.TRACKED]
    pose = np.linalg.inv(drive.pose(2)) @ drive.pose(29)
    assert off(told[29][0], pose)[0] < 0.03


@pytest.mark.parametrize("stamped", [False, True])
def test_a_scan_that_is_missing(drive, off, stamped):
    odometry = fa.Odometry()
    for k in range(40):
        scan = (None, None) if k in (0, 30) else drive.scan(k)
        pose = odometry.step(*scan, stamp=PERIOD * k if stamped else None)
    said = [result.reason for result in odometry.results]
    assert [said[k] for k in (0, 1, 30)] == [Tracking.MISSING, Tracking.FIRST, Tracking.MISSING]
    assert set(said[2:30] + said[31:]) == {Tracking.TRACKED}
    result, before = odometry.results[30], odometry.results[29]
    assert not result.tracked
    assert result.covariance[3, 3] > before.covariance[3, 3]
    truth = [drive.pose_at(PERIOD * (k if stamped else k + 0.5)) for k in (30, 39)]
    world = np.linalg.inv(drive.pose_at(1.5 * PERIOD))  # the middle of the first scan
    assert off(result.pose, world @ truth[0])[0] < 0.06  # the prediction
    assert off(pose, world @ truth[1])[0] < 0.06
    assert len(odometry.trajectory) == 40


def test_a_drive_without_any_scan():
    odometry = fa.Odometry()
    for stamp in (5.0, 5.1):
        assert np.array_equal(odometry.step(None, None, stamp), np.eye(4))
    assert odometry.last.reason is Tracking.MISSING
    assert odometry.last.stamp == pytest.approx(5.1)
    assert odometry.trajectory.covariances.shape == (2, 6, 6)


def sector(points, times):
    angle = np.arctan2(points[:, 1], points[:, 0])
    kept = (angle > 0.2) & (angle < 0.2 + 0.2 * np.pi)
    return points[kept], times[kept]


def test_nine_tenths_of_a_scan_missing(drive, off):
    _, told = run(drive, range(40), lambda k, *scan: sector(*scan) if k == 30 else scan)
    assert told[30][1].reason in (Tracking.SPARSE, Tracking.DEGENERATE)
    assert off(told[30][0], drive.pose(30))[0] < 0.2
    assert off(told[39][0], drive.pose(39))[0] < 0.04


def test_nine_tenths_of_the_first_scan_missing(drive, off):
    _, told = run(drive, range(30), lambda k, *scan: sector(*scan) if k == 0 else scan)
    assert told[1][1].reason is Tracking.RESTARTED
    assert off(np.linalg.inv(told[1][0]) @ told[29][0], np.linalg.inv(drive.pose(1)) @ drive.pose(29))[0] < 0.04


@pytest.mark.parametrize("scans", [1, 5, 20])
@pytest.mark.parametrize("has_times", [True, False])
def test_a_gap(drive, off, scans, has_times):
    def gap(k, points, times):
        return None if 30 <= k < 30 + scans else (points, times if has_times else None)

    _, told = run(drive, range(60), gap)
    if has_times:
        assert told[30 + scans][1].reason is Tracking.GAP
    assert off(told[59][0], drive.pose(59))[0] < (0.05 if has_times else 0.5)


@pytest.mark.parametrize("jump", [-100.0, -1.0, 3.0, 1000.0])
def test_a_clock_that_jumps(drive, off, jump):
    odometry, told = run(drive, range(40), lambda k, points, times: (points, times + jump * (k >= 30)))
    assert told[30][1].reason is Tracking.CLOCK_JUMPED
    assert {told[k][1].reason for k in range(31, 40)} == {Tracking.TRACKED}
    assert off(told[39][0], drive.pose(39))[0] < 0.04
    assert (np.diff(odometry.trajectory.times) > 0).all()


def test_a_standstill(drive):
    points, _ = drive.scan(0)
    rng = np.random.default_rng(0)
    odometry = fa.Odometry()
    for k in range(30):
        noisy = points + rng.normal(0, 0.005, points.shape)
        pose = odometry.step(noisy, stamp=PERIOD * k)
        if k > 5:
            assert odometry.last.reason is Tracking.STANDSTILL
    assert np.abs(pose - np.eye(4)).max() < 5e-3


def test_scans_of_another_place_are_lost_and_then_a_beginning(drive):
    rng = np.random.default_rng(1)
    clutter = [rng.uniform(-15, 15, (12_000, 3)) for _ in range(8)]
    _, told = run(drive, range(30), lambda k, *scan: (clutter[k - 20], None) if 20 <= k < 28 else scan)
    assert told[20][1].reason is Tracking.LOST
    assert Tracking.RESTARTED in reasons(told)
    assert np.isfinite(told[29][0]).all()


# ------------------------------------------------------------------------------------------------------ arguments


def test_wrong_arguments_raise():
    odometry = fa.Odometry()
    with pytest.raises(fa.ArgumentError, match=r"cloud must have shape \(N, 3\)"):
        odometry.step(np.zeros((5, 2)))
    with pytest.raises(fa.ArgumentError, match=r"times must have shape \(5,\)"):
        odometry.step(np.ones((5, 3)), np.zeros(4))
    with pytest.raises(fa.ArgumentError, match="times must be finite"):
        odometry.step(np.ones((2, 3)), np.array([0, np.nan]))
    with pytest.raises(fa.ArgumentError, match="settings must be"):
        fa.Odometry("outdoor")
    with pytest.raises(fa.ArgumentError, match="voxel must be a positive number"):
        fa.OdometrySettings(voxel=-1.0)
    assert odometry.last is None
    assert len(odometry.map) == 0
