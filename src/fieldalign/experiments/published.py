"""Figures that others have published, and where: what stands beside what is measured here, never mixed with it.

Rotations in degrees, translations in metres, or in the shape's unit where shapes are of unit size (modelnet40,
shapenet). Table numbers without a name are those of Yuan & Nüchter, RA-L 2022; rows that its tables mark with an
asterisk are taken there from another paper, named in `source`. Figures of Tables I and II are of the pooled Euler kind
(see measures.py), since those of Li et al. are, from whose program the measure comes.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple


class Published(NamedTuple):
    """What was published of a method. figures: quantity, with its unit in the name -> value. source: where."""

    method: str
    figures: Mapping[str, float]
    source: str


_LI = "taken from Li, Pontes & Lucey, PointNetLK Revisited, CVPR 2021"
_HORN = "taken from Horn et al., DeepCLR, ITSC 2020"
_PROGRAM = "the authors' program, run on ../shared/data (shared/paper/reference_behaviour.md)"

_ERRORS = "rotation_rmse_deg", "rotation_median_deg", "translation_rmse", "translation_median"
_METRES = "rotation_rmse_deg", "rotation_median_deg", "translation_rmse_m", "translation_median_m"


def _rows(names: tuple[str, ...], table: str, *rows: tuple[str, tuple[float, ...], str]) -> tuple[Published, ...]:
    """Rows of one table. A source of "" is the table's own."""
    return tuple(
        Published(method, dict(zip(names, figures, strict=True)), f"{table}, {source}" if source else table)
        for method, figures, source in rows
    )


MODELNET40 = _rows(
    _ERRORS, "Table I",
    ("ICP", (39.33, 5.036, 0.474, 0.058), _LI),
    ("DCP", (5.500, 1.202, 0.022, 0.004), _LI),
    ("DeepGMR", (6.059, 0.070, 0.014, 8.42e-5), _LI),
    ("PointNetLK", (8.183, 3.63e-6, 0.074, 5.96e-8), _LI),
    ("PointNetLK-Revisited", (3.350, 2.17e-6, 0.031, 4.47e-8), _LI),
    ("the paper's method", (5.168, 1.83e-6, 0.055, 4.47e-8), ""),
)

SHAPENET = _rows(
    _ERRORS, "Table I",
    ("ICP", (40.71, 5.825, 0.478, 0.073), _LI),
    ("DCP", (8.587, 0.930, 0.021, 0.003), _LI),
    ("DeepGMR", (6.043, 0.013, 0.005, 9.33e-6), _LI),
    ("PointNetLK", (12.941, 4.33e-6, 0.115, 5.96e-8), _LI),
    ("PointNetLK-Revisited", (3.983, 2.06e-6, 0.049, 2.98e-8), _LI),
    ("the paper's method", (4.042, 2.95e-6, 0.047, 5.96e-8), ""),
)

EFFICIENCY = _rows(
    ("seconds",), "Sec. V-F, 10^4 points, one Intel Core i7-10710U",
    ("PointNetLK-Revisited", (1.97,), "run there by the authors"),
    ("the paper's method", (0.27,), ""),
)

THREE_D_MATCH = _rows(
    _METRES, "Table II",
    ("ICP", (24.772, 4.501, 1.064, 0.149), _LI),
    ("DCP", (53.905, 23.659, 1.823, 0.784), _LI),
    ("DeepGMR", (32.729, 16.548, 2.112, 0.764), _LI),
    ("PointNetLK", (28.894, 7.596, 1.098, 0.260), _LI),
    ("the paper's method, without truncation", (23.814, 4.191, 1.057, 0.161), ""),
    ("the paper's method, with truncation", (40.42, 1.106, 1.546, 0.049), ""),
)

KITTI = _rows(
    ("rotation_rmse_deg", "translation_rmse_m"), "Table III",
    ("ICP, point to point", (0.088, 0.177), _HORN),
    ("ICP, point to plane", (0.079, 0.140), _HORN),
    ("G-ICP", (0.029, 0.109), _HORN),
    ("3DFeat-Net", (0.199, 0.116), _HORN),
    ("DeepVCP", (0.164, 0.071), _HORN),
    ("DeepCLR", (0.053, 0.080), _HORN),
    ("the paper's method", (0.088, 0.068), ""),
)

ABLATION = _rows(
    _METRES, "Table IV",
    ("row 1", (18.732, 7.073, 0.969, 0.311), "solved directly, no truncation, uniform"),
    ("row 2", (25.074, 7.393, 1.129, 0.265), "solved directly, no truncation, neighbourhood"),
    ("row 3", (46.522, 7.503, 1.607, 0.281), "solved directly, truncation, uniform"),
    ("row 4", (37.896, 2.998, 1.492, 0.118), "solved directly, truncation, neighbourhood"),
    ("row 5", (19.042, 5.732, 0.972, 0.248), "IRLS, no truncation, uniform"),
    ("row 6", (23.018, 4.443, 1.057, 0.157), "IRLS, no truncation, neighbourhood"),
    ("row 7", (44.102, 4.687, 1.617, 0.160), "IRLS, truncation, uniform"),
    ("row 8", (32.886, 0.913, 1.148, 0.036), "IRLS, truncation, neighbourhood"),
)

# ------------------------------------------------------------------------------- the authors' program, run here

PROGRAM_OBJECTS = _rows(
    ("rre_rmse_deg", "rre_median_deg", "rte_rmse", "rte_median", "share_below_0.001_deg"), _PROGRAM,
    ("meshes, twists of gt_poses.csv", (8.26, 4.5e-6, 0.094, 9.2e-8, 0.915), "63 clouds with a unique answer"),
    ("meshes, twists as the text says", (4.20, 3.2e-6, 0.029, 3.7e-8, 0.960), "63 clouds with a unique answer"),
)
PROGRAM_MODELNET40 = _rows(
    ("share_below_0.001_deg",), _PROGRAM,
    ("modelnet40, twists of gt_poses.csv", (0.993,), "airplanes and bathtubs"),
    ("modelnet40, twists as the text says", (1.00,), "airplanes and bathtubs"),
)
PROGRAM_SECONDS = _rows(
    ("seconds",), f"{_PROGRAM}, one thread",
    ("the authors' program, 10^4 points", (0.187,), ""),
    ("PointNetLK-Revisited, 10^4 points", (1.64,), "with its published weights"),
    ("the authors' program, demo pair", (1.16,), "76,000 and 104,000 points"),
    ("the authors' program, demo pair at 5 cm", (0.32,), ""),
)
PROGRAM_ABLATION = _rows(
    ("rre_median_deg_thinned", "rre_median_deg_full"),
    f"{_PROGRAM}: the demo pair, 60 motions thinned at 5 cm, 20 in full",
    ("row 1", (12.2, 12.4), ""),
    ("row 2", (7.9, 8.4), ""),
    ("row 3", (12.1, 12.1), ""),
    ("row 4", (1.67, 2.05), ""),
    ("row 5", (4.64, 4.43), ""),
    ("row 6", (3.11, 3.92), ""),
    ("row 7", (2.22, 3.26), ""),
    ("row 8", (0.79, 0.75), ""),
)
PROGRAM_INDOOR = _rows(
    ("success_5deg_0.2m", "success_1deg_0.05m_thinned", "success_1deg_0.05m_full", "success_at_45deg",
     "success_at_60deg", "success_at_75deg", "success_at_90deg"),
    f"{_PROGRAM}: the demo pair",
    ("row 8", (1.00, 0.82, 0.93, 0.95, 0.70, 0.30, 0.15), ""),
)

# -------------------------------------------------------------- the benchmarks' protocols, which the paper does not run

_RECALL = "recall_percent_3dmatch", "recall_percent_3dlomatch"
BENCHMARK = _rows(
    _RECALL, "registration recall as in Predator (RMSE of the true pairs < 0.2 m, mean over scenes)",
    ("GeoTransformer", (92.5, 74.2), "README of github.com/qinzheng93/GeoTransformer, released weights"),
) + _rows(
    _RECALL, "registration recall by pairs, not by scenes",
    ("Predator", (91.7, 62.5), "measured by the author of Lepard, github.com/rabbityl/lepard/issues/6"),
) + _rows(
    _RECALL[:1], "registration recall as in Predator (RMSE of the true pairs < 0.2 m, mean over scenes)",
    ("Predator", (90.6,), "abstract of Huang et al., arXiv 2011.13005"),
)

# Experiment, as on the command line -> what was published of it.
BY_EXPERIMENT: dict[str, tuple[Published, ...]] = {
    "modelnet40": MODELNET40 + PROGRAM_OBJECTS + PROGRAM_MODELNET40,
    "shapenet": SHAPENET + PROGRAM_OBJECTS,
    "efficiency": EFFICIENCY + PROGRAM_SECONDS,
    "3dmatch": THREE_D_MATCH + PROGRAM_INDOOR,
    "3dmatch-benchmark": BENCHMARK,
    "kitti": KITTI,
    "ablation": ABLATION + PROGRAM_ABLATION,
}
