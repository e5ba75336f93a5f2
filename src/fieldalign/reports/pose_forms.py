"""A pose written as other programs take it, to be copied."""

from __future__ import annotations

import json
from dataclasses import dataclass

import numpy as np

from ..fields.protocol import Floats
from ..motions import growth, quaternions_of, size_of

_RIGID = 1e-12  # a scale that differs from 1 by less is rounding


@dataclass(frozen=True)
class Form:
    """The text of a pose for one program, and what to know of it there."""

    name: str
    text: str
    note: str


def pose_forms(T: Floats) -> list[Form]:
    """T_target_source, (4, 4) or (3, 3) in the plane, for NumPy, CloudCompare, ROS and as JSON, with all digits."""
    whole = in_space(T)
    return [
        Form("NumPy", _numpy(T), "x_target = R x_source + t, with R, t = T[:-1, :-1], T[:-1, -1]"),
        Form("CloudCompare", "\n".join(" ".join(map(repr, row)) for row in whole.tolist()),
             "Edit › Apply transformation, on the source"),
        _ros(whole),
        Form("JSON", json.dumps({"T_target_source": T.tolist()}), "as fieldalign verify and --init read it"),
    ]


def in_space(T: Floats) -> Floats:
    """A motion (4, 4) as it is, one of the plane (3, 3) as the motion of space that leaves heights as they are."""
    if T.shape == (4, 4):
        return T
    whole = np.eye(4)
    whole[np.ix_([0, 1, 3], [0, 1, 3])] = T
    whole[2, 2] = np.sqrt(np.linalg.det(T[:2, :2]))
    return whole


def _numpy(T: Floats) -> str:
    rows = ",\n              ".join("[" + ", ".join(map(repr, row)) + "]" for row in T.tolist())
    return f"T = np.array([{rows}])"


def _ros(T: Floats) -> Form:
    """geometry_msgs/Transform, scalar last as ROS has it."""
    size = size_of(T)
    w, *xyz = quaternions_of((T @ growth(1 / size))[None, :3, :3])[0].tolist()
    translation, rotation = T[:3, 3].tolist(), [*xyz, w]
    text = "\n".join(
        f"{name}: {{" + ", ".join(f"{axis}: {value!r}" for axis, value in zip("xyzw", values, strict=False)) + "}"
        for name, values in (("translation", translation), ("rotation", rotation))
    )
    if abs(size - 1) > _RIGID:
        note = f"ROS knows no scale: multiply the source by {size!r} first"
    else:
        note = "geometry_msgs/Transform: the target is the parent frame, the source the child"
    return Form("ROS", text, note)
