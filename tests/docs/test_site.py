"""The site of the documentation builds without a warning, every public name is in it, and links lead somewhere."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

import fieldalign as fa
from fieldalign import evaluation, fields, reports

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
PAGES = [*ROOT.glob("*.md"), *DOCS.glob("**/*.md")]


@pytest.fixture(scope="session")
def site(tmp_path_factory):
    pytest.importorskip("sphinx")
    pytest.importorskip("furo")
    folder = tmp_path_factory.mktemp("site")
    command = [sys.executable, "-m", "sphinx", "-W", "--keep-going", "-q", str(DOCS), str(folder)]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return folder


def test_site_shows_every_public_name_with_its_docstring(site):
    shown = (site / "api.html").read_text(encoding="utf-8")
    for name in set(fa.__all__) - {"fields", "PRESETS"}:
        assert f'id="fieldalign.{name}"' in shown, name
    assert 'id="fieldalign.PRESETS"' in shown
    assert "from any pose, without a guess or a length" in shown  # of register's docstring


def test_site_has_every_page(site):
    for page in DOCS.glob("**/*.md"):
        assert (site / page.relative_to(DOCS)).with_suffix(".html").is_file(), page


@pytest.mark.parametrize("package", [fa, fields, reports, evaluation], ids=lambda package: package.__name__)
def test_api_page_lists_every_public_name(package):
    listed = set(re.findall(r"^- `([\w.]+)`", (DOCS / "api.md").read_text(encoding="utf-8"), re.MULTILINE))
    own = set(package.__all__) - {"fields"} - (set() if package is fa else set(fa.__all__))
    assert {f"{package.__name__}.{name}" for name in own} <= listed


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_links_lead_to_files(page):
    for link in re.findall(r"\]\(([^)#\s]+)", page.read_text(encoding="utf-8")):
        if not re.match(r"\w+:", link):
            assert (page.parent / link).exists(), link
