"""What the site adds to MkDocs: pages from outside docs/, links to them, and formulas that need no JavaScript.

The pages of docs/ link to files of the repository, as readers on a forge expect. The site has a page for each of these
files, so that no link leaves it: Markdown becomes a page of its own, and code is shown as it is.
"""

from __future__ import annotations

import posixpath
import re
from pathlib import Path
from typing import Any

from latex2mathml.converter import convert
from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files

ROOT = Path(__file__).parents[1]
DOCS = "docs/"
#: Pages that the site has although no other page may link to them.
ALWAYS = ("README.md", "CONTRIBUTING.md", "CHANGELOG.md")
#: Pages that stand elsewhere on the site than in the repository.
MOVED = {"README.md": "index.md"}
#: The file of the repository that a page shows, by the page, where it is not the page itself.
SOURCES: dict[str, str] = {}
#: The target of a link or picture in Markdown, or in the HTML that some pages have.
LINK = re.compile(r"""(?<=\]\()[^)\s]+(?=[)\s])|(?:(?<=href=")|(?<=src="))[^"]+""")
FENCE = re.compile(r"^(```|~~~).*?^\1", re.MULTILINE | re.DOTALL)
FORMULA = re.compile(r'<(span|div) class="arithmatex">\\[(\[](.*?)\\[)\]]</\1>', re.DOTALL)
#: Files that the site copies as they are.
PICTURES = {".png", ".jpg", ".gif", ".svg", ".webp", ".mp4", ".parquet", ".npz"}
LANGUAGES = {".py": "python", ".toml": "toml", ".sh": "sh", ".xml": "xml", ".cff": "yaml", ".ipynb": "json"}


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add a page for every file of the repository that a page links to, and for those that these link to."""
    waiting = [*ALWAYS, *(DOCS + file.src_uri for file in files.documentation_pages())]
    done: set[str] = set()
    while waiting:
        source = waiting.pop()
        if source in done:
            continue
        done.add(source)
        if not source.startswith(DOCS):
            _add(files, config, source)
        if source.endswith(".md"):
            waiting += _outside(source)
    return files


def on_page_markdown(markdown: str, page: Any, **_: Any) -> str:
    """Let links point to where the site has what they name."""
    here = page.file.src_uri
    source = SOURCES.get(here, DOCS + here)
    return relinked(markdown, source, here) if source.endswith(".md") else markdown


def on_page_content(html: str, **_: Any) -> str:
    """Formulas as MathML, which browsers draw by themselves."""
    return FORMULA.sub(lambda found: _mathml(found[2], found[1] == "div"), html)


def relinked(markdown: str, source: str, here: str) -> str:
    """The text of a page whose links fit the site.

    Args:
        markdown: the text, from the file `source` of the repository.
        source: path of the file in the repository.
        here: path of its page on the site.
    """

    def moved(found: re.Match[str]) -> str:
        target, _, anchor = found[0].partition("#")
        if not target or ":" in target or not (ROOT / (path := _resolved(source, target))).exists():
            return found[0]
        there = posixpath.relpath(place_of(path), posixpath.dirname(here) or ".")
        return f"{there}#{anchor}" if anchor else there

    return _outside_fences(markdown, lambda text: LINK.sub(moved, text))


def place_of(path: str) -> str:
    """Where the site has a file of the repository: a page or, of pictures, the file itself."""
    if path.startswith(DOCS) and not path.endswith(".py"):
        return path.removeprefix(DOCS)
    if path in MOVED or Path(path).suffix in {".md", *PICTURES}:
        return MOVED.get(path, path)
    return f"source/{path}.md"


def _resolved(source: str, target: str) -> str:
    return posixpath.normpath(posixpath.join(posixpath.dirname(source), target))


def _outside_fences(markdown: str, change: Any) -> str:
    pieces, end = [], 0
    for fence in FENCE.finditer(markdown):
        pieces += [change(markdown[end : fence.start()]), fence[0]]
        end = fence.end()
    return "".join([*pieces, change(markdown[end:])])


def _outside(source: str) -> list[str]:
    """The files of the repository that a page names and that are not in docs/ as pages or pictures."""
    text = FENCE.sub("", (ROOT / source).read_text(encoding="utf-8"))
    targets = (found.partition("#")[0] for found in LINK.findall(text) if ":" not in found)
    named = (_resolved(source, target) for target in targets if target)
    return [path for path in named if (ROOT / path).exists() and DOCS + place_of(path) != path]


def _add(files: Files, config: MkDocsConfig, source: str) -> None:
    place = place_of(source)
    if Path(source).suffix in PICTURES:
        files.append(File.generated(config, place, abs_src_path=str(ROOT / source)))
        return
    text = (ROOT / source).read_text(encoding="utf-8") if source.endswith(".md") else _shown(source)
    SOURCES[place] = source
    files.append(File.generated(config, place, content=text))


def _shown(source: str) -> str:
    """A file as it is, or all that a folder has."""
    path = ROOT / source
    inside = [path] if path.is_file() else sorted(file for file in path.rglob("*") if file.suffix in LANGUAGES)
    blocks = [f"# {source}"]
    for file in inside:
        if file != path:
            blocks.append(f"## {file.relative_to(path).as_posix()}")
        blocks.append(f"````{LANGUAGES.get(file.suffix, 'text')}\n{file.read_text(encoding='utf-8')}\n````")
    return "\n\n".join(blocks) + "\n"


def _mathml(latex: str, block: bool) -> str:
    latex = latex.replace("&lt;", "<").replace("&gt;", ">").replace("&amp;", "&")
    return convert(latex, display="block" if block else "inline")
