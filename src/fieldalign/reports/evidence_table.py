"""What a verdict rests on, as tables: the evidence beside what is asked of it, and how well the pose is known."""

from __future__ import annotations

from html import escape

import numpy as np

from ..result import RegistrationResult
from ..verdict import Evidence
from ..verdict.evidence import MAX_OFF, MAX_SEEN_THROUGH, MIN_AGREEING, MIN_HOLD, MIN_MARGIN, MIN_MET
from .charts import lever

_FREEDOMS = {  # by the size of the covariance: 3 and 4 in the plane, the last of 4 and 7 is the scale's
    3: ("turn", "x", "y"), 4: ("turn", "x", "y", "scale"),
    6: ("turn about x", "turn about y", "turn about z", "x", "y", "z"),
    7: ("turn about x", "turn about y", "turn about z", "x", "y", "z", "scale"),
}


def evidence_table(result: RegistrationResult) -> str:
    """The evidence as a figure; where there is none, a sentence."""
    if result.evidence is None:
        return (
            "<figure><h3>Evidence</h3><figcaption>The paper’s method tests one pose only: there is no other to compare "
            "with. <code>fieldalign verify</code> judges its pose.</figcaption></figure>"
        )
    factors = result.evidence.factors
    rows = "".join(_row(*words, factors[key]) for key, words in _words(result.evidence).items())
    return f"""<figure><h3>Evidence</h3>
<table class="evidence"><thead><tr><th scope=col>what</th><th scope=col>found</th><th scope=col>asked</th>
<th scope=col><span class="ends"><span>÷10</span><span>just enough</span><span>×10</span></span></th></tr></thead>
<tbody>{rows}</tbody></table>
<figcaption>Each piece beside what is asked of it; right of the mark is enough. The weakest one decides: it has
{result.evidence.strength:.2g} times what is asked.</figcaption></figure>"""


def _words(e: Evidence) -> dict[str, tuple[str, str, str]]:
    """For each factor: what it is, what was found, what is asked."""
    seen = "not known" if e.seen_through is None else f"{e.seen_through:.1%}"
    margin = f"{e.margin:.1f}×" if e.margin < 1000 else "over 1000×"
    others = "any other pose" if e.searched else "poses around the guess"
    return {
        "met": ("meets the other surface", f"{e.met:.0%}", f"≥ {MIN_MET:.0%}"),
        "agreeing": ("agrees where they meet", f"{e.agreeing:.0%}", f"≥ {MIN_AGREEING:.0%}"),
        "margin": (f"better than {others}", margin, f"≥ {MIN_MARGIN}×"),
        "hold": ("hold of the loosest direction", f"{max(e.hold, 0):.1%}", f"≥ {MIN_HOLD:.1%}"),
        "seen_through": ("looked through by a sensor", seen, f"≤ {MAX_SEEN_THROUGH:.0%}"),
        "off": ("left to go, in voxels", f"{e.off:.2g}", f"≤ {MAX_OFF}"),
    }


def _row(what: str, found: str, asked: str, factor: float) -> str:
    if found == "not known":
        drawn, enough = "", "not known"
    else:
        drawn, enough = lever(factor), "enough" if factor >= 1 else "not enough"
    return (
        f"<tr><th scope=row>{what}</th><td>{found}</td><td>{asked}</td>"
        f'<td>{drawn}<span class="unseen">{enough}</span></td></tr>'
    )


def certainty_table(result: RegistrationResult) -> str:
    """The standard deviations of the pose, and what nothing holds."""
    deviations = np.sqrt(np.maximum(np.diagonal(result.covariance), 0))
    names = _FREEDOMS[len(deviations)]
    rows = "".join(
        f"<tr><th scope=row>{name}</th><td>{_deviation(name, value)}</td></tr>"
        for name, value in zip(names, deviations, strict=True)
    )
    place = ", ".join(f"{value:.4g}" for value in result.reference_point)
    free = " or ".join(map(str, result.freedoms))
    loose = f"The clouds may {free}: that part of the pose is not known." if free else ""
    return f"""<figure><h3>How well it is known</h3><table class="plain"><thead><tr><th scope=col>freedom</th>
<th scope=col>standard deviation</th></tr></thead><tbody>{rows}</tbody></table>
<figcaption>In the target’s frame, at ({escape(place)}), the middle of the overlap; lengths in the clouds’ unit.
{escape(loose)}</figcaption></figure>"""


def _deviation(name: str, value: float) -> str:
    if name.startswith("turn"):
        return f"{np.degrees(value):.2g}°"
    return f"{value:.2g}" if name != "scale" else f"{value:.2%}"
