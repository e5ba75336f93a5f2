"""Small charts as SVG, drawn in the colours of the page that they stand in (page.css)."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

import numpy as np

from ..fields.protocol import Floats

_WIDE, _HIGH = 360, 190
_LEFT, _RIGHT, _TOP, _BOTTOM = 52, 8, 10, 34
_LEAST = 1e-12   # of the largest value: below, a logarithmic axis ends
_DECADES = 4     # of a logarithmic axis have names, about
_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
_LEVER = 120     # half the width of a lever: a factor of ten


def curve(values: Sequence[float], label: str, across: str) -> str:
    """Values (n,), none negative, on a logarithmic axis over 1 to n; label: of the values, across: of the numbers."""
    sizes = np.asarray(values, float)
    largest = float(sizes.max(initial=0.0)) or 1.0
    logs = np.log10(np.maximum(sizes, _LEAST * largest))
    low, high = np.floor(logs.min(initial=np.log10(largest))), np.ceil(logs.max(initial=np.log10(largest)))
    high = max(high, low + 1)
    x = _along(np.arange(len(sizes), dtype=float), 0, max(len(sizes) - 1, 1))
    y = _up(logs, low, high)
    step = max(1, round((high - low) / _DECADES))
    decades = np.arange(low, high + 0.5, step)
    marks = "".join(_grid_line(float(_up(k, low, high)), "10" + f"{k:.0f}".translate(_RAISED)) for k in decades)
    path = "M" + "L".join(f"{a:.1f} {b:.1f}" for a, b in zip(x, y, strict=True)) if len(sizes) > 1 else ""
    dots = "".join(f'<circle cx="{a:.1f}" cy="{b:.1f}" r="2.4"/>' for a, b in zip(x, y, strict=True))
    ends = _label(_LEFT, "1") + (_label(_WIDE - _RIGHT, str(len(sizes)), "end") if len(sizes) > 1 else "")
    story = f"{label} over {len(sizes)} {across}, from {_short(sizes[:1])} to {_short(sizes[-1:])}"
    return _svg(story, f'{marks}<path class="curve" d="{path}"/><g class="dots">{dots}</g>{ends}{_axis(across)}')


def histogram(values: Floats, limit: float, signed: bool, label: str, bars: int = 61) -> str:
    """How many values (n,) lie where between -limit (or 0) and the limit; what is beyond counts in the last bars."""
    low = -limit if signed else 0.0
    counts, edges = np.histogram(np.clip(values, low, limit), np.linspace(low, limit, bars + 1))
    tallest = max(int(counts.max()), 1)
    x = _along(edges, low, limit)
    tops = _up(counts / tallest, 0, 1)
    floor = _HIGH - _BOTTOM
    drawn = []
    for left, right, top, count, middle in zip(x, x[1:], tops, counts, (edges[1:] + edges[:-1]) / 2, strict=False):
        strength = round(5 * abs(middle) / limit)
        side = "inside" if middle < 0 else "outside"
        drawn.append(
            f'<rect class="{side}{strength}" x="{left:.1f}" y="{top:.1f}" width="{max(right - left - 0.6, 0.4):.1f}" '
            f'height="{floor - top:.1f}"><title>{middle:.3g}: {count} points</title></rect>'
        )
    marks = "".join(_grid_line(float(_up(share, 0, 1)), f"{share * tallest:.0f}") for share in (0.5, 1.0))
    at = (low, 0.0, limit) if signed else (0.0, limit / 2, limit)
    ends = "".join(
        _label(float(_along(v, low, limit)), f"{v:.2g}", anchor)
        for v, anchor in zip(at, ("start", "middle", "end"), strict=True)
    )
    story = f"{label} of {len(values)} points; half lie between {_quartiles(values)}"
    return _svg(story, f"{marks}{''.join(drawn)}{ends}{_axis(label)}")


def profile(along: Floats, values: Floats, spans: Sequence[tuple[float, float]], label: str, across: str) -> str:
    """Values (n,) over places along a way (n,); spans: parts of the way to shade."""
    end = float(along[-1]) or 1.0
    low, high = min(0.0, float(values.min())), max(0.0, float(values.max()))
    high = max(high, low + max(1e-9 * abs(low), 1e-12))
    shades = "".join(
        f'<rect class="span" x="{a:.1f}" y="{_TOP}" width="{max(b - a, 1.5):.1f}" height="{_HIGH - _BOTTOM - _TOP}"/>'
        for a, b in (_along(np.array(span), 0, end) for span in spans)
    )
    marks = "".join(_grid_line(float(_up(v, low, high)), f"{v:.3g}") for v in (low, (low + high) / 2, high))
    points = zip(_along(along, 0, end), _up(values, low, high), strict=True)
    path = "M" + "L".join(f"{x:.1f} {y:.1f}" for x, y in points)
    ends = _label(_LEFT, "0") + _label(_WIDE - _RIGHT, f"{end:.4g}", "end")
    story = f"{label} over {end:.4g} of {across}, from {values.min():.3g} to {values.max():.3g}"
    return _svg(story, f'{shades}{marks}<path class="curve" d="{path}"/>{ends}{_axis(across)}')


def lever(factor: float) -> str:
    """A factor on a logarithmic scale from a tenth to ten, with 1, which is asked for, in the middle."""
    at = _LEVER / 2 * (1 + float(np.clip(np.log10(max(factor, 1e-9)), -1, 1)))
    kind = "good" if factor >= 1 else "bad"
    return (
        f'<svg class="lever {kind}" viewBox="-6 0 {_LEVER + 12} 16" aria-hidden="true">'
        f'<path class="rail" d="M0 8H{_LEVER}"/>'
        f'<path class="asked" d="M{_LEVER / 2} 1V15"/><path class="arm" d="M{_LEVER / 2} 8H{at:.1f}"/>'
        f'<circle cx="{at:.1f}" cy="8" r="4.5"/></svg>'
    )


def share_bar(share: float) -> str:
    """A bar of a share, 0 to 1."""
    return (
        '<svg class="bar" viewBox="0 0 200 10" preserveAspectRatio="none" aria-hidden="true">'
        f'<rect class="rail" width="200" height="10"/><rect class="part" width="{200 * share:.1f}" height="10"/></svg>'
    )


def _svg(story: str, drawing: str) -> str:
    return f'<svg class="chart" viewBox="0 0 {_WIDE} {_HIGH}" role="img" aria-label="{escape(story)}">{drawing}</svg>'


def _along(values: Floats | float, low: float, high: float) -> Floats:
    return np.asarray(_LEFT + (_WIDE - _LEFT - _RIGHT) * (values - low) / (high - low))


def _up(values: Floats | float, low: float, high: float) -> Floats:
    return np.asarray(_HIGH - _BOTTOM - (_HIGH - _BOTTOM - _TOP) * (values - low) / (high - low))


def _grid_line(y: float, name: str) -> str:
    return (
        f'<path class="grid" d="M{_LEFT} {y:.1f}H{_WIDE - _RIGHT}"/>'
        f'<text x="{_LEFT - 6}" y="{y + 3.5:.1f}" text-anchor="end">{escape(name)}</text>'
    )


def _label(x: float, text: str, anchor: str = "start") -> str:
    return f'<text x="{x:.1f}" y="{_HIGH - _BOTTOM + 15}" text-anchor="{anchor}">{escape(text)}</text>'


def _axis(name: str) -> str:
    middle = (_LEFT + _WIDE - _RIGHT) / 2
    return (
        f'<path class="axis" d="M{_LEFT} {_HIGH - _BOTTOM}H{_WIDE - _RIGHT}"/>'
        f'<text class="name" x="{middle}" y="{_HIGH - 4}" text-anchor="middle">{escape(name)}</text>'
    )


def _short(values: Floats) -> str:
    return f"{values[0]:.3g}" if len(values) else "nothing"


def _quartiles(values: Floats) -> str:
    if not len(values):
        return "nothing and nothing"
    low, high = np.percentile(values, (25, 75))
    return f"{low:.3g} and {high:.3g}"
