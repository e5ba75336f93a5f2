"""A page that is one file: text, style, scripts and data, which asks nothing of a network and lets nothing in.

All that comes from outside, such as names of files, passes through `escape` into HTML and through JSON into data; a
Content-Security-Policy lets run the page's own scripts alone, known by their hashes, and forbids all connections.
"""

from __future__ import annotations

import json
import os
from base64 import b64encode
from collections.abc import Mapping
from dataclasses import dataclass, field
from hashlib import sha256
from html import escape
from importlib.resources import files
from pathlib import Path
from typing import Any

from .. import __version__
from ..errors import ArgumentError
from ..whole_file import write_text

_SUFFIXES = (".html", ".htm")


@dataclass(frozen=True)
class Page:
    """title: plain text. body: HTML in which all that came from outside is escaped. scripts: files of the folder page/,
    in the order in which they run. data: what they find as JSON in the element `data`."""

    title: str
    body: str
    scripts: tuple[str, ...] = ("page.js",)
    data: Mapping[str, Any] = field(default_factory=dict)


def write_page(page: Page, path: str | os.PathLike[str]) -> Path:
    """Writes a page, whole or not at all; returns the path. Raises ArgumentError where it cannot be written."""
    return write_text(rendered(page), checked_page_path(path))


def checked_page_path(path: str | os.PathLike[str]) -> Path:
    """The path, if a page can be written there; raises ArgumentError for another suffix or a missing folder."""
    path = Path(path)
    if path.suffix.lower() not in _SUFFIXES:
        raise ArgumentError(f"a report must end in .html, but is {str(path)!r}")
    if not path.absolute().parent.is_dir():
        raise ArgumentError(f"a report must lie in a folder that exists, but is {str(path)!r}")
    return path


def rendered(page: Page) -> str:
    """The whole page as text; the same for the same page."""
    style, scripts = part("page.css"), [part(name) for name in page.scripts]
    policy = (
        f"default-src 'none'; script-src {' '.join(map(_hash, scripts))}; style-src {_hash(style)}; img-src data:; "
        "base-uri 'none'; form-action 'none'"
    )
    blocks = "\n".join(f"<script>{script}</script>" for script in scripts)
    return f"""<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta http-equiv="Content-Security-Policy" content="{policy}">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="generator" content="fieldalign {__version__}">
<link rel="icon" href="data:,">
<title>{escape(page.title)}</title>
<style>{style}</style>
</head>
<body>
{page.body}
<script type="application/json" id="data">{_json(page.data)}</script>
{blocks}
</body>
</html>
"""


def head(title: str, kind: str, first: str) -> str:
    """What stands above the contents. first: the element to which the keyboard may skip."""
    return f"""<a class="skip" href="#{first}">Skip to the results</a>
<header>
<p class="kicker">fieldalign <span>{kind}</span>
<button id="theme" type="button" aria-label="Change between light and dark">◐</button></p>
<h1>{escape(title)}</h1>
</header>"""


def facts(values: Mapping[str, str]) -> str:
    """What one asks first, in large figures: name and value, both plain text."""
    cells = "".join(f"<div><dt>{escape(name)}</dt><dd>{escape(value)}</dd></div>" for name, value in values.items())
    return f'<dl class="facts">{cells}</dl>'


def foot(in_3d: bool = True) -> str:
    """What stands below."""
    drawn = "Views in 3D are drawn by three.js (MIT licence, in this file). " if in_3d else ""
    return f"""<footer><p>Made by fieldalign {__version__}. What the verdict means: docs/verdict.md. {drawn}This
page is complete: it asks nothing of a network.</p></footer>"""


def part(name: str) -> str:
    """The text of a file of the folder page/."""
    return files(__package__).joinpath("page", name).read_text(encoding="utf-8")


def _json(data: Mapping[str, Any]) -> str:
    """JSON that ends no script element, whatever it holds: neither </script> nor <!-- can stand in it."""
    return json.dumps(data, separators=(",", ":"), allow_nan=False).replace("<", "\\u003c")


def _hash(text: str) -> str:
    """How a Content-Security-Policy names an inline script or style."""
    return f"'sha256-{b64encode(sha256(text.encode('utf-8')).digest()).decode('ascii')}'"
