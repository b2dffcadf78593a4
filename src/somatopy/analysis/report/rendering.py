"""A page as text: a template with everything in it that it needs, so that nothing is fetched."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

__all__ = ["embeddable", "rendered"]

SCRIPTS = ("page.js", "beliefs.js", "table.js")


def rendered(template: str, content: Mapping[str, Any]) -> str:
    """Fill a template of this folder.

    Args:
        template: its file.
        content: what it asks for by name; styles and scripts are added.
    """
    from jinja2 import Environment, PackageLoader, StrictUndefined
    from plotly.offline import get_plotlyjs

    environment = Environment(
        loader=PackageLoader("somatopy.analysis", "report"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
    )
    folder = Path(__file__).parent
    css, *scripts = ((folder / name).read_text(encoding="utf-8") for name in ("page.css", *SCRIPTS))
    text = environment.get_template(template).render(
        **content, css=css, script="\n".join(scripts), plotly=get_plotlyjs()
    )
    return text.replace("@@SIZE@@", f"{len(text.encode()) / 1e6:.1f} MB")


def embeddable(value: Any) -> Any:
    """JSON that may stand inside a script element."""
    from markupsafe import Markup

    text = json.dumps(value, allow_nan=False, separators=(",", ":"))
    return Markup(text.replace("&", "\\u0026").replace("<", "\\u003c").replace(">", "\\u003e"))
