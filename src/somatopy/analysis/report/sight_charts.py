"""The report's plots of what a learner knows, and of what it misses that could have been seen."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from somatopy.analysis.phases import phase_title
from somatopy.analysis.report.plots import over_time, plain_figure
from somatopy.analysis.runs import Run
from somatopy.analysis.series import borders, phase_starts
from somatopy.analysis.sight import AGES, GAZES, Sight, beliefs_of, sight_of
from somatopy.analysis.style import HITS, PAPER, TREND
from somatopy.clock import WINDOW
from somatopy.percept import Floats

if TYPE_CHECKING:
    from plotly.graph_objects import Figure

__all__ = ["ages_chart", "agreement_chart", "gazes_chart"]

#: Looks of the first and of the last phase.
LOOKS = (TREND, HITS)
#: What grows above all others is cut off at so many times the next, and its number is written there.
CUT = 1.25


def agreement_chart(run: Run, summary: Mapping[str, Any]) -> Figure | None:
    """How well beliefs agree with the truth, phase by phase; None where no belief was noted."""
    beliefs = beliefs_of(run)
    if beliefs is None or not beliefs.told or not len(beliefs.frame):
        return None
    figure, at, (sees, does_not) = plain_figure(320), beliefs.frame / WINDOW, beliefs.agreement()
    looks = {
        "balanced accuracy": ((sees + does_not) / 2, {"color": HITS, "width": 2.6}),
        "of gazes that see the hand": (sees, {"color": TREND, "width": 1.4}),
        "of gazes that do not": (does_not, {"color": PAPER, "width": 1.4, "dash": "dash"}),
    }
    for name, (share, line) in looks.items():
        x, y = _broken(at, 100 * share, (np.flatnonzero(np.diff(beliefs.phase)) + 1).tolist())
        figure.add_scatter(
            x=x, y=y, name=name, mode="lines+markers", line=line, marker={"size": 5}, hovertemplate="%{y:.0f} %"
        )
    figure.update_yaxes(title_text="believed what is true (%)", range=[0, 102])
    return over_time(figure, phase_starts(summary["phases"])[-1], borders(summary["phases"]))


def gazes_chart(run: Run, summary: Mapping[str, Any]) -> Figure | None:
    """From how many gazes the hand can be seen where it is missed, first phase beside last; None if nobody counted."""
    found = _phases(run)
    if not found:
        return None
    shares = {p: 100 * sight.by_gazes(p) for p, sight in found.items()}
    figure = _bars(summary, shares, _classes(GAZES))
    top = CUT * max([float(values[1:].max()) for values in shares.values()] + [1.0])
    figure.update_yaxes(title_text="misses per 100 frames in which<br>the hand can be seen", range=[0, top])
    if any(values[0] > top for values in shares.values()):
        text = " and ".join(f"{values[0]:.0f}" for values in shares.values())
        figure.add_annotation(x="0", y=top, text=f"up to {text}", yanchor="top", bgcolor="white", showarrow=False)
    grid = next(iter(found.values())).grid
    figure.update_xaxes(title_text=f"gazes that see the hand, of {grid:,}", type="category")
    return figure


def ages_chart(run: Run, summary: Mapping[str, Any]) -> Figure | None:
    """How often the hand is missed by how long it has been visible, first phase beside last; None if nobody counted."""
    found = _phases(run)
    if not found:
        return None
    shares = {p: 100 * sight.by_age(p)[0] for p, sight in found.items()}
    figure = _bars(summary, shares, _classes(AGES))
    figure.update_yaxes(title_text="missed (%)", rangemode="tozero")
    figure.update_xaxes(title_text="frames since the hand became visible", type="category")
    return figure


def _phases(run: Run) -> dict[int, Sight]:
    """What was looked at in each phase."""
    sight = sight_of(run)
    return {int(phase): sight for phase in np.unique(sight.phase)} if sight is not None else {}


def _bars(summary: Mapping[str, Any], shares: Mapping[int, Floats], names: Sequence[str]) -> Figure:
    figure = plain_figure(320)
    for (phase, values), color in zip(shares.items(), LOOKS, strict=False):
        known = [round(float(value), 3) if np.isfinite(value) else None for value in values]
        figure.add_bar(
            x=names,
            y=known,
            name=phase_title(summary, phase),
            marker={"color": color, "pattern": {"shape": "" if color == LOOKS[0] else "/"}},
            hovertemplate="%{y:.1f}",
        )
    figure.update_layout(barmode="group", bargap=0.3, showlegend=True)
    return figure


def _classes(least: Sequence[int]) -> list[str]:
    """What to call classes that begin with these numbers.

    Example:
        >>> _classes((0, 1, 5))
        ['0', '1–4', '5+']
    """
    ends = [str(a) if b == a + 1 else f"{a}–{b - 1}" for a, b in pairwise(least)]
    return [*ends, f"{least[-1]}+"]


def _broken(at: Floats, values: Floats, cuts: Sequence[int]) -> tuple[list[float], list[float | None]]:
    """A line with gaps before the points named: None breaks it."""
    x, y = list(map(float, at)), [float(v) if np.isfinite(v) else None for v in values]
    for cut in sorted(cuts, reverse=True):
        x.insert(cut, x[cut])
        y.insert(cut, None)
    return x, y
