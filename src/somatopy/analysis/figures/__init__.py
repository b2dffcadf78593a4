"""Figures of a run: the paper's Figures 2 to 5, efficiency, misses and a filmstrip, as PNG and SVG.

matplotlib is imported when a figure is drawn.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from somatopy.analysis.figures.distortion import figure4, figure5
from somatopy.analysis.figures.efficiency import efficiency_figure
from somatopy.analysis.figures.filmstrip import Shot, filmstrip, filmstrip_frames
from somatopy.analysis.figures.hits import figure3
from somatopy.analysis.figures.maps import figure2
from somatopy.analysis.figures.misses import misses_figure
from somatopy.analysis.runs import Run
from somatopy.analysis.style import save

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = [
    "FIGURES",
    "Shot",
    "efficiency_figure",
    "figure2",
    "figure3",
    "figure4",
    "figure5",
    "filmstrip",
    "filmstrip_frames",
    "misses_figure",
    "save",
    "save_figures",
]

#: What is drawn of every run, by the name of its files; None where the run has nothing to draw.
FIGURES: dict[str, Callable[[Run], Figure | None]] = {
    "figure2": figure2,
    "figure3": figure3,
    "figure4": figure4,
    "figure5": figure5,
    "efficiency": efficiency_figure,
    "misses": misses_figure,
}


def save_figures(run: Run, shots: Sequence[Shot] = ()) -> dict[str, Path]:
    """Draw everything there is to draw into the run's figures/.

    Args:
        run: an open run folder.
        shots: pictures for the filmstrip, see `filmstrip_frames`; without any there is none.

    Returns:
        The PNG of each figure, by name; an SVG stands beside it.
    """
    figures = {name: draw(run) for name, draw in FIGURES.items()}
    figures["filmstrip"] = filmstrip(run, shots) if shots else None
    return {name: save(figure, run.path / "figures", name)[0] for name, figure in figures.items() if figure}
