"""The site of these pages (`make docs`): Sphinx, which reads Markdown by MyST, and the docstrings as they are.

The pages stay plain Markdown that reads well without it. What they lack is added while they are read: the tree of
`index.md` from its own lists of links, and the docstrings of the names that `api.md` lists.
"""

import re
from importlib import import_module
from inspect import isclass, isroutine
from pathlib import Path
from types import ModuleType

import fieldalign

HERE = Path(__file__).parent

project = "fieldalign"
author = "The fieldalign developers"
copyright = "The fieldalign developers, MIT"
extensions = ["myst_parser", "sphinx.ext.autodoc"]
root_doc = "index"
source_suffix = {".md": "markdown"}
exclude_patterns = ["build"]
html_theme = "furo"
html_title = "fieldalign"
html_copy_source = html_show_sphinx = False
myst_heading_anchors = 3
autodoc_typehints = "none"  # the docstrings say what an argument is, with shapes and units
autodoc_member_order = "bysource"
maximum_signature_line_length = 90
highlight_language = "text"
smartquotes = False

NAME = r"[A-Za-z_]\w*"
OURS = re.compile(rf"\bfa\.({'|'.join(sorted(set(fieldalign.__all__) - {'fields'}, key=len, reverse=True))})\b")
LINK = r":py:obj:`fa.\1 <fieldalign.\1>`\ "
ITEM = re.compile(rf"({NAME}(?:, {NAME})*): (.+)")


def with_trees(text: str) -> str:
    """A page of lists of links, each section a tree of the pages that its links name; a last one of what it forgot."""
    forgotten = {page.stem for page in HERE.glob("*.md")} - {root_doc}
    trees = []
    for section in re.split(r"^## ", text, flags=re.MULTILINE)[1:]:
        pages = re.findall(r"^- \[.*?\]\((.+?)\.md\)", section, flags=re.MULTILINE)
        forgotten -= set(pages)
        trees.append(tree(pages, section.splitlines()[0]))
    return "\n".join([text, *trees, *([tree(sorted(forgotten), "More")] if forgotten else [])])


def tree(pages: list[str], caption: str) -> str:
    """A part of the navigation."""
    lines = "\n".join(pages)
    return f"```{{toctree}}\n:hidden:\n:caption: {caption}\n\n{lines}\n```\n"


def with_tables(text: str) -> str:
    """The page of the experiments, with those of their tables below it."""
    return f"{text}\n```{{toctree}}\n:hidden:\n:glob:\n\nexperiments/*\n```\n"


def found(name: str) -> object:
    """The object of a dotted name, through its packages' attributes."""
    parts = name.split(".")
    for k in range(len(parts) - 1, 0, -1):
        try:
            thing: object = import_module(".".join(parts[:k]))
        except ModuleNotFoundError:
            continue
        for part in parts[k:]:
            thing = getattr(thing, part)
        return thing
    raise ImportError(name)


def directive(name: str, said: str) -> str:
    """What shows a name with its docstring, or, where it is no class and no function, with what is said of it."""
    thing = found(name)
    if isinstance(thing, ModuleType):
        raise TypeError(f"{name} is a module; list what it holds")
    if isclass(thing):
        kind = "exception" if issubclass(thing, BaseException) else "class"
        options = "   :members:\n   :undoc-members:\n" if hasattr(thing, "__members__") else "   :members:\n"
        return f".. auto{kind}:: {name}\n{options}"
    return f".. autofunction:: {name}\n" if isroutine(thing) else f".. py:data:: {name}\n\n   {said}\n"


def titled(name: str, text: str) -> str:
    """A page with a heading: that of the list in `index.md`, where it has none (what benchmarks write)."""
    title = re.search(rf"\[(.+)\]\({name}\.md\)", (HERE / "index.md").read_text(encoding="utf-8"))
    return text if text.startswith("# ") or title is None else f"# {title[1]}\n\n{text}"


def with_downloads(name: str, text: str) -> str:
    """A page whose links to Markdown outside this folder are links to files: the site has no page of them."""
    def link(match: re.Match[str]) -> str:
        is_inside = (HERE / name).parent.joinpath(match[2]).resolve().is_relative_to(HERE)
        return match[0] if is_inside else f"{{download}}`{match[1]} <{match[2]}>`"

    return re.sub(r"\[`?([^\]`]+)`?\]\((\.\./[^)]+\.md)\)", link, text)


def with_docstrings(text: str) -> str:
    """A page of lists of names, each with its docstring."""
    return re.sub(r"^- `(fieldalign\.[\w.]+)`:? ?(.*)$", lambda m: f"```{{eval-rst}}\n{directive(m[1], m[2])}```\n",
                  text, flags=re.MULTILINE)


def as_rest(lines: list[str]) -> list[str]:
    """A docstring of ours, plain prose with `names` in it, as reStructuredText.

    Paragraphs that begin with "name: ..." or "name, name: ..." become lists of definitions.
    """
    lines = re.sub(r"`[^`]+`", lambda m: re.sub(r"\s+", " ", m[0]), "\n".join(lines)).split("\n")
    written: list[str] = []
    is_list = False
    for line, following in zip(lines, [*lines[1:], ""], strict=True):
        item = ITEM.fullmatch(line)
        if not line:
            is_list = False
            written.append("")
        elif line[0] != " " and line.endswith(":") and ITEM.fullmatch(following):  # the heading of some items
            is_list = False
            written += ["", inline(line), ""]
        elif item and (is_list or not written or not written[-1]):
            is_list = True
            terms = ", ".join(f"``{name}``" for name in item[1].split(", "))
            written += ["", terms, f"    {inline(item[2])}"]
        else:
            written.append(f"    {inline(line.strip())}" if is_list else inline(line))
    return written


def inline(line: str) -> str:
    """A line with its names marked, links to our names and pages, and nothing else that has a meaning."""
    pieces = re.split(r"(`[^`]+`)", line)
    for k, piece in enumerate(pieces):
        if k % 2:
            name = piece.strip("`")
            pieces[k] = OURS.sub(LINK, name) if OURS.fullmatch(name) else f"``{name}``"
        else:
            plain = re.sub(r"_(?!\w)|[*|\\]", r"\\\g<0>", piece)
            plain = re.sub(r"docs/([\w/-]+)\.md", r":doc:`\1 </\1>`", plain)
            pieces[k] = OURS.sub(LINK, plain)
    return "".join(pieces)


def setup(app) -> None:
    """Hangs the above into Sphinx."""
    changes = {"index": with_trees, "api": with_docstrings, "experiments": with_tables}

    def page(app, name, source) -> None:
        source[0] = changes.get(name, str)(with_downloads(name, titled(name, source[0])))

    def docstring(app, what, name, thing, options, lines) -> None:
        lines[:] = as_rest(lines)

    app.connect("source-read", page)
    app.connect("autodoc-process-docstring", docstring)
