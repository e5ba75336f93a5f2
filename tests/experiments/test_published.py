"""Published figures: as the paper's tables have them, each with a source and units in its names."""

import re

import pytest

from fieldalign.experiments.published import (
    ABLATION,
    BY_EXPERIMENT,
    EFFICIENCY,
    KITTI,
    MODELNET40,
    SHAPENET,
    THREE_D_MATCH,
)


def figures(rows, method):
    (found,) = [row.figures for row in rows if row.method == method]
    return tuple(found.values())


def test_the_papers_own_rows():
    ours = "the paper's method"
    assert figures(MODELNET40, ours) == (5.168, 1.83e-6, 0.055, 4.47e-8)
    assert figures(SHAPENET, ours) == (4.042, 2.95e-6, 0.047, 5.96e-8)
    assert figures(THREE_D_MATCH, f"{ours}, with truncation") == (40.42, 1.106, 1.546, 0.049)
    assert figures(KITTI, ours) == (0.088, 0.068)
    assert figures(ABLATION, "row 8") == (32.886, 0.913, 1.148, 0.036)
    assert figures(EFFICIENCY, ours) == (0.27,)


def test_truncation_contradicts_itself():
    """Table II and row 8 of Table IV are of one setting: irls, truncation, neighbourhood."""
    row = figures(ABLATION, "row 8")
    assert row != figures(THREE_D_MATCH, "the paper's method, with truncation")


@pytest.mark.parametrize("name", BY_EXPERIMENT)
def test_each_row_has_a_source_and_units(name):
    for row in BY_EXPERIMENT[name]:
        assert row.method
        assert len(row.source) > 6
        assert row.figures
        for quantity, value in row.figures.items():
            assert re.search(r"_deg|_m\b|translation|seconds|percent|share|success|rte", quantity), quantity
            assert 0 <= value < 100


def test_what_the_paper_took_from_others_says_so():
    taken = [row for table in (MODELNET40, SHAPENET, THREE_D_MATCH, KITTI) for row in table
             if not row.method.startswith("the paper's")]
    assert all("taken from" in row.source for row in taken)
    assert len(taken) == 5 + 5 + 4 + 6
