"""A run beside what was possible and what ignorance would have scored: ceiling, reactive bound, controls."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from somatopy.analysis.bounds import ceiling_rates, reactive_efficiency
from somatopy.analysis.phases import kind_name, played
from somatopy.analysis.runs import Run
from somatopy.analysis.summary import summarise

__all__ = ["OWN", "Standing", "render_standings", "standings"]

OWN = "this run"
Rates = tuple[float | None, ...]


@dataclass(frozen=True)
class Standing:
    """What one learner scored, or could have scored, phase by phase.

    Attributes:
        name: "ceiling", "reactive bound", "this run", or a control's name.
        eye: which eye counted.
        rates: share of frames with the hand in view, one a phase; None for a phase without frames.
        efficiencies: the same relative to the phase's ceiling; None where there is no ceiling.
        summary: where the numbers come from; None for the bounds.
    """

    name: str
    eye: str
    rates: Rates
    efficiencies: Rates
    summary: Mapping[str, Any] | None = None


def standings(run: Run, summary: Mapping[str, Any] | None = None) -> list[Standing]:
    """The bounds, the run, and its controls from the best in the first phase that has frames to the worst.

    The controls have the run's seed, so its babbling, so its ceiling.

    Args:
        run: an open run folder.
        summary: its summary, if it is at hand.
    """
    summary = summary or summarise(run)
    phases = len(summary["phases"])
    limits = _padded(ceiling_rates(run)[1], phases)
    own = _standing(OWN, summary, limits)
    controls = [_standing(name, summarise(control), limits) for name, control in run.controls.items()]
    first = next(iter(played(summary["phases"])), 0)
    return [*_bounds(run, limits), own, *sorted(controls, key=lambda control: -(control.rates[first] or 0.0))]


def _bounds(run: Run, limits: Sequence[float | None]) -> list[Standing]:
    if not any(limits):
        return []
    eye = str((run.ceiling or {}).get("eye", "geometric"))
    found = [Standing("ceiling", eye, tuple(limits), tuple(None if limit is None else 1.0 for limit in limits))]
    if (share := reactive_efficiency(run)) is not None:
        rates = tuple(None if limit is None else share * limit for limit in limits)
        found.append(Standing("reactive bound", eye, rates, tuple(None if rate is None else share for rate in rates)))
    return found


def _standing(name: str, summary: Mapping[str, Any], limits: Sequence[float | None]) -> Standing:
    rates = _padded([phase["rate"] for phase in summary["phases"]], len(limits))
    shares = tuple(
        rate / limit if rate is not None and limit else None for rate, limit in zip(rates, limits, strict=True)
    )
    return Standing(name, kind_name(str(summary["eye"])), rates, shares, summary)


def _padded(rates: Sequence[float | None], phases: int) -> Rates:
    """One rate a phase: None where it is not known."""
    return tuple([*rates, *[None] * phases][:phases])


def render_standings(rows: Sequence[Standing], phases: Sequence[str]) -> str:
    """Rows as fixed-width text: share of frames with the hand seen, and of what was possible, phase by phase."""
    head = ["", "eye", *(f"{phase}: seen, of possible" for phase in phases)]
    lines = [head]
    for row in rows:
        cells = (f"{_percent(r):>8}{_percent(e):>8}" for r, e in zip(row.rates, row.efficiencies, strict=True))
        lines.append([row.name, row.eye, *cells])
    widths = [max(len(line[k]) for line in lines) for k in range(len(head))]
    return "\n".join("  ".join(cell.ljust(w) for cell, w in zip(line, widths, strict=True)).rstrip() for line in lines)


def _percent(share: float | None) -> str:
    return "n/a" if share is None else f"{100 * share:.1f} %"
