"""Table IV: the paper's method without IRLS, without truncation, and with pseudo points in a cube."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from pathlib import Path

from ...settings import PRESETS, PseudoSet, Settings
from .. import tables
from ..case import Case
from ..columns import ANY_POSE, PRIOR, ByPaper, Column
from ..comparison import Comparison
from ..data_sets.three_d_match import demo_pair
from ..data_sets.twists import demo_motions
from ..parts import Parts
from ..published import ABLATION, PROGRAM_ABLATION
from ..results import Results
from .laid import Laid, as_case
from .three_d_match import ALIGNED, ALIGNED_CASES, VOXEL

ROWS: dict[int, tuple[bool, bool, PseudoSet]] = {
    1: (False, False, "uniform"),
    2: (False, False, "neighbourhood"),
    3: (False, True, "uniform"),
    4: (False, True, "neighbourhood"),
    5: (True, False, "uniform"),
    6: (True, False, "neighbourhood"),
    7: (True, True, "uniform"),
    8: (True, True, "neighbourhood"),
}
"""Number in Table IV: IRLS, truncation, pseudo set."""

_THINNED = 0.05  # m


def row_settings(number: int) -> Settings:
    """The settings of a row; what Table IV does not name is as in the preset "indoor"."""
    irls, truncation, pseudo_set = ROWS[number]
    settings = replace(PRESETS["indoor"], irls=irls, pseudo_set=pseudo_set)
    return settings if truncation else replace(settings, share_limit=None, direction="none")


def _column(number: int) -> Column:
    irls, truncation, pseudo_set = ROWS[number]
    words = "IRLS" if irls else "solved directly", "truncation" if truncation else "no truncation", pseudo_set
    return Column(f"row-{number}", f"row {number}: {', '.join(words)}", ByPaper(row_settings(number)))


def _demo_cases(data: Path, seed: int, voxel: float | None) -> list[Case]:
    """The pair of PointNetLK-Revisited's demonstration with the 100 motions that the authors' program was run on."""
    pair = demo_pair(data)
    motions = demo_motions(data / "paper_pairs" / "demo_perturb100.npy")
    return [as_case(Laid(pair, motion, voxel=voxel), draw) for draw, motion in enumerate(motions)]


def _accuracy(results: Results) -> str:
    return tables.accuracy(results, "m", pooled=True)


_OWN = (*(_column(number) for number in ROWS), PRIOR, ANY_POSE)
_UNIFORM = (
    "Uniform pseudo points in [-2, 2]^3 m about the target's centroid, as the authors' program has it indoors; the "
    "text says [-1, 1]^3."
)


def _demo(name: str, title: str, sentence: str, voxel: float | None, few: int) -> Comparison:
    return Comparison(
        name=name, title=title,
        protocol=(
            "The pair of PointNetLK-Revisited's demonstration, two fused fragments that overlap almost wholly, with "
            f"motions of at most 45 degrees that the authors' program was run on. {sentence} The truth is where "
            "point-to-plane ICP ends. The fragments are bent against each other: finer methods agree among themselves "
            "to 0.3 degrees, and are up to 1.2 degrees from there, though less than 1 cm in the middle of the overlap. "
            "Below that this table does not rank.", *ALIGNED[2:3], _UNIFORM,
        ),
        cases=partial(_demo_cases, voxel=voxel), own=_OWN, peers=(), voxel=VOXEL, success=(5.0, 0.2), text=_accuracy,
        few=few,
    )


EXPERIMENT = Parts("ablation", "Table IV: ablation", (
    Comparison(
        name="ablation-3dmatch", title="3DMatch, the pairs of Table II", protocol=(*ALIGNED, _UNIFORM),
        cases=ALIGNED_CASES, own=_OWN, peers=(), voxel=VOXEL, success=(5.0, 0.2), text=_accuracy,
    ),
    _demo("ablation-demo-thinned", "The demo pair, thinned", "Thinned at 5 cm.", _THINNED, 60),
    _demo("ablation-demo-full", "The demo pair, all points", "76,000 and 104,000 points.", None, 20),
), "\n\n".join([
    "Published, of the pooled kind (to be compared with the Euler columns), on 3DMatch:", tables.published(ABLATION),
    "The authors' program on the demo pair, RRE:", tables.published(PROGRAM_ABLATION),
]))
