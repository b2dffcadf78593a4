"""Docstrings as the site shows them: formulas and examples are written for Python's tools, and become Markdown."""

from __future__ import annotations

import re
import textwrap
from typing import Any

import griffe

BLOCK = re.compile(r"^( *)\.\. math::\n((?:\1 +\S.*\n?|\s*\n)+)", re.MULTILINE)
INLINE = re.compile(r":math:`([^`]+)`")
#: A heading that the parser of docstrings does not know by this name.
EXAMPLE = re.compile(r"^( *)Example:$", re.MULTILINE)


def as_markdown(docstring: str) -> str:
    """A docstring whose formulas are in dollars, and whose example is a section of its own.

    Example:
        >>> as_markdown("The rate :math:`a`.")
        'The rate $a$.'
    """
    text = BLOCK.sub(lambda found: _display(found[1], found[2]), docstring)
    return EXAMPLE.sub(r"\1Examples:", INLINE.sub(r"$\1$", text))


def _display(indent: str, formula: str) -> str:
    lines = "\n".join(line for line in textwrap.dedent(formula).strip().splitlines() if line.strip())
    return textwrap.indent(f"\n$$\n{lines}\n$$\n\n", indent)


class Docstrings(griffe.Extension):
    """Rewrites each docstring before it is parsed."""

    def on_instance(self, *, obj: griffe.Object, **_: Any) -> None:
        if obj.docstring is not None:
            obj.docstring.value = as_markdown(obj.docstring.value)
