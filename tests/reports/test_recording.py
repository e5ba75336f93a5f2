"""Recordings for Rerun: what lies far off is shifted, so that float32 holds it. The rest: tests/cli/test_plot.py."""

import numpy as np
import pytest

from fieldalign.motions import apply, exp_twist
from fieldalign.reports import recording
from fieldalign.reports.cloud_picture import Layer

FAR = np.array([500_000.0, 5_000_000.0, 300.0])


def test_only_what_lies_far_off_is_shifted(corner):
    assert not recording._shift([corner, corner + 1000]).any()
    shift = recording._shift([corner + FAR])
    assert np.array_equal(shift, np.rint(shift))
    assert np.linalg.norm(shift - FAR) < 10


def test_names_tell_all_apart():
    assert recording._names(["a/b.ply", "c.ply", "c.ply"]) == ["a_b.ply", "c.ply (2)", "c.ply (3)"]


def test_a_pair_far_off_keeps_its_millimetres(corner, tmp_path):
    pytest.importorskip("rerun", reason="the extra rerun is not installed")
    chunks = pytest.importorskip("rerun.chunk")
    T = exp_twist([0.0, 0.0, 0.3, 0.0, 0.0, 0.0])
    T[:3, 3] = FAR - T[:3, :3] @ FAR + [1.0, 2.0, 0.0]
    source, colors = corner + FAR, np.ones(corner.shape)
    layers = [Layer("source", source, colors), Layer("target", apply(T, source), colors)]
    path = recording.write_clouds_recording(layers, [T, None], tmp_path / "far.rrd", "far")
    found = {}
    for chunk in chunks.RrdReader(str(path)).stream():
        table = chunk.to_record_batch()
        found[str(chunk.entity_path)] = found.get(str(chunk.entity_path), {}) | {
            name: table.column(name).to_pylist() for name in table.schema.names if name != "log_time"}
    places = np.array(found["/world/source/points"]["Points3D:positions"][0])
    target = np.array(found["/world/target/points"]["Points3D:positions"][0])
    moved = found["/world/source"]
    R = np.array(moved["Transform3D:mat3x3"][1][0]).reshape(3, 3).T  # Rerun's are by columns
    assert np.allclose(places @ R.T + moved["Transform3D:translation"][1][0], target, atol=1e-3)
