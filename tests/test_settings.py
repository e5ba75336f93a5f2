from dataclasses import fields, replace

import numpy as np
import pytest

from fieldalign.errors import ArgumentError
from fieldalign.settings import PRESETS, Settings, as_settings

LENGTHS = ("half_width", "sigma", "irls_distance", "unit", "pseudo_points")
POINTS = np.arange(18.0).reshape(6, 3)


def values(settings):
    return {f.name: getattr(settings, f.name) for f in fields(Settings)}


@pytest.mark.parametrize(
    ("name", "value"),
    [
        *((name, bad) for name in ("half_width", "sigma", "irls_distance", "irls_tolerance", "tolerance", "unit")
          for bad in (0, -1.0, np.inf, np.nan, 1 + 1j, "1")),
        ("pseudo_set", "neighborhood"),
        ("pseudo_set", None),
        ("direction", "foot"),
        ("direction", None),
        *(("pseudo_count", bad) for bad in (5, -1, 100.0, True, "many", None)),
        *(("min_kept", bad) for bad in (5, 10.0)),
        *((name, bad) for name in ("irls_steps", "max_iterations", "share_limit") for bad in (0, -3, 2.5, True)),
        *(("min_cosine", bad) for bad in (1, 1.5, -1.01, np.nan)),
        ("pseudo_points", POINTS[:5]),
        ("pseudo_points", POINTS[:, :2]),
        ("pseudo_points", np.where(POINTS == 3, np.nan, POINTS)),
        ("pseudo_points", [[1, 2, 3], [4]]),
        ("pseudo_points", "grid"),
    ],
)
def test_a_value_out_of_range_is_one_error_that_names_the_field(name, value):
    with pytest.raises(ArgumentError, match=rf"^{name} must") as caught:
        Settings(**{name: value})
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(("name", "value"), [("neighbours", 0), ("neighbours", 65), ("normal_neighbours", 2)])
def test_the_fields_own_ranges_are_checked_too(name, value):
    with pytest.raises(ArgumentError, match=name):
        Settings(**{name: value})


@pytest.mark.parametrize(("name", "value"), [("half_width", None), ("unit", np.ones(2)), ("min_cosine", "0.9")])
def test_a_value_of_a_wrong_type_is_one_error_that_names_the_field(name, value):
    with pytest.raises(ArgumentError, match=name):
        Settings(**{name: value})


@pytest.mark.parametrize(
    ("name", "value"),
    [("pseudo_count", 6), ("min_kept", 6), ("irls_steps", 1), ("max_iterations", 1), ("share_limit", 1),
     ("share_limit", None), ("min_cosine", -1), ("min_cosine", 0.999), ("sigma", None), ("half_width", 1)],
)
def test_the_ends_of_the_ranges_are_allowed(name, value):
    assert getattr(Settings(**{name: value}), name) == value


def test_replacing_checks_again():
    with pytest.raises(ArgumentError, match="half_width"):
        replace(Settings(), half_width=-1)


def test_the_spread_is_sigma_or_a_fifth_of_the_half_width():
    assert Settings(half_width=3.0).spread == pytest.approx(0.6)
    assert Settings(half_width=3.0, sigma=0.25).spread == 0.25


@pytest.mark.parametrize("factor", [1000.0, 0.5, 2])
def test_scaling_changes_every_length_and_nothing_else(factor):
    settings = Settings("uniform", half_width=3.0, sigma=0.5, pseudo_points=POINTS, irls_distance=0.25, unit=2.0)
    before, after = values(settings), values(settings.scaled(factor))
    for name, value in before.items():
        expected = factor * value if name in LENGTHS else value
        assert np.array_equal(after[name], expected), name
    assert np.array_equal(settings.pseudo_points, POINTS)


def test_scaling_leaves_what_is_not_given():
    scaled = Settings(half_width=2.0).scaled(10)
    assert scaled.sigma is None
    assert scaled.pseudo_points is None
    assert scaled.spread == 4.0


@pytest.mark.parametrize("factor", [0, -1, np.nan, np.inf, "2"])
def test_scaling_by_no_positive_number_is_refused(factor):
    with pytest.raises(ArgumentError, match="factor"):
        Settings().scaled(factor)


def test_handed_in_points_become_float64_and_are_not_shared():
    given = np.arange(18).reshape(6, 3)
    kept = Settings(pseudo_points=given).pseudo_points
    assert kept.dtype == np.float64
    given_floats = POINTS.copy()
    settings = Settings(pseudo_points=given_floats)
    given_floats[:] = 0
    assert np.array_equal(settings.pseudo_points, POINTS)


def test_the_presets_are_the_papers():
    assert list(PRESETS) == ["object", "indoor", "outdoor", "object-near", "indoor-dense"]
    assert [PRESETS[name].pseudo_set for name in ("object", "indoor", "outdoor")] == [
        "uniform", "neighbourhood", "keypoints"]
    assert [PRESETS[name].half_width for name in PRESETS] == [1, 2, 5, 0.5, 2]
    assert [PRESETS[name].pseudo_count for name in PRESETS] == [1000, 1000, 1000, 1000, 3000]
    assert [PRESETS[name].max_iterations for name in PRESETS] == [10, 20, 20, 10, 20]
    for name in ("object", "object-near"):  # no truncation on whole objects
        assert PRESETS[name].share_limit is None
        assert PRESETS[name].direction == "none"


def test_settings_by_name_by_default_and_as_they_are():
    assert as_settings(None) is PRESETS["indoor"]
    assert all(as_settings(name) is PRESETS[name] for name in PRESETS)
    own = Settings(half_width=7.0)
    assert as_settings(own) is own


@pytest.mark.parametrize("settings", ["inside", "", 3, 1.5])
def test_settings_by_an_unknown_name_list_the_known(settings):
    with pytest.raises(ArgumentError, match=r"settings must be .*object, indoor, outdoor"):
        as_settings(settings)


def test_settings_that_cannot_be_a_name_are_refused_too():
    with pytest.raises(ArgumentError, match="settings"):
        as_settings({"half_width": 2.0})
