"""A run at a glance: what a notebook shows of it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from html import escape
from typing import Any

from somatopy.clock import FRAMES_PER_MINUTE

__all__ = ["run_html"]

_HEADS = ("phase", "damage", "minutes", "hand seen", "of what was possible")


def run_html(name: str, description: Mapping[str, Any], summary: Mapping[str, Any] | None) -> str:
    """A small table: a row for each phase of a run, with what came of it.

    Args:
        name: the run folder.
        description: experiment.toml as plain dictionaries.
        summary: summary.json; None while the run goes on.
    """
    parts = [f"seed {description.get('seed', '?')}"]
    parts += [f"{part} {kind}" for part in ("learner", "eye") if (kind := _kind(description.get(part)))]
    title = f"<b>{escape(str(description.get('name', 'run')))}</b>, {escape(', '.join(parts))}"
    ended = summary["phases"] if summary is not None else []
    rows = [_row(phase, ended[k] if k < len(ended) else {}) for k, phase in enumerate(description.get("phases", ()))]
    table = "".join(f"<tr>{''.join(f'<td>{escape(cell)}</td>' for cell in row)}</tr>" for row in rows)
    heads = "".join(f"<th>{head}</th>" for head in _HEADS)
    note = "" if summary is not None else "<br>No summary yet: the run goes on, or was stopped."
    return f"<div>{title}<table><tr>{heads}</tr>{table}</table><code>{escape(name)}</code>{note}</div>"


def _row(phase: Mapping[str, Any], ended: Mapping[str, Any]) -> Sequence[str]:
    frames = phase.get("frames", 0)
    return (
        str(phase.get("name", "")),
        str(ended.get("damage", "")),
        f"{frames / FRAMES_PER_MINUTE:g}",
        "" if ended.get("rate") is None else f"{ended['rate']:.1%}",
        _mean(ended.get("efficiency_per_window") or []),
    )


def _mean(windows: Sequence[float | None]) -> str:
    known = [window for window in windows if window is not None]
    return f"{sum(known) / len(known):.1%}" if known else ""


def _kind(part: Any) -> str:
    return str(part.get("kind", "")) if isinstance(part, Mapping) else ""
