"""The tutorials as pages: each program of examples/tutorials runs, and its words, code and output become a page.

usage: python docs/make_tutorials.py [NAME...]
"""

from __future__ import annotations

import contextlib
import io
import os
import re
import runpy
import shutil
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[1]
PROGRAMS = ROOT / "examples" / "tutorials"
PAGES = ROOT / "docs" / "tutorials"
#: What the program prints between two of its cells.
BORDER = "\x1e"
CELL = re.compile(r"^# %%(?P<words> \[markdown\])?\n", re.MULTILINE)
PICTURE = re.compile(r"!\[[^]]*\]\(([^)/]+)\)")


def cells_of(program: str) -> list[tuple[bool, str]]:
    """The cells of a program: whether each holds words, and its text.

    Example:
        >>> cells_of("# %% [markdown]\\n# # Title\\n#\\n# Words.\\n\\n# %%\\nprint(1)\\n")
        [(True, '# Title\\n\\nWords.'), (False, 'print(1)')]
    """
    _, *pieces = CELL.split(program)
    marks, texts = pieces[::2], pieces[1::2]
    return [(bool(mark), _words(text) if mark else text.strip()) for mark, text in zip(marks, texts, strict=True)]


def _words(text: str) -> str:
    return "\n".join(line.removeprefix("#").removeprefix(" ") for line in text.strip().splitlines())


def outputs_of(program: Path, folder: Path) -> list[str]:
    """Run a program in a folder; what each of its code cells printed, in order."""
    source = program.read_text(encoding="utf-8")
    marked = CELL.sub(lambda found: found[0] if found["words"] else f"{found[0]}print({BORDER!r}, end='')\n", source)
    copy = folder / program.name
    copy.write_text(marked, encoding="utf-8")
    printed = io.StringIO()
    with contextlib.redirect_stdout(printed), _inside(folder):
        runpy.run_path(str(copy), run_name="__main__")
    return [_without_ends(output) for output in printed.getvalue().split(BORDER)[1:]]


def _without_ends(output: str) -> str:
    """An output without empty lines around it, and without spaces at the ends of its lines."""
    return "\n".join(line.rstrip() for line in output.splitlines()).strip("\n")


def page_of(program: Path, folder: Path) -> str:
    """The page of a program, which runs in `folder` and leaves its pictures there."""
    outputs = iter(outputs_of(program, folder))
    blocks = []
    for words, text in cells_of(program.read_text(encoding="utf-8")):
        if words:
            blocks.append(text)
            continue
        blocks.append(f"```python\n{text}\n```")
        if output := next(outputs):
            blocks.append(f"```text\n{output}\n```")
    name = program.relative_to(ROOT).as_posix()
    blocks.append(f"*This page is the output of [`{name}`](../../{name}).*")
    return "\n\n".join(blocks) + "\n"


@contextlib.contextmanager
def _inside(folder: Path) -> Iterator[None]:
    before = Path.cwd()
    os.chdir(folder)
    try:
        yield
    finally:
        os.chdir(before)


def main(names: list[str]) -> None:
    for program in sorted(PROGRAMS.glob("*.py")):
        if names and program.stem not in names:
            continue
        with tempfile.TemporaryDirectory() as folder:
            page = page_of(program, Path(folder))
            for picture in PICTURE.findall(page):
                shutil.copy(Path(folder) / picture, PAGES / picture)
        (PAGES / f"{program.stem}.md").write_text(page, encoding="utf-8")
        print(f"wrote docs/tutorials/{program.stem}.md")


if __name__ == "__main__":
    main(sys.argv[1:])
