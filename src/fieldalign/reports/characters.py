"""Clouds drawn with characters, for terminals: eight dots of a braille pattern in each."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from .cloud_picture import Layer, joined
from .painting import Array, Window, visible

_BLANK = 0x2800
# The bit of each dot, 4 rows of 2: braille numbers them by columns, and the last row was added later.
_BITS = np.array([0x01, 0x08, 0x02, 0x10, 0x04, 0x20, 0x40, 0x80])
_FILLED = 0.5  # points for a dot: more would fill the picture, and hide what is in it
_PLAIN = " .:-=+*#@"  # by how many of the eight dots are set, where a terminal knows no braille


def draw(
    layers: Sequence[Layer], view: Array, window: Window, columns: int, colored: bool, braille: bool = True
) -> str:
    """The window as lines of so many characters. colored: with the escapes of 256 colours. view: as in views.py."""
    points, colors = joined(layers)
    window = _whole(window, columns)
    most = _FILLED * (2 * columns) ** 2 * window.height / window.width
    some = slice(None, None, max(1, round(len(points) / most)))
    points, colors = points[some], colors[some]
    shown = visible(points @ view.T, window, 2 * columns, radius=0.5)
    dots = shown.reshape(-1, 4, columns, 2).transpose(0, 2, 1, 3).reshape(-1, columns, 8)  # of each character
    is_set = dots >= 0
    symbols = _BLANK + is_set @ _BITS if braille else np.array([ord(c) for c in _PLAIN])[np.sum(is_set, axis=2)]
    first = np.take_along_axis(dots, np.argmax(is_set, axis=2)[..., None], axis=2)[..., 0]
    codes = np.append(_codes(colors), -1)[first]  # the last one is for -1, no point
    lines = [_line(*pair) if colored else _text(pair[0]) for pair in zip(symbols, codes, strict=True)]
    drawn = [k for k, line in enumerate(lines) if line] or [0]
    return "\n".join(lines[drawn[0] : drawn[-1] + 1])


def named(name: str, color: Array, colored: bool, braille: bool = True) -> str:
    """A name with a dot in its color (3,), for a legend."""
    dot = f"\x1b[38;5;{_codes(color[None])[0]}m●\x1b[0m " if colored else "● "
    return (dot if braille else "") + name


def _whole(window: Window, columns: int) -> Window:
    """The window with a height of whole characters."""
    dot = window.width / (2 * columns)
    return Window(window.middle, window.width, 4 * dot * max(1, round(window.height / (4 * dot))))


def _codes(colors: Array) -> NDArray[np.int64]:
    """The nearest of the 216 colours of the terminals' cube to colors (N, 3), 0..1."""
    return np.asarray(16 + np.rint(5 * colors).astype(np.int64) @ (36, 6, 1))


def _text(symbols: NDArray[np.int64]) -> str:
    return "".join(map(chr, symbols)).rstrip(f" {chr(_BLANK)}")


def _line(symbols: NDArray[np.int64], codes: NDArray[np.int64]) -> str:
    """The characters with an escape where the color changes."""
    ends = np.flatnonzero(np.diff(codes)) + 1
    runs = zip(np.split(symbols, ends), np.split(codes, ends), strict=True)
    return "".join(f"\x1b[38;5;{code[0]}m{''.join(map(chr, run))}\x1b[0m" if code[0] >= 0 else "".join(map(chr, run))
                   for run, code in runs).rstrip(f" {chr(_BLANK)}")
