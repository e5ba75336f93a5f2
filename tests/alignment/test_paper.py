"""The paper's alignment: when it stops."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from fieldalign.alignment.paper import PaperStage
from fieldalign.alignment.solver import Step
from fieldalign.settings import PRESETS


@pytest.mark.parametrize("axis", range(6))
@pytest.mark.parametrize("unit", [1.0, 1000.0])
def test_an_increment_below_the_tolerance_is_still(axis, unit):
    """Turns in radians, shifts in the settings' unit: each axis counts alike."""
    settings = replace(PRESETS["indoor"], unit=unit, tolerance=1e-3)
    size = 1e-3 * (1 if axis < 3 else unit)
    for factor, still in ((0.99, True), (1.01, False)):
        step = Step(factor * size * np.eye(6)[axis], 0.0, 10)
        assert PaperStage.is_still(SimpleNamespace(settings=settings), step) is still
