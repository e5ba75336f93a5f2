"""Where the world lies changes nothing but the last digits, as float64 sets them.

A coordinate of size c is known to c ε / 2, with ε = 2^-52; a pose maps places of size a to places of size b by three
products and a shift, so |T x| is known to a few ε (a + b), whoever computes it: 2e-9 m at UTM size, 4e-8 m at 1e8 m.
That is the bound here, with 4 for a few. The clouds lie on a lattice of 2^-20 m, so that moving them rounds nothing.
"""

import sys
from pathlib import Path

import numpy as np
import pytest

import fieldalign as fa
from fieldalign.motions import apply, exp_twist, inverse, translation

FEW = 4
FAR = [3e3, 5e6, 1e8]  # metres: a site, UTM, an astronaut's


@pytest.fixture(scope="module")
def everything():
    sys.path.insert(0, str(Path(__file__).parent))
    import everything

    yield everything
    sys.path.remove(str(Path(__file__).parent))


def on_lattice(points):
    return np.round(points * 2**20) / 2**20


@pytest.fixture(scope="module")
def scans(everything):
    return [on_lattice(scan) for scan in everything.scans()]


@pytest.fixture(params=FAR, ids="{:.0e} m".format)
def there(request):
    """Where the source and the target are moved to, (3,) each, and by what their places may then differ."""
    source = np.round(request.param * np.array([1, -0.7, 0.3]))
    target = -source[::-1]
    return source, target, bound(source, target)


def bound(*places):
    return FEW * np.finfo(float).eps * sum(np.abs(place).max() + 10 for place in places)


REGISTERED = {"robust": {}, "robust, levelled": {"dof": "levelled"}, "paper": {"method": "paper"}}


@pytest.mark.parametrize("options", REGISTERED.values(), ids=REGISTERED)
def test_a_pair_anywhere(scans, there, options):
    source, target, allowed = there
    here = fa.register(scans[2], scans[0], init=np.eye(4), **options)
    init = translation(target) @ translation(-source)
    if "dof" in options:
        options = {"dof": fa.Dof(options["dof"], centre=target)}
    moved = fa.register(scans[2] + source, scans[0] + target, init=init, **options)
    found = apply(moved.T_target_source, scans[2] + source) - target
    assert np.abs(found - apply(here.T_target_source, scans[2])).max() < allowed
    assert moved.reason is here.reason


@pytest.mark.parametrize("dof", [None, "levelled"])
def test_a_pair_anywhere_from_any_pose(scans, there, dof):
    """Nobody has to say that a levelled pair is far apart."""
    source, target, allowed = there
    here = fa.register(scans[2], scans[0], dof=dof)
    moved = fa.register(scans[2] + source, scans[0] + target, dof=dof)
    found = apply(moved.T_target_source, scans[2] + source) - target
    assert np.abs(found - apply(here.T_target_source, scans[2])).max() < allowed
    assert (moved.accepted, moved.overlap) == (here.accepted, here.overlap)


def test_a_pair_in_the_plane_anywhere(scans, there):
    """As far as the last level goes on: walls of columns are full of ties, which rounding breaks in the search."""
    source, target = (place[:2] for place in there[:2])
    one, other = (scan[np.abs(scan[:, 2]) < 0.3][:, :2] for scan in scans[:2])
    here, moved = fa.register(one, other), fa.register(one + source, other + target)
    found = [T[:2, :2] @ (one + place).T + T[:2, 2:] for T, place in
             ((here.T_target_source, 0), (moved.T_target_source, source))]
    assert np.abs(found[1] - target[:, None] - found[0]).max() < 1e-5
    assert moved.reason is here.reason


def test_a_verdict_anywhere(scans, there):
    """The information is of residuals, some millimetres, which lose what places lose."""
    source, target, allowed = there
    T = exp_twist(np.array([0, 0, 0.16, 0.3, 0, 0]))
    here = fa.verify(scans[2], scans[0], T)
    moved = fa.verify(scans[2] + source, scans[0] + target, translation(target) @ T @ translation(-source))
    assert (moved.reason, moved.overlap) == (here.reason, here.overlap)
    assert np.abs(moved.reference_point - target - here.reference_point).max() < allowed
    assert np.abs(moved.information / here.information.max() - here.information / here.information.max()).max() < (
        allowed / 1e-3)


def test_an_assembly_anywhere(scans, there):
    """Each scan in a world of its own, and the first one's for all."""
    source, target, _ = there
    places = [source, target, (target - source)[::-1]]
    here = fa.assemble(scans[:3])
    moved = fa.assemble([scan + place for scan, place in zip(scans[:3], places, strict=True)])
    assert moved.components == here.components == [[0, 1, 2]]
    for scan, place, T, before in zip(scans[:3], places, moved.poses, here.poses, strict=True):
        found = apply(T, scan + place) - source
        assert np.abs(found - apply(before, scan)).max() < bound(place, source)
    assert np.abs(moved.models[0].points - source - here.models[0].points).max() < 2 * bound(*places)
    for (i, j, result), (_, _, before) in zip(moved.edges, here.edges, strict=True):
        found = apply(result.T_target_source, scans[j] + places[j]) - places[i]
        assert np.abs(found - apply(before.T_target_source, scans[j])).max() < bound(places[i], places[j])
        assert np.abs(result.reference_point - places[i] - before.reference_point).max() < bound(places[i], places[j])


def test_an_assembly_in_a_world_that_is_given(scans, there):
    """Scans in map coordinates already, and known to lie well: they stay, and say how well where they are."""
    source, _, _ = there
    placed = [translation(source) @ inverse(T) for T in (np.eye(4), exp_twist(np.array([0, 0, -0.08, -0.15, 0, 0])))]
    clouds = [on_lattice(apply(T, scan)) for T, scan in zip(placed, scans[:2], strict=True)]
    found = fa.assemble(clouds, poses=[np.eye(4)] * 2, pose_sigma=(0.5, 0.02))
    for cloud, T, C in zip(clouds, found.poses, found.covariances, strict=True):
        assert np.abs(apply(T, cloud) - cloud).max() < 0.03
        at_scan = seen_from(source) @ C @ seen_from(source).T
        assert np.sqrt(np.trace(at_scan[3:, 3:])) < 0.05
    fixed = fa.assemble(clouds, poses=[np.eye(4)] * 2, fixed=[1])
    assert np.array_equal(fixed.poses[1], np.eye(4))


def seen_from(place):
    """(6, 6), makes twists about a place (3,) of those about the origin."""
    Ad = np.eye(6)
    Ad[3:, :3] = np.cross(place, np.eye(3))
    return Ad


def test_planar_scans_keep_their_heights(scans):
    far = np.array([5e6, 4e5, 7e4])
    here = fa.assemble(scans[:3], dof="planar")
    moved = fa.assemble([scan + far for scan in scans[:3]], dof="planar")
    for scan, T, before in zip(scans[:3], moved.poses, here.poses, strict=True):
        assert T[2, 3] == 0
        assert np.abs(apply(T, scan + far) - far - apply(before, scan)).max() < 2 * bound(far)


def test_a_map_anywhere(scans, there):
    """The lattice of its voxels begins elsewhere, and so planes differ by the noise's millimetres."""
    place = there[0]
    model = fa.assemble(scans[:3]).models[0].points
    here, moved = fa.Localizer(model), fa.Localizer(on_lattice(model) + place)
    for scan in scans[1:4]:
        before, after = here.step(scan), moved.step(scan)
        assert moved.last.reason is here.last.reason
        assert np.abs(apply(after, scan) - place - apply(before, scan)).max() < 5e-3


def test_thinned_anywhere(scans, there):
    place, _, allowed = there
    here, moved = fa.thin(scans[0], 0.1).points, fa.thin(scans[0] + place, 0.1).points
    assert np.abs(moved - place - here).max() < allowed


@pytest.mark.parametrize("kind", ["points", "mesh", "volume"])
def test_fields_and_deviations_anywhere(everything, scans, there, kind, rng):
    place, _, allowed = there
    x = on_lattice(rng.uniform(0.1, 1.6, (500, 3)))
    if kind == "points":
        here, moved = fa.fields.PointField(scans[0]), fa.fields.PointField(scans[0] + place)
    elif kind == "mesh":
        pytest.importorskip("igl")
        corners, faces = on_lattice(everything.CORNERS), everything.TRIANGLES
        here, moved = fa.fields.MeshField(corners, faces), fa.fields.MeshField(corners + place, faces)
    else:
        values = rng.normal(size=(8, 8, 8))
        here, moved = fa.fields.VolumeField(values, [0, 0, 0], 0.25), fa.fields.VolumeField(values, place, 0.25)
    before, after = here.sample(x), moved.sample(x + place)
    assert np.abs(after.value - before.value).max() < allowed
    assert np.abs(after.foot - place - before.foot).max() < allowed
    one, other = fa.deviation(x, here), fa.deviation(x + place, moved)
    assert np.abs(other.values - one.values).max() < allowed


# ------------------------------------------------------------------------------------------------------------ the unit


@pytest.mark.parametrize("unit", [1e3, 1e-3], ids=["millimetres", "kilometres"])
def test_no_unit_has_to_be_said_of_an_assembly(scans, unit):
    """The poses that the last level starts from differ by the rounding of a float32, as those of a pair."""
    here, moved = fa.assemble(scans[:3]), fa.assemble([unit * scan for scan in scans[:3]])
    for scan, T, before in zip(scans[:3], moved.poses, here.poses, strict=True):
        assert np.abs(apply(T, unit * scan) / unit - apply(before, scan)).max() < 1e-5


@pytest.mark.parametrize("unit", [1e3, 1e-3], ids=["millimetres", "kilometres"])
def test_no_unit_has_to_be_said_of_a_verdict_nor_of_deviations(scans, unit):
    T = exp_twist(np.array([0, 0, 0.16, 0.3, 0, 0]))
    scaled = T.copy()
    scaled[:3, 3] *= unit
    here, moved = fa.verify(scans[2], scans[0], T), fa.verify(unit * scans[2], unit * scans[0], scaled)
    assert moved.reason is here.reason
    assert moved.overlap == pytest.approx(here.overlap, abs=0.002)
    deviations = fa.deviation(unit * scans[1], unit * scans[0]).values / unit
    assert np.abs(deviations - fa.deviation(scans[1], scans[0]).values).max() < 100 * np.finfo(float).eps


# ------------------------------------------------------------------------------------------- what cannot be had is said


def readers(lost, good):
    """Whatever takes a cloud."""
    return {
        "register": lambda: fa.register(lost, good), "verify": lambda: fa.verify(good, lost, np.eye(4)),
        "assemble": lambda: fa.assemble([lost, lost]), "prepare": lambda: fa.prepare(lost),
        "thin": lambda: fa.thin(lost, 1.0), "deviation": lambda: fa.deviation(lost, good),
        "field": lambda: fa.fields.PointField(lost), "map": lambda: fa.Localizer(lost),
    }


@pytest.mark.parametrize("name", readers(None, None))
def test_single_precision_that_has_lost_the_surface_is_told(scans, name):
    """Half a metre at UTM size; at 1e8 m all points become one, which raises, too."""
    with pytest.warns(UserWarning, match="float32 with coordinates up to 5e\\+06: they are rounded to 0.6"):
        readers((scans[0] + 5e6).astype(np.float32), scans[0])[name]()


@pytest.mark.filterwarnings("ignore:.*float32")
@pytest.mark.parametrize("name", ["register", "prepare", "field"])
def test_single_precision_in_which_all_points_are_one_is_refused(scans, name):
    with pytest.raises(fa.ArgumentError, match="must hold at least 3 distinct points"):
        readers((scans[0] + 1e8).astype(np.float32), scans[0])[name]()


@pytest.mark.parametrize("dtype", [np.float32, float])
def test_scans_of_a_drive_that_are_in_a_map_are_refused(scans, dtype):
    odometry = fa.Odometry()
    with pytest.raises(fa.ArgumentError, match="cloud must be in the frame of its sensor, but lies 5e\\+06 from"):
        odometry.step((scans[0] + [5e6, 0, 0]).astype(dtype))
    assert odometry.last is None
