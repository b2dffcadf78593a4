"""The site builds without a warning, no link of it leads nowhere, a browser draws it; tutorials print what they say."""

from __future__ import annotations

import json
import os
import re
import runpy
import subprocess
import sys
from html.parser import HTMLParser
from pathlib import Path
from typing import Any
from urllib.parse import unquote, urldefrag

import pytest

import somatopy

ROOT = Path(__file__).parents[1]
TUTORIALS = sorted((ROOT / "examples" / "tutorials").glob("*.py"))
NUMBER = re.compile(r"[-+−]?\d[\d.,e+%-]*")
DRAWN = "return [...document.querySelectorAll('h1, article img, math')].map(part => part.getBoundingClientRect().width)"


class Links(HTMLParser):
    """What a page links to, and the places in it that can be linked to."""

    def __init__(self, page: Path) -> None:
        super().__init__()
        self.targets: list[str] = []
        self.places: set[str] = set()
        self.feed(page.read_text(encoding="utf-8"))

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        for name, value in attrs:
            if name in ("href", "src") and value is not None:
                self.targets.append(value)
            elif name == "id" and value:
                self.places.add(value)


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The site, built as `make docs` does."""
    folder = tmp_path_factory.mktemp("site")
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "--quiet", "--site-dir", str(folder)]
    env = {**os.environ, "NO_MKDOCS_2_WARNING": "1"}
    done = subprocess.run(command, cwd=ROOT, env=env, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return folder


@pytest.fixture(scope="module")
def pages(site: Path) -> dict[Path, Links]:
    """Every page of the site with its links; the page for what is not found has links from the root of a server."""
    return {page: Links(page) for page in site.rglob("*.html") if page.name != "404.html"}


def test_no_link_leads_nowhere(pages: dict[Path, Links]) -> None:
    """Each link within the site names a file that is there, and a place in it; pictures and scripts too."""
    assert len(pages) > 40
    broken = []
    for page, links in pages.items():
        for target in links.targets:
            address, place = urldefrag(target)
            if re.match(r"\w+:", target):
                continue
            file = (page.parent / unquote(address)).resolve() if address else page
            file = file / "index.html" if file.is_dir() else file
            if not file.is_file() or (place and file in pages and unquote(place) not in pages[file].places):
                broken.append(f"{page.name}: {target}")
    assert broken == []


def test_every_public_name_has_its_place_in_the_reference(site: Path, pages: dict[Path, Links]) -> None:
    """Under its own address, from which other projects can link to it."""
    places = {
        name.rsplit(".", 1)[-1] for page, links in pages.items() if page.parent == site / "api" for name in links.places
    }
    assert set(somatopy.__all__) - places == {"__version__"} & set(somatopy.__all__)


def test_nothing_of_a_docstrings_source_is_left(site: Path) -> None:
    """Formulas and sections are drawn: no role, no directive, no prompt outside a block of code."""
    text = "".join(page.read_text(encoding="utf-8") for page in (site / "api").glob("*.html"))
    assert "<math" in text and ":math:" not in text and ".. math::" not in text
    assert not re.search(r"<p>[^<]*(&gt;&gt;&gt;|Args:|Returns:|Raises:|Example:)", text)


@pytest.mark.browser
@pytest.mark.parametrize("page", ["index.html", "api/maps.html", "tutorials/first_map.html"])
def test_a_browser_draws_it_from_a_folder_and_fetches_nothing(browser: Any, site: Path, page: str) -> None:
    """Its title, each picture and each formula have an extent; every request is for a file."""
    browser.get((site / page).as_uri())
    messages = [json.loads(entry["message"])["message"] for entry in browser.get_log("performance")]
    requests = [note["params"]["request"]["url"] for note in messages if note["method"] == "Network.requestWillBeSent"]
    fetched = [url for url in requests if not url.startswith("chrome:")]  # the browser's own first page
    assert fetched and all(url.startswith(("file:", "data:", "blob:")) for url in fetched)
    widths = browser.execute_script(DRAWN)
    assert widths and min(widths) > 0
    severe = [entry["message"] for entry in browser.get_log("browser") if entry["level"] == "SEVERE"]
    assert [message for message in severe if "search" not in message] == []  # a search needs a server


def masked(text: str) -> list[str]:
    """The words of a page: numbers may differ between machines, and so may the widths of columns."""
    return NUMBER.sub("#", text).split()


@pytest.mark.parametrize("program", TUTORIALS, ids=lambda program: program.stem)
def test_a_tutorial_prints_what_its_page_says(program: Path, tmp_path: Path) -> None:
    """Words and code of the page are those of the program, to the letter; its output is, but for numbers."""
    make = runpy.run_path(str(ROOT / "docs" / "make_tutorials.py"))
    page = (ROOT / "docs" / "tutorials" / f"{program.stem}.md").read_text(encoding="utf-8")
    for words, text in make["cells_of"](program.read_text(encoding="utf-8")):
        assert (text if words else f"```python\n{text}\n```") in page
    assert masked(make["page_of"](program, tmp_path)) == masked(page)


def test_every_tutorial_is_listed() -> None:
    """On the first page of the tutorials, and in the navigation of the site."""
    listed = (ROOT / "docs" / "tutorials" / "README.md").read_text(encoding="utf-8")
    navigation = (ROOT / "mkdocs.yml").read_text(encoding="utf-8")
    assert len(TUTORIALS) >= 4
    for program in TUTORIALS:
        assert f"({program.stem}.md)" in listed and f"tutorials/{program.stem}.md" in navigation
