"""Makers of PointCloud2 messages, as the drivers of the common sensors write them."""

from types import SimpleNamespace

import numpy as np
import pytest

NUMBERS = {"i1": 1, "u1": 2, "i2": 3, "u2": 4, "i4": 5, "u4": 6, "f4": 7, "f8": 8}


@pytest.fixture(scope="session")
def message_of():
    """Makes a PointCloud2 of named columns: each at its offset, in the byte order and the shape that are asked for."""

    def make(columns, layout, point_step, order="<", height=1, row_padding=0):
        """layout: {name: (offset, type)}; a point's other bytes, and those after a row, are noise."""
        n = len(next(iter(columns.values())))
        data = np.random.default_rng(0).integers(0, 255, (n, point_step), np.uint8)
        for name, (offset, kind) in layout.items():
            values = np.ascontiguousarray(columns[name], order + kind)
            data[:, offset : offset + values.itemsize] = values.view(np.uint8).reshape(n, values.itemsize)
        rows = data.reshape(height, n // height * point_step)
        rows = np.hstack([rows, np.full((height, row_padding), 77, np.uint8)])
        fields = [
            SimpleNamespace(name=name, offset=offset, datatype=NUMBERS[kind], count=1)
            for name, (offset, kind) in layout.items()
        ]
        return SimpleNamespace(
            height=height, width=n // height, fields=fields, is_bigendian=order == ">", point_step=point_step,
            row_step=rows.shape[1], data=rows.ravel(), is_dense=False,
        )

    return make


@pytest.fixture
def scan(rng):
    """24 points with all that sensors say of them, over a tenth of a second."""
    return {
        "x": rng.normal(size=24) * 10,
        "y": rng.normal(size=24) * 10,
        "z": rng.normal(size=24),
        "intensity": rng.uniform(0, 255, 24).astype(np.uint8),
        "ring": np.arange(24) % 4,
        "after": np.sort(rng.uniform(0, 0.1, 24)),
    }
