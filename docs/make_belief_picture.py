"""Draw docs/img/belief.png, where a learner believes that the hand can be seen, and print the numbers beside it.

    somatopy run best --eye geometric --motion kinematic --out runs/best
    python docs/make_belief_picture.py runs/best

The picture is of the end of the first phase.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.image import AxesImage

from somatopy import load_run
from somatopy.analysis.sight import AGES, GAZES, Beliefs, Sight, beliefs_of, sight_of
from somatopy.analysis.style import BEYOND, HITS, style

PICTURE = Path(__file__).with_name("img") / "belief.png"
SCALE = 255  # beliefs are kept in 255ths


def picture(beliefs: Beliefs, moment: int) -> Figure:
    """A panel for each arm posture, in degrees of head yaw and pitch."""
    figure = Figure(figsize=(9.0, 5.4), layout="constrained")
    panels = figure.subplots(4, 2, sharex=True, sharey=True)
    for letter, posture, panel in zip("abcdefgh", range(8), panels.ravel(), strict=True):
        image = draw(panel, beliefs, moment, posture)
        panel.set_title(letter, loc="left", fontsize=10, pad=2)
    figure.supxlabel("head yaw (degrees)", fontsize=10)
    figure.supylabel("head pitch (degrees)", fontsize=10)
    figure.colorbar(image, ax=panels, label="chance to see the hand, as believed", shrink=0.6, pad=0.01)
    return figure


def draw(panel: Axes, beliefs: Beliefs, moment: int, posture: int) -> AxesImage:
    """Beliefs in blue, the truth outlined in red, the gaze in yellow, and what is out of reach in sand."""
    low, high = np.degrees(beliefs.limits).T
    extent = (low[0], high[0], low[1], high[1])
    believed = laid(beliefs, beliefs.belief[moment, posture] / SCALE)
    panel.set_facecolor(BEYOND)
    panel.grid(visible=False)
    image = panel.imshow(believed.T, "Blues", vmin=0, vmax=1, origin="lower", extent=extent, aspect="auto")
    seen = laid(beliefs, beliefs.seen[beliefs.phase[moment], posture].astype(float))
    fine = np.nan_to_num(np.kron(seen.T, np.ones((8, 8))))
    panel.contour(fine, [0.5], colors=HITS, linewidths=1.4, origin="lower", extent=extent)
    panel.plot(*np.degrees(beliefs.gaze[moment, posture]), "o", color="#ffd21f", markeredgecolor="black", markersize=6)
    return image


def laid(beliefs: Beliefs, values: np.ndarray) -> np.ndarray:
    """Values of gazes on the grid of head postures; NaN where the head cannot be."""
    grid = np.full(int(np.prod(beliefs.shape)), np.nan)
    grid[beliefs.cells] = values
    return grid.reshape(beliefs.shape)


def numbers(beliefs: Beliefs, sight: Sight) -> None:
    """What the page says of the run."""
    for name, shares in zip(("gazes that see the hand", "the others"), beliefs.agreement(), strict=True):
        said = (f"{frame / 900:.0f} min: {100 * share:.0f}" for frame, share in zip(beliefs.frame, shares, strict=True))
        print(f"believed rightly of {name}, %:", ", ".join(said))
    shares, (missed, frames) = sight.by_gazes(0), sight.by_age(0)
    print("missed, % of what can be seen:", dict(zip(GAZES, (100 * shares).round(1).tolist(), strict=True)))
    print("missed by age, %:", dict(zip(AGES, (100 * missed).round().tolist(), strict=True)), frames.tolist())


def main() -> None:
    """Draw and print."""
    run = load_run(sys.argv[1])
    beliefs, sight = beliefs_of(run), sight_of(run)
    if beliefs is None or sight is None:
        raise SystemExit(f"{run.path} does not say what its learner believed.")
    moment = int(np.flatnonzero(beliefs.phase == 0)[-1])
    with style():
        picture(beliefs, moment).savefig(PICTURE, dpi=130, metadata={"Software": None})
    numbers(beliefs, sight)


if __name__ == "__main__":
    main()
