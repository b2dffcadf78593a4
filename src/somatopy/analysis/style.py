"""The one visual language of figures and report: colours, line styles, type, and how figures are saved.

Everything stays apart in grey: lightness, widths, dashes and markers differ wherever hues do.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from somatopy.analysis.phases import kind_name
from somatopy.analysis.runs import writing
from somatopy.files import write_whole

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = [
    "BAND",
    "BEYOND",
    "BORDER",
    "CEILING",
    "CONTROLS",
    "HITS",
    "MAP",
    "MISSES",
    "NOTHING",
    "PAPER",
    "RUNNING",
    "RUNS",
    "TREND",
    "UNSEEN",
    "marks",
    "run_look",
    "save",
    "source",
    "style",
]

# Red, blue and green as in the paper.
HITS, TREND, BORDER, PAPER = "#e0453a", "#123a8c", "#2f9e44", "#7a7a7a"
BAND = "#dfe3ea"
#: What was counted over a running minute, behind what was counted over windows.
RUNNING = "#eea09a"
CEILING, UNSEEN = "#222222", "#ececec"
#: Lightness rises evenly, so that it reads in grey and without colour vision.
MAP = "cividis"
#: Light is where the hand is seen.
MISSES = "cividis_r"
#: Where nothing is known: no colour of a scale comes near. That of the misses has greys, that of beliefs ends in white.
NOTHING, BEYOND = "#ffffff", "#f2dfb8"

#: Letters of a name at a border to an inch.
LETTERS = 12.0

#: Colour, dashes and marker of the controls, in the order in which they score.
CONTROLS = (
    ("#5b4b8a", (6.0, 2.0), "s"),
    ("#8c6d1f", (2.0, 1.5), "^"),
    ("#4f7f86", (6.0, 1.5, 1.5, 1.5), "D"),
    ("#9a9a9a", (1.0, 1.2), "v"),
)
#: Colour and dashes of runs that are compared.
RUNS = (
    ("#e0453a", ()),
    ("#123a8c", (6.0, 2.0)),
    ("#2f9e44", (2.0, 1.5)),
    ("#b8860b", (6.0, 1.5, 1.5, 1.5)),
    ("#7b3fa0", (10.0, 3.0)),
    ("#008b8b", (1.0, 1.2)),
)
STYLE: Any = {
    "font.family": "DejaVu Sans",
    "font.size": 10.0,
    "axes.spines.top": False,
    "axes.titlesize": 11.0,
    "axes.titlelocation": "left",
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": "#e6e6e6",
    "grid.linewidth": 0.8,
    "legend.frameon": False,
    "legend.handlelength": 2.6,
    "text.parse_math": False,  # names may have $ in them, and nothing here is a formula
    "svg.hashsalt": "somatopy",
}


@contextmanager
def style() -> Iterator[None]:
    """Draw and save in the house style, whatever the user's own settings of matplotlib."""
    import matplotlib

    with matplotlib.rc_context():
        matplotlib.rcdefaults()  # a user's own settings must not change the bytes
        matplotlib.rcParams.update(STYLE)
        yield


def save(figure: Figure, folder: str | Path, stem: str) -> tuple[Path, Path]:
    """Write `stem`.png (150 dpi) and `stem`.svg into a folder, made if need be: same figure, same bytes.

    Each is written whole or not at all.

    Returns:
        The paths of both files.
    """
    png, svg = (Path(folder) / f"{stem}.{kind}" for kind in ("png", "svg"))
    with writing(png.parent):
        png.parent.mkdir(parents=True, exist_ok=True)
    with style(), writing(png):
        write_whole(png, lambda file: figure.savefig(file, format="png", dpi=150))
    with style(), writing(svg):
        figure.set_layout_engine(None)  # laid out once is enough, and it is half of the time
        write_whole(svg, lambda file: figure.savefig(file, format="svg", metadata={"Date": None}))
    return png, svg


def source(summary: Mapping[str, Any]) -> str:
    """What a figure must say of its run: learner, eye, motion (of bodies that have a choice), seed."""
    motion = summary["motion"]
    parts = [f"{kind_name(str(summary[part]))} {part}" for part in ("learner", "eye")]
    return ", ".join([*parts, *([f"{motion} motion"] if motion else []), f"seed {summary['seed']}"])


def run_look(index: int) -> tuple[str, tuple[float, ...]]:
    """Colour and dashes of one of several runs: of 36 no two are alike."""
    n = len(RUNS)
    return RUNS[index % n][0], RUNS[(index + index // n) % n][1]


def marks(axes: Axes, borders: Sequence[tuple[float, str]]) -> None:
    """Green lines at borders in time, with their names on top.

    A name that would overprint the one before stands one line lower. Draw them when the axis has its limits.
    """
    low, high = axes.get_xlim()
    figure: Any = axes.figure
    room = axes.get_position().width * figure.get_figwidth() * LETTERS
    ends: list[float] = []
    for at, text in sorted(borders):
        axes.axvline(at, color=BORDER, lw=1.4, zorder=1)
        width = (len(text) + 2) / room * (high - low)
        left = at < 0.85 * high
        start = at if left else at - width
        row = next((k for k, end in enumerate(ends) if end <= start), len(ends))
        ends[row:] = [start + width, *ends[row + 1 :]]
        look: Any = {"color": BORDER, "size": 9.0, "va": "top", "ha": "left" if left else "right"}
        shift = (4 if left else -4, -3 - 11 * row)
        axes.annotate(text, (at, 1.0), shift, ("data", "axes fraction"), "offset points", **look)
