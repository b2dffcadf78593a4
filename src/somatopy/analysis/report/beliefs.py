"""Data of the report's pictures of what a learner knows: for each held-out arm posture the head's whole range."""

from __future__ import annotations

import base64
import io
from typing import Any

import numpy as np
from numpy.typing import NDArray

from somatopy.analysis.columns import readable
from somatopy.analysis.phases import phase_title
from somatopy.analysis.runs import Run
from somatopy.analysis.sight import Beliefs, beliefs_of
from somatopy.analysis.style import BEYOND, TREND
from somatopy.clock import FRAMES_PER_MINUTE
from somatopy.percept import Floats, Ints

__all__ = ["MOMENTS", "belief_panels", "moments"]

#: The page shows no more moments than this, spread evenly, so that its size stays bounded.
MOMENTS = 60
#: Steps of the shading between not at all and certain; the colour behind them is that of gazes out of reach.
LEVELS = 32
#: Width of a panel, and least and greatest height, in units of the drawing.
WIDTH, LEAST, MOST = 320.0, 56.0, 320.0

Grid = NDArray[Any]


def belief_panels(run: Run, summary: Any) -> dict[str, Any] | None:
    """Everything the page needs to draw what the learner believed at any moment.

    Of a head with one joint each panel is a strip; with three, the slice at the third angle of the predicted gaze.

    Args:
        run: an open run folder.
        summary: its summary.

    Returns:
        Plain data for JSON: `moments`, what to write of each; `panels`, for each arm posture its `title`, different
        `images` (PNG) and `outlines` (SVG paths), and at each moment which of them to show (`image`, `outline`) and
        where the gaze is (`mark`); `size` of a panel, `told`, and `axes` in words. None where nothing was noted.
    """
    beliefs = beliefs_of(run)
    if beliefs is None or not len(beliefs.frame):
        return None
    chosen = moments(len(beliefs.frame))
    width, height = _size(beliefs)
    return {
        "moments": [_words(beliefs, t, summary) for t in chosen],
        "panels": [_panel(run, beliefs, k, chosen, (width, height)) for k in range(len(beliefs.arms))],
        "size": [width, height],
        "told": beliefs.told,
        "axes": _axes(run, beliefs),
    }


def moments(count: int) -> list[int]:
    """Which of so many moments are shown, the first and the last among them."""
    spread = np.linspace(0, count - 1, min(MOMENTS, count)).round().astype(int)
    return list(map(int, np.unique(spread)))


def _words(beliefs: Beliefs, t: int, summary: Any) -> str:
    minutes = beliefs.frame[t] / FRAMES_PER_MINUTE
    return f"after {minutes:.4g} min, {phase_title(summary, int(beliefs.phase[t]))}"


def _panel(run: Run, beliefs: Beliefs, k: int, chosen: list[int], size: tuple[float, float]) -> dict[str, Any]:
    images: list[str] = []
    outlines: list[str] = []
    panel: dict[str, Any] = {
        "title": _posture(run, beliefs.arms[k]) or f"posture {k + 1}",
        "images": images,
        "outlines": outlines,
    }
    panel |= {"image": [], "outline": [], "mark": []}
    for t in chosen:
        depth = _depth(beliefs, beliefs.gaze[t, k])
        value = beliefs.belief[t, k] if beliefs.told else np.zeros(len(beliefs.heads))
        shade = _flat(beliefs, np.rint(value * (LEVELS / 255)), LEVELS + 1, depth)
        seen = _flat(beliefs, beliefs.seen[beliefs.phase[t], k], 0, depth)
        panel["image"].append(_place(images, _png(shade)))
        panel["outline"].append(_place(outlines, _outline(seen, size)))
        panel["mark"].append(_mark(beliefs, beliefs.gaze[t, k], size))
    return panel


def _place(found: list[str], text: str) -> int:
    """Where a text stands among different ones; it is added if it is new."""
    if text not in found:
        found.append(text)
    return found.index(text)


def _steps(beliefs: Beliefs, gaze: Floats) -> Floats:
    """Where a gaze is in the grid, in steps along each axis, not whole."""
    low, high = beliefs.limits.T
    steps: Floats = (gaze - low) / (high - low) * (np.array(beliefs.shape) - 1)
    return steps


def _depth(beliefs: Beliefs, gaze: Floats) -> int:
    """The slice of the third joint nearest to a gaze; 0 for heads with fewer joints."""
    return int(np.rint(_steps(beliefs, gaze)[2])) if len(beliefs.shape) > 2 else 0


def _flat(beliefs: Beliefs, values: Grid, beyond: int, depth: int) -> Grid:
    """Values of gazes as rows of a picture: the first joint to the right, the second up."""
    grid = np.full(int(np.prod(beliefs.shape)), beyond, np.int64)
    grid[beliefs.cells] = values
    across, up, *_ = (*beliefs.shape, 1)
    return grid.reshape(across, up, -1)[:, :, depth].T[::-1]


def _png(shade: Grid) -> str:
    """A small picture, one pixel a gaze."""
    from PIL import Image

    ends = [np.array([int(color[k : k + 2], 16) for k in (1, 3, 5)]) for color in ("#ffffff", TREND, BEYOND)]
    steps = [ends[0] + (ends[1] - ends[0]) * level / LEVELS for level in range(LEVELS + 1)]
    picture, file = Image.fromarray(shade.astype(np.uint8)), io.BytesIO()
    picture.putpalette(np.rint([*steps, ends[2]]).astype(np.uint8).ravel().tolist())
    picture.save(file, "PNG", optimize=True)
    return f"data:image/png;base64,{base64.b64encode(file.getvalue()).decode('ascii')}"


def _outline(seen: Grid, size: tuple[float, float]) -> str:
    """The edges between cells that see and cells that do not, as an SVG path."""
    rows, columns = seen.shape
    wide, high = size[0] / columns, size[1] / rows
    framed = np.pad(seen, 1)
    upright = [(r, c, c, r + 1) for r, c in np.argwhere(framed[1:-1, 1:] != framed[1:-1, :-1])]
    level = [(r, c, c + 1, r) for r, c in np.argwhere(framed[1:, 1:-1] != framed[:-1, 1:-1])]
    return "".join(f"M{c * wide:.4g} {r * high:.4g}L{x * wide:.4g} {y * high:.4g}" for r, c, x, y in upright + level)


def _mark(beliefs: Beliefs, gaze: Floats, size: tuple[float, float]) -> list[float]:
    """Where a gaze is in a panel."""
    steps = (*(_steps(beliefs, gaze) + 0.5), 0.5)[:2]
    across, up, *_ = (*beliefs.shape, 1)
    return [round(float(steps[0] / across * size[0]), 1), round(float((1 - steps[1] / up) * size[1]), 1)]


def _size(beliefs: Beliefs) -> tuple[float, float]:
    """Width and height of a panel: angles alike along both axes, as far as the page allows."""
    ranges: Ints = np.ptp(beliefs.limits, axis=1)
    height = WIDTH * ranges[1] / ranges[0] if len(ranges) > 1 else 0.0
    return WIDTH, round(float(np.clip(height, LEAST, MOST)), 1)


def _posture(run: Run, arm: Floats) -> str:
    """Names and values of the joints; "" where these were not recorded."""
    if len(run.joints("arm")) != len(arm):
        return ""
    shown = zip(run.joints("arm"), arm, run.units("arm"), strict=True)
    return ", ".join(f"{name} {_value(value, unit)}" for name, value, unit in shown)


def _axes(run: Run, beliefs: Beliefs) -> str:
    """What is drawn in which direction; "" where the joints were not recorded."""
    if len(run.joints("head")) != len(beliefs.limits):
        return ""
    told = zip(run.joints("head"), beliefs.limits, run.units("head"), strict=True)
    ranges = [f"{name} from {_value(low, unit)} to {_value(high, unit)}" for name, (low, high), unit in told]
    across = f"{ranges[0]} to the right"
    if len(ranges) == 1:
        return f"{across}."
    third = f" {run.joints('head')[2]} is as in the predicted gaze." if len(ranges) > 2 else ""
    return f"{across}, {ranges[1]} upwards.{third}"


def _value(value: float, unit: str) -> str:
    factor, sign = readable(unit)
    text = f"{factor * value:z.0f}{sign}" if sign == "°" else f"{factor * value:z.3f} {sign}".rstrip()
    return text.replace("-", "−")
