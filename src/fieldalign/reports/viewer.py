"""The viewers of a page, as HTML: a canvas with its buttons and legend; pair.js and model.js make them work."""

from __future__ import annotations

from collections.abc import Mapping
from html import escape

from .model_scene import Way

PAIR_SCRIPTS = ("three.min.js", "stage.js", "camera.js", "pair.js")
MODEL_SCRIPTS = ("three.min.js", "stage.js", "camera.js", "model.js")

_CAMERA = (
    "Drag to turn, wheel or pinch to come nearer, right drag or two fingers to shift. Keys: <kbd>←</kbd> <kbd>→</kbd> "
    "<kbd>↑</kbd> <kbd>↓</kbd> <kbd>+</kbd> <kbd>−</kbd> on the picture; <kbd>1</kbd> oblique, <kbd>2</kbd> above, "
    "<kbd>3</kbd> side, <kbd>F</kbd> fit, <kbd>U</kbd> another axis upwards, <kbd>C</kbd> next colouring"
)


def pair_viewer() -> str:
    """Of two clouds, before and after."""
    return f"""<section id="viewer" class="viewer" aria-labelledby="view-name">
<h3 id="view-name" class="unseen">Both clouds in 3D</h3>
<figure>
{_stage("canvas", "Two point clouds in 3D", "keys")}
<div class="sliding">
<button type="button" id="play" aria-label="Play the motion">▶</button>
<label for="between">before</label>
<input type="range" id="between" min="0" max="100" value="100"
aria-label="Where the source is, between before and after">
<output id="where" for="between">after</output>
</div>
<div class="controls">
{_radios("colour", {"cloud": "cloud", "agreement": "agreement", "distance": "distance"})}
<fieldset><legend>Show</legend>
<label><input type="checkbox" id="show-source" checked><span>source</span></label>
<label><input type="checkbox" id="show-target" checked><span>target</span></label>
<label id="pseudo-label"><input type="checkbox" id="show-pseudo"><span>pseudo points</span></label>
<label id="ceiling-label"><input type="checkbox" id="show-ceiling"><span>ceiling</span></label>
</fieldset>
<label id="pose-label" hidden>Pose <select id="pose"></select></label>
</div>
<figcaption>
<ul class="legend" data-legend="cloud"><li>{_swatch("source")}source, {_word("source")} points</li>
<li>{_swatch("target")}target, {_word("target")} points</li></ul>
<ul class="legend" data-legend="agreement" hidden><li>{_swatch("agrees")}agrees with the other cloud</li>
<li>{_swatch("contradicts")}near it, but faces another way</li>
<li>{_swatch("alone")}further than {_word("voxel")} from it</li></ul>
<ul class="legend" data-legend="distance" hidden><li><span class="scale"><i data-word="low"></i><b class="ramp"></b><i
data-word="limit"></i></span> distance to the other cloud after the motion; {_word("side")}</li>
<li>{_swatch("alone")}further than {_word("voxel")}</li></ul>
<ul class="legend" id="pseudo-legend" hidden><li>{_swatch("pseudo")}pseudo points, the third set that is moved between
the fields</li></ul>
{_keys("keys", "; <kbd>space</kbd> play, <kbd>B</kbd> before, <kbd>A</kbd> after, <kbd>S</kbd> source, <kbd>T</kbd> "
       "target, <kbd>P</kbd> pseudo points.")}
</figcaption>
</figure>
</section>"""


def model_viewer(name: str, tints: Mapping[str, str], ways: Mapping[str, Way], components: int = 1) -> str:
    """Of one cloud and the ways on it. name: plain text. tints: what colours tell, and the word for it. ways: by the
    names of their layers. components: how many clouds there are to choose from."""
    boxes = "".join(
        f'<label><input type="checkbox" id="see-{key}" data-layer="{key}" checked><span>{way.words}</span></label>'
        for key, way in ways.items()
    )
    lines = "".join(f"<li>{_swatch(way.swatch)}{way.words}</li>" for way in ways.values())
    options = "".join(f'<option value="{k}">{k + 1}</option>' for k in range(components))
    choice = f'<label>Component <select id="component">{options}</select></label>' if components > 1 else ""
    scans = '<label id="scan-label">Scan <select id="scan"></select></label>' if "scan" in tints else ""
    legend = '<ul class="legend" id="scans" data-tint="scan"></ul>' if "scan" in tints else ""
    return f"""<section id="model" class="viewer" aria-labelledby="model-name">
<h3 id="model-name">{escape(name)}</h3>
<figure>
{_stage("model-canvas", name, "model-keys")}
<div class="controls">
{choice}{_radios("tint", tints)}{scans}
<fieldset id="see"><legend>Show</legend>{boxes}
<label id="top-label"><input type="checkbox" id="see-ceiling"><span>ceiling</span></label></fieldset>
</div>
<figcaption>{legend}
<ul class="legend" data-tint="height" hidden><li><span class="scale"><i>low</i><b class="ramp heights"></b><i>high</i>
</span> height</li></ul>
<ul class="legend">{lines}</ul>
{_keys("model-keys", ".")}
</figcaption>
</figure>
</section>"""


def _stage(canvas: str, label: str, keys: str) -> str:
    """The canvas and the buttons over it."""
    buttons = "".join(
        f'<button type="button" data-view="{view}">{view.capitalize()}</button>'
        for view in ("oblique", "above", "side", "fit")
    )
    return f"""<div class="stage">
<canvas id="{canvas}" tabindex="0" role="img" aria-label="{escape(label)}" aria-describedby="{keys}"></canvas>
<p class="no-view">This browser shows no 3D here (WebGL is off). All else on this page stands.</p>
<div class="views" role="group" aria-label="Look from">{buttons}<button type="button" data-up
aria-label="Up: turn another axis upwards">Up</button></div>
</div>"""


def _radios(name: str, choices: Mapping[str, str]) -> str:
    """What colours tell; the first choice at first."""
    radios = "".join(
        f'<label><input type="radio" name="{name}" value="{value}"{"" if k else " checked"}><span>{words}</span>'
        "</label>"
        for k, (value, words) in enumerate(choices.items())
    )
    return f"<fieldset><legend>Colour by</legend>{radios}</fieldset>"


def _keys(name: str, more: str) -> str:
    return f'<details id="{name}"><summary>Mouse and keys</summary><p>{_CAMERA}{more}</p></details>'


def _swatch(kind: str) -> str:
    return f'<i class="swatch {kind}"></i>'


def _word(name: str) -> str:
    """Where the script writes a word of the scene."""
    return f'<span data-word="{name}"></span>'
