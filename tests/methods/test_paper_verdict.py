"""What the paper's method says of a pose, against closed forms and finite differences."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.spatial import cKDTree
from scipy.spatial.transform import RigidTransform

import fieldalign as fa
from fieldalign.alignment import Alignment, Step
from fieldalign.dof import Dof
from fieldalign.fields import FieldSample, sampled
from fieldalign.methods.paper_verdict import COARSE, MIN_OVERLAP, STILL, certainty, judge, overlaps, rmse
from fieldalign.motions import apply, exp_twist, inverse, translation
from fieldalign.prepare import prepare


class Spheres:
    """The signed field of some spheres: smooth but where two of them are equally near."""

    signed = True

    def __init__(self, centres, radius):
        self.centres, self.radius = np.array(centres, float), radius

    @property
    def bounds(self):
        return np.array([self.centres.min(axis=0) - self.radius, self.centres.max(axis=0) + self.radius])

    def sample(self, x):
        away = x[:, None] - self.centres
        length = np.linalg.norm(away, axis=2)
        rows, nearest = np.arange(len(x)), length.argmin(axis=1)
        normal = away[rows, nearest] / length[rows, nearest, None]
        value = length[rows, nearest] - self.radius
        return value, normal, x - value[:, None] * normal, normal


class Plane:
    """The signed field of the plane z = 0, of which a square is the surface."""

    signed = True
    bounds = np.array([[0.0, 0, 0], [2, 1, 0]])

    def sample(self, x):
        up = np.tile([0.0, 0, 1], (len(x), 1))
        return x[:, 2], up, x * [1, 1, 0], up


def alignment(T=None, steps=None, kept=None, strict=True, weights=None, n=1):
    step = Step(np.zeros(6), 0.0, n)
    return Alignment(
        T_target_source=np.eye(4) if T is None else T,
        steps=(step,) if steps is None else steps,
        at_source=None,
        kept=np.ones(n, bool) if kept is None else kept,
        strict=strict,
        weights=np.ones(n) if weights is None else weights,
    )


# --------------------------------------------------------------------------------------------------------------- judge


@pytest.mark.parametrize(
    ("increment", "small"),
    [
        ([0, 0, 0, 0, 0, 0], True),
        ([0, 0, 0, 0.9, 0, 0], True),
        ([0, 0, 0, 0, -1.1, 0], False),
        ([0, 0, 0.9 * 2, 0, 0, 0], True),  # at half the extent from the centre
        ([0, -1.1 * 2, 0, 0, 0, 0], False),
        ([0, 0.6 * 2, 0, 0.6, 0, 0], False),  # both together
    ],
)
@pytest.mark.parametrize("extent", [0.01, 1.0, 5000.0])
def test_the_last_step_must_move_no_point_far(increment, small, extent):
    w, v = STILL * np.array(increment[:3], float), STILL * extent * np.array(increment[3:], float)
    last = Step(np.r_[w, v], 0.0, 100)
    wild = Step(np.ones(6), 0.0, 100)
    reason = judge(alignment(steps=(wild, last)), SimpleNamespace(extent=extent), (0.9, 0.9))
    assert reason is (fa.Reason.ACCEPTED if small else fa.Reason.NOT_CONVERGED)


def test_relaxed_rules_are_low_overlap_whatever_the_step():
    for increment in (np.zeros(6), np.ones(6)):
        step = Step(increment, 0.0, 10)
        reason = judge(alignment(steps=(step,), strict=False), SimpleNamespace(extent=1.0), (0.9, 0.9))
        assert reason is fa.Reason.LOW_OVERLAP


@pytest.mark.parametrize(("more", "less", "enough"), [(-0.01, -0.1, False), (0.01, -0.2, True), (0.01, 0.5, True)])
def test_a_detail_may_lie_on_a_whole_but_one_of_both_must_agree(more, less, enough):
    last = Step(np.zeros(6), 0.0, 100)
    overlap = np.maximum(MIN_OVERLAP + np.array([more, less]), 0)
    for either in (tuple(overlap), tuple(overlap[::-1])):
        reason = judge(alignment(steps=(last,)), SimpleNamespace(extent=1.0), either)
        assert reason is (fa.Reason.ACCEPTED if enough else fa.Reason.LOW_OVERLAP)


# ------------------------------------------------------------------------------------------------------------- overlap


@pytest.fixture
def sheet():
    """A level sheet of 2 x 1, a point every 2 cm."""
    u, v = np.meshgrid(np.arange(0, 2, 0.02), np.arange(0, 1, 0.02))
    return np.c_[u.ravel(), v.ravel(), np.zeros(u.size)]


def test_a_cloud_overlaps_itself_wholly(sheet):
    assert overlaps(prepare(sheet), prepare(sheet), np.eye(4)) == (1, 1)


@pytest.mark.parametrize("shift", [0.5, 1.0, 1.5])
def test_shifted_sheets_share_what_is_left(sheet, shift):
    """200 places are asked: a share of 1/2 has a deviation of 0.035."""
    shares = overlaps(prepare(sheet), prepare(sheet), translation([shift, 0, 0]))
    assert shares == pytest.approx([1 - shift / 2] * 2, abs=0.12)


def test_a_part_is_wholly_in_the_whole_and_not_the_reverse(sheet):
    part = sheet[sheet[:, 0] < 0.6]
    of_part, of_whole = overlaps(prepare(part), prepare(sheet), np.eye(4))
    assert of_part == 1
    assert of_whole == pytest.approx(0.3, abs=0.12)
    assert overlaps(prepare(sheet), prepare(part), np.eye(4)) == (of_whole, of_part)


def test_sheets_one_above_the_other_share_nothing(sheet):
    assert overlaps(prepare(sheet), prepare(sheet), translation([0, 0, 0.2])) == (0, 0)


def test_overlap_follows_its_definition(corner, motion, rng):
    """Within three point distances of both clouds together; against SciPy, for any pose."""
    T = motion(rng, 4, 0.1)
    one, other = corner[corner[:, 0] < 2], corner[corner[:, 1] > 0.5]
    source, target = prepare(one), prepare(other)
    near = source.probes[1] + target.probes[1]
    forth = (cKDTree(other).query(apply(T, source.probes[0]))[0] <= near).mean()
    back = (cKDTree(one).query(apply(inverse(T), target.probes[0]))[0] <= near).mean()
    assert overlaps(source, target, T) == (forth, back)
    assert 0 < forth < 1
    assert 0 < back < 1


def test_fields_without_points_are_asked_to_a_thousandth_of_their_size():
    plane = prepare(Plane())
    size = np.sqrt(5)
    assert overlaps(plane, plane, translation([0, 0, 0.9e-3 * size])) == (1, 1)
    assert overlaps(plane, plane, translation([0, 0, -0.9e-3 * size])) == (1, 1)  # on either side
    assert overlaps(plane, plane, translation([0, 0, 1.1e-3 * size])) == (0, 0)


# ---------------------------------------------------------------------------------------------------------------- rmse


def distances(values):
    none = np.zeros((len(values), 3))
    return FieldSample(np.array(values, float), none, none, none)


def test_the_thresholds_are_those_that_are_told():
    assert (STILL, COARSE, MIN_OVERLAP) == (1e-3, 0.05, 0.2)


def test_rmse_is_of_the_kept_distances_and_takes_no_side():
    source, target = distances([1, -2, 3, 100]), distances([2, 2, -1, 0])
    kept = np.array([True, True, True, False])
    assert rmse(source, target, alignment(kept=kept, n=4)) == pytest.approx(np.sqrt((1 + 0 + 4) / 3))


# ----------------------------------------------------------------------------------------------------------- certainty


def known(field, T, pseudo, r, weights=None, kept=None):
    n = len(pseudo)
    found = alignment(T=T, kept=kept, weights=weights, n=n)
    return certainty(sampled(field, apply(inverse(T), pseudo)), pseudo, found, r, None, None)


@pytest.fixture
def pose(motion, rng):
    return motion(rng, 50, 4.0)


@pytest.fixture
def pseudo(pose, rng):
    """Around the unit cube of the source, in the target's frame."""
    return apply(pose, rng.uniform(-1, 2, (400, 3)))


THREE = Spheres([[0, 0, 0], [1, 0, 0.2], [0.1, 1, 0.5]], 0.3)


def test_information_is_that_of_a_left_perturbation_about_the_reference_point(pose, pseudo, rng):
    weights, kept, r = rng.uniform(0.5, 2, 400), rng.random(400) < 0.7, rng.normal(0, 0.01, 400)
    what = known(THREE, pose, pseudo, r, weights, kept)
    assert np.allclose(what.reference_point, pseudo[kept].mean(axis=0), atol=1e-12)

    def residuals(twist):
        about = translation(what.reference_point) @ exp_twist(twist) @ translation(-what.reference_point)
        value = THREE.sample(apply(inverse(about @ pose), pseudo[kept]))[0]
        return value**2

    h = 1e-6
    J = np.stack([(residuals(h * e) - residuals(-h * e)) / (2 * h) for e in np.eye(6)], axis=1)
    w = weights[kept]
    variance = (w * r[kept] ** 2).sum() / (kept.sum() - 6)
    expected = (J * w[:, None]).T @ J / variance
    assert np.allclose(what.information, expected, rtol=1e-5, atol=1e-6 * np.abs(expected).max())


def test_where_all_is_seen_the_covariance_is_the_inverse(pose, pseudo, rng):
    what = known(THREE, pose, pseudo, rng.normal(0, 0.01, 400))
    assert what.unobservable.shape == (6, 0)
    assert np.allclose(what.covariance @ what.information, np.eye(6), atol=1e-9)
    assert np.allclose(what.information, what.information.T, rtol=1e-12)
    assert np.linalg.eigvalsh(what.information).min() > 0
    assert np.linalg.eigvalsh(what.covariance).min() > 0


def test_noise_twice_as_large_is_a_fourth_of_the_information(pose, pseudo, rng):
    r = rng.normal(0, 0.01, 400)
    one, two = known(THREE, pose, pseudo, r), known(THREE, pose, pseudo, 2 * r)
    assert np.allclose(one.information, 4 * two.information)
    assert np.allclose(4 * one.covariance, two.covariance)


def test_the_scale_of_the_weights_does_not_matter(pose, pseudo, rng):
    r = rng.normal(0, 0.01, 400)
    one, other = (known(THREE, pose, pseudo, r, np.full(400, w)) for w in (1.0, 50.0))
    assert np.allclose(one.information, other.information)


def test_residuals_of_zero_are_no_certainty_without_end(pose, pseudo):
    what = known(THREE, pose, pseudo, np.zeros(400))
    assert np.isfinite(what.information).all()
    assert np.isfinite(what.covariance).all()
    assert 0 < np.trace(what.covariance) < 1e-12


@pytest.mark.parametrize("weight", [1.0, 7.0])
def test_residuals_of_zero_are_taken_for_the_resolution_of_the_largest_squared_distance(pose, pseudo, rng, weight):
    r, weights = rng.normal(0, 0.01, 400), np.full(400, weight)
    curvature = known(THREE, pose, pseudo, r, weights).information * weight * (r**2).sum() / (400 - 6)
    largest = THREE.sample(apply(inverse(pose), pseudo))[0].max() ** 2
    exact = known(THREE, pose, pseudo, np.zeros(400), weights).information
    assert np.allclose(exact, curvature / (weight * (1e-12 * largest) ** 2), rtol=1e-9)


def test_what_a_dof_locks_is_neither_known_nor_open(pose, pseudo, rng):
    """Free is a turn about a line, counted from a guess: seen from the reference, it is a turn and a shift."""
    centre, axis = np.array([1.0, 2, 3]), np.array([0.0, 0, 1])
    guess = translation(centre) @ exp_twist(np.r_[0.3 * axis, 0, 0, 0]) @ translation(-centre) @ pose
    found = alignment(T=pose, n=400)
    r = rng.normal(0, 0.01, 400)
    what = certainty(sampled(THREE, apply(inverse(pose), pseudo)), pseudo, found, r, Dof("yaw", centre=centre), guess)
    assert what.unobservable.shape == (6, 0)
    assert what.observable.shape == (6, 1)
    expected = np.r_[axis, np.cross(axis, what.reference_point - centre)]
    assert np.allclose(what.observable[:, 0] / what.observable[2, 0], expected, atol=1e-9)
    all_free = certainty(sampled(THREE, apply(inverse(pose), pseudo)), pseudo, found, r, None, None)
    assert what.covariance[2, 2] == pytest.approx(1 / (expected @ all_free.information @ expected))


def is_generalised_inverse(C, information):
    scale = np.abs(information).max()
    size = np.abs(C).max()
    return np.allclose(information @ C @ information, information, atol=1e-6 * scale) and np.allclose(
        C @ information @ C, C, atol=1e-6 * size)


def test_a_plane_slides_and_spins(same_span, rng):
    pseudo = np.c_[rng.uniform(0, 2, 300), rng.uniform(0, 1, 300), rng.normal(0, 0.3, 300)]
    what = known(Plane(), np.eye(4), pseudo, rng.normal(0, 0.01, 300))
    free = np.zeros((6, 3))
    free[2, 0] = free[3, 1] = free[4, 2] = 1  # about z, along x, along y
    assert what.unobservable.shape == (6, 3)
    assert same_span(what.unobservable, free)
    assert np.allclose(what.information[[2, 3, 4]], 0, atol=1e-9 * np.abs(what.information).max())
    assert np.linalg.matrix_rank(what.information, tol=1e-6 * np.abs(what.information).max()) == 3
    assert np.allclose(what.covariance, np.linalg.pinv(what.information, rcond=1e-9), rtol=1e-6, atol=1e-15)


def test_a_tilted_plane_slides_along_itself(same_span, pose, rng):
    flat = np.c_[rng.uniform(0, 2, 300), rng.uniform(0, 1, 300), rng.normal(0, 0.3, 300)]
    pseudo = apply(pose, flat)
    what = known(Plane(), pose, pseudo, rng.normal(0, 0.01, 300))
    R = pose[:3, :3]
    free = np.zeros((6, 3))
    free[:3, 0], free[3:, 1], free[3:, 2] = R[:, 2], R[:, 0], R[:, 1]
    assert same_span(what.unobservable, free)


@pytest.mark.parametrize("far", [0.0, 3.0])
def test_a_sphere_turns_about_its_centre(same_span, pose, rng, far):
    """Seen from a point beside the centre, such a turn is a turn and a shift: v = w x (reference - centre)."""
    one = Spheres([[0.5, 0.2, -0.1]], 0.4)
    centre = apply(pose, one.centres)[0]
    pseudo = centre + rng.normal(size=(300, 3)) * [1, 0.5, 0.5] + [far, 0, 0]
    what = known(one, pose, pseudo, rng.normal(0, 0.01, 300))
    lever = what.reference_point - centre
    free = np.vstack([np.eye(3), np.stack([np.cross(w, lever) for w in np.eye(3)], axis=1)])
    assert what.unobservable.shape == (6, 3)
    assert same_span(what.unobservable, free)
    assert np.abs(what.information @ free).max() < 1e-6 * np.abs(what.information).max()
    assert is_generalised_inverse(what.covariance, what.information)


@pytest.mark.parametrize(("name", "free"), [("plane", 3), ("sphere", 3), ("three", 0)])
@pytest.mark.parametrize("unit", [1.0, 1000.0])
def test_the_parts_fit_together_in_any_unit(name, free, pose, pseudo, rng, unit):
    field = {
        "plane": Plane(),
        "sphere": Spheres([[0.5 * unit] * 3], 0.4 * unit),
        "three": Spheres(unit * THREE.centres, unit * THREE.radius),
    }[name]
    pose[:3, 3] *= unit
    what = known(field, pose, unit * pseudo, unit**2 * rng.normal(0, 0.01, 400))
    assert what.unobservable.shape == (6, free)
    assert np.allclose(what.unobservable.T @ what.unobservable, np.eye(free), atol=1e-12)
    # Turns and shifts are of one size where lengths are counted in units.
    lever = np.array([1, 1, 1, unit, unit, unit])
    information = what.information * np.outer(lever, lever)
    covariance = what.covariance / np.outer(lever, lever)
    for matrix in (information, covariance):
        values = np.linalg.eigvalsh(matrix)
        assert np.allclose(matrix, matrix.T, rtol=0, atol=1e-12 * values[-1])
        assert values[0] > -1e-9 * values[-1]
        assert (values > 1e-7 * values[-1]).sum() == 6 - free
    assert is_generalised_inverse(covariance, information)


def test_registering_a_plane_says_that_it_slides(same_span, register, rng):
    plane = np.c_[rng.uniform(0, 3, (3000, 2)), np.zeros(3000)]
    result = register(plane, plane)
    free = np.zeros((6, 3))
    free[2, 0] = free[3, 1] = free[4, 2] = 1
    # Pseudo points stand straight above points: no gradient of a copy has a part along the plane.
    assert same_span(result.unobservable, free)
    assert np.abs(result.information @ free).max() < 1e-6 * np.abs(result.information).max()


def test_registering_says_where_its_information_holds(register, corner, motion, rng):
    T = motion(rng, 20, 0.3)
    far = translation([50, -20, 10])
    here = register(corner, apply(T, corner))
    there = register(apply(far, corner), apply(T, corner), init=T @ inverse(far))
    moved = register(corner, apply(far @ T, corner), init=far @ T)
    for result, shift in ((here, 0), (there, 0), (moved, far[:3, 3])):
        low, high = apply(T, corner).min(axis=0), apply(T, corner).max(axis=0)
        assert (low - 0.2 < result.reference_point - shift).all()
        assert (result.reference_point - shift < high + 0.2).all()
    assert RigidTransform.from_matrix(there.T_target_source @ far @ inverse(T)).as_exp_coords() == pytest.approx(
        np.zeros(6), abs=1e-9)
