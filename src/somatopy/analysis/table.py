"""The paper's numbers beside a run's: plain rows first, text or Markdown second."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

from somatopy.analysis.phases import beside_paper
from somatopy.analysis.series import in_shares
from somatopy.analysis.trends import Trend
from somatopy.clock import DISTORTION_WIDTH, WINDOW

__all__ = ["PAPER_TRENDS", "Cell", "Row", "comparison", "paper_lines", "render"]

Cell = tuple[float, ...] | str

# Slopes and intercepts as printed in section IV; how well they are determined, the paper does not say.
PAPER_TRENDS = (
    Trend(0, 38, 12.147, float("nan"), 2175.176),
    Trend(0, 6, -80.286, float("nan"), 2685.857),
    Trend(7, 20, 1.2154, float("nan"), 2255.264),
)
PAPER_FRAMES = (177_823, 96_049)
PAPER_HITS = 91_658

TOO_SHORT = "n/a (too short)"
NOT_RECORDED = "n/a (not recorded)"
OTHER_UNIT = " (cannot tell: the paper's is in [0, 1] units)"
NOT_REPORTED = "not reported"


@dataclass(frozen=True)
class Row:
    """One measure, as the paper reports it and as the run gives it.

    Attributes:
        part: which part of the protocol it belongs to.
        quantity: what is measured, with its unit.
        form: format of the numbers of a cell.
        paper: the paper's numbers, or what it says in words.
        run: the run's numbers, or why there are none.
        run_se: standard error of the run's (only) number.

    Example:
        >>> row = Row("phase 1", "slope", "{:+.1f}", (12.147,), (10.0,), run_se=2.04)
        >>> row.texts()
        ('+12.1', '+10.0 ± 2.0')
    """

    part: str
    quantity: str
    form: str
    paper: Cell
    run: Cell
    run_se: float | None = None

    def texts(self) -> tuple[str, str]:
        """Both cells as a reader sees them."""
        run = _text(self.form, self.run)
        if self.run_se is not None:
            run += " ± " + self.form.replace("+", "").format(self.run_se)
        return _text(self.form, self.paper), run


def comparison(
    summary: Mapping[str, Any], units: Mapping[str, str] | None = None, papers_robot: bool = True
) -> list[Row]:
    """Compare a run's summary with the paper, measure by measure.

    The run's first phase stands beside the paper's phase 1 and its second beside the paper's phase 2, however long
    they are; see `beside_paper`. Slopes are per window; fitted rates are those of the trend where its segment starts
    and ends.

    Args:
        summary: of the run.
        units: unit of each map's distances, see `distance_units`; [0, 1] units if None.
        papers_robot: whether the run is one of the paper's robot, so that its numbers are comparable.
    """
    arm, head = (_distortion_form((units or {}).get(side, "")) for side in ("arm", "head"))
    beside_number = head if head == _distortion_form("") or not papers_robot else head + OTHER_UNIT
    first, second = (None if k is None else summary["phases"][k] for k in beside_paper(summary["phases"]))
    part = ("phase 1, intact", "phase 2, after damage")
    return [
        *_counts(part[0], first, PAPER_FRAMES[0], (PAPER_HITS, 100 * PAPER_HITS / PAPER_FRAMES[0])),
        *_trend(part[0], first, 0, PAPER_TRENDS[0], PAPER_FRAMES[0]),
        _distortion(part[0], (first,), "arm", arm, "falls for 5 min, then level (Fig. 4)"),
        _distortion(part[0], (first,), "head", beside_number, "0.01 to 0.02 after 10 min (Fig. 5)"),
        *_counts(part[1], second, PAPER_FRAMES[1], NOT_REPORTED),
        *_trend("phase 2, degradation", second, 0, PAPER_TRENDS[1], None),
        *_trend("phase 2, re-adaptation", second, 1, PAPER_TRENDS[2], PAPER_FRAMES[1]),
        _distortion("phase 2, maps", (first, second), "arm", arm, "jumps, falls, then level (Fig. 4)"),
        _distortion("phase 2, maps", (first, second), "head", head, "no jump (Fig. 5)"),
    ]


def paper_lines(phases: Sequence[Mapping[str, Any]]) -> list[tuple[int, Sequence[Trend]]]:
    """The paper's trends by the index of the phase that they stand beside."""
    pairs = zip(beside_paper(phases), (PAPER_TRENDS[:1], PAPER_TRENDS[1:]), strict=True)
    return [(index, lines) for index, lines in pairs if index is not None]


def render(rows: Sequence[Row], form: Literal["text", "markdown"] = "text", paper: bool = True) -> str:
    """Lay the rows out for a terminal or for a Markdown page.

    Args:
        rows: from `comparison`.
        form: "text" or "markdown".
        paper: whether the paper's numbers stand beside the run's.

    Example:
        >>> print(render([Row("phase 1", "frames", "{:,.0f}", (177823,), "n/a (too short)")]))
                  paper    this run
        phase 1
          frames  177,823  n/a (too short)
    """
    layouts = {"text": _as_text, "markdown": _as_markdown}
    if form not in layouts:
        raise ValueError(f"form = {form!r} is unknown. Choose 'text' or 'markdown'.")
    lines = [["", "paper", "this run"]]
    for index, row in enumerate(rows):
        if index == 0 or row.part != rows[index - 1].part:
            lines.append([row.part, "", ""])
        lines.append([f"  {row.quantity}", *row.texts()])
    return layouts[form](lines if paper else [[name, run] for name, _, run in lines])


def _counts(part: str, phase: Mapping[str, Any] | None, paper_frames: int, paper_hits: Cell) -> list[Row]:
    frames: Cell = _missing(phase) if phase is None else (phase["frames"],)
    hits: Cell = (phase["hits"], 100 * phase["rate"]) if phase and phase["frames"] else _missing(phase)
    return [
        Row(part, "frames", "{:,.0f}", (paper_frames,), frames),
        Row(part, "frames with the hand detected", "{:,.0f} ({:.1f} %)", paper_hits, hits),
    ]


def _trend(part: str, phase: Mapping[str, Any] | None, index: int, paper: Trend, paper_frames: int | None) -> list[Row]:
    """`paper_frames`: the length of the paper's phase, if the segment is its last."""
    found = phase["trends"] if phase else []
    entry = found[index] if index < len(found) else None
    cells: tuple[Cell, Cell, Cell, Cell]
    if phase is None or entry is None:
        cells = (_missing(phase) if phase is None or index < len(found) else "n/a (no such trend)",) * 4
    else:
        cells = _trend_cells(Trend(**entry), phase["frames"] if entry is found[-1] else None)
    theirs = _trend_cells(paper, paper_frames)
    return [
        Row(part, "5-minute windows", "{:.0f}", theirs[0], cells[0]),
        Row(part, "slope, hits per window, per window", "{:+.3f}", theirs[1], cells[1], entry and entry["slope_se"]),
        Row(part, "intercept, hits per window", "{:.3f}", theirs[2], cells[2]),
        Row(part, "fitted rate, start to end", "{:.1f} % to {:.1f} %", theirs[3], cells[3]),
    ]


def _trend_cells(trend: Trend, phase_frames: int | None) -> tuple[Cell, Cell, Cell, Cell]:
    """Windows, slope, intercept, and the line's rates where the segment starts and ends."""
    end = trend.last + 1 if phase_frames is None else phase_frames / WINDOW
    rates = (100 * trend.at(0) / WINDOW, 100 * trend.at(end - trend.first) / WINDOW)
    return (trend.last - trend.first + 1,), (trend.slope,), (trend.intercept,), rates


def _distortion_form(unit: str) -> str:
    return "{:.4f}, {:.4f}, {:.4f}" + ("" if in_shares(unit) else f" {unit}")


def _distortion(part: str, phases: Sequence[Mapping[str, Any] | None], side: str, form: str, paper: str) -> Row:
    """`phases`: all up to the one whose distortion it is."""
    phase = phases[-1]
    marks = phase[f"{side}_distortion"] if phase else {"start": None}
    values = tuple(value for value in marks.values() if value is not None)
    behind = sum(earlier["frames"] for earlier in phases if earlier)
    run: Cell
    if len(values) == 3:
        run = values
    else:
        run = NOT_RECORDED if phase and phase["frames"] and behind >= DISTORTION_WIDTH else _missing(phase)
    return Row(part, f"{side} distortion: start, peak, end", form, paper, run)


def _missing(phase: Mapping[str, Any] | None) -> str:
    return "n/a (no such phase)" if phase is None else TOO_SHORT


def _text(form: str, cell: Cell) -> str:
    return cell if isinstance(cell, str) else form.format(*cell)


def _as_text(lines: Sequence[Sequence[str]]) -> str:
    widths = [max(map(len, column)) for column in zip(*lines, strict=True)]
    return "\n".join("  ".join(map(str.ljust, line, widths)).rstrip() for line in lines)


def _as_markdown(lines: Sequence[Sequence[str]]) -> str:
    named = [(f"**{name}**" if name and not any(cells) else name.strip(), *cells) for name, *cells in lines]
    head, *body = [f"| {' | '.join(line)} |" for line in named]
    return "\n".join([head, "|" + "---|" * len(lines[0]), *body])
