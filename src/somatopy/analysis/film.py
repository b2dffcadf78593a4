"""A film of a run: what is said of each of its frames, and how pictures and words are laid out."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from somatopy.analysis.figures.filmstrip import robot_time
from somatopy.analysis.phases import phase_title
from somatopy.analysis.runs import Run
from somatopy.analysis.style import BORDER, CEILING, HITS, PAPER, source
from somatopy.analysis.summary import summarise
from somatopy.clock import FRAMES_PER_MINUTE, FRAMES_PER_SECOND
from somatopy.percept import Floats, Image

if TYPE_CHECKING:
    import PIL.Image
    import PIL.ImageDraw
    import PIL.ImageFont

    from somatopy.experiment.film import Still

__all__ = ["INSIDE", "OUTSIDE", "SHEET", "Caption", "Narrator", "Sheet", "fitted"]

#: Width and height of the picture from outside, and of the box that holds what the eye sees, px.
OUTSIDE, INSIDE = (480, 480), (640, 480)
_GAP, _HEAD, _FOOT, _STRIP = 8, 48, 44, 84
#: Width and height of a film, px; both are even, as video asks for.
SHEET = (OUTSIDE[0] + _GAP + INSIDE[0], _HEAD + OUTSIDE[1] + _FOOT + _STRIP)

_FOUND = (230, 0, 126)  # the colour of outlines, which nothing else has
_INK, _PAPER, _EMPTY = "#222222", "white", (34, 34, 34)
#: Where the curve is drawn: left, top, right, bottom, px.
_CURVE = (64, SHEET[1] - _STRIP + 10, SHEET[0] - 20, SHEET[1] - 14)
#: Seconds of a phase before its running rate says anything.
_SOON = 5
_FINE = 2  # how many times as large the curve is drawn before it is made smaller


@dataclass(frozen=True)
class Caption:
    """What is said of one frame.

    Attributes:
        time: robot time.
        phase: number and state of its phase.
        rate: how often the hand was seen in the last minute of this phase.
        hit: whether it is seen now.
        pixel: the hand's centre (u, v) in the eye's picture, px, or None on a miss.
    """

    time: str
    phase: str
    rate: str
    hit: bool
    pixel: tuple[float, float] | None


class Narrator:
    """Says of each frame of a run when it was, and what had been seen by then.

    Args:
        run: an open run folder.

    Attributes:
        source: what was run: learner, eye, motion, seed.
        rates: share of hits in the minute up to each frame, as far as it lies in the frame's phase, shape (frames,).
        starts: the first frame of each phase, and the end of the last one.
        ceiling: share of frames in which the hand could have been seen, or None where nobody has computed it.

    Raises:
        RunFolderError: the folder is damaged.
    """

    def __init__(self, run: Run) -> None:
        summary = summarise(run)
        self._summary: Mapping[str, Any] = summary
        self.source, self.ceiling = source(summary), summary["ceiling_rate"]
        self.starts: list[int] = np.cumsum([0, *(phase["frames"] for phase in summary["phases"])]).tolist()
        self._hits = run.values("hit").astype(bool)
        self._pixels = np.column_stack([run.values("pixel_u"), run.values("pixel_v")])
        self._since = self._first_of_minute()
        counts = np.concatenate([[0], np.cumsum(self._hits)])
        ends = np.arange(1, len(self._hits) + 1)
        self.rates: Floats = (counts[ends] - counts[self._since]) / (ends - self._since)

    def phase_of(self, frame: int) -> int:
        """Index of the phase of a frame, among all phases of the description."""
        return int(np.searchsorted(self.starts[1:-1], frame, side="right"))

    def caption(self, frame: int) -> Caption:
        """What there is to say of a frame."""
        hit, (u, v) = bool(self._hits[frame]), self._pixels[frame]
        seconds = (frame + 1 - int(self._since[frame])) / FRAMES_PER_SECOND
        last = "minute" if seconds >= 60 else f"{seconds:.{int(seconds < 10)}f} s"
        return Caption(
            time=robot_time(frame),
            phase=phase_title(self._summary, self.phase_of(frame)),
            rate=f"hand seen in {self.rates[frame]:.0%} of the last {last}".replace("%", " %"),
            hit=hit,
            pixel=(float(u), float(v)) if hit and np.isfinite([u, v]).all() else None,
        )

    def _first_of_minute(self) -> NDArray[np.int64]:
        """Of each frame, the first frame that its running rate counts."""
        frames = np.arange(len(self._hits))
        begins = np.array(self.starts)[np.searchsorted(self.starts[1:-1], frames, side="right")]
        return np.asarray(np.maximum(begins, frames + 1 - FRAMES_PER_MINUTE))


class Sheet:
    """Lays out the frames of a film: the robot, what its eye sees, words below, and the running rate of the whole run.

    Args:
        narrator: of the run.
        title: the words above the pictures.
    """

    def __init__(self, narrator: Narrator, title: str) -> None:
        import PIL.Image
        import PIL.ImageDraw

        self._narrator = narrator
        self._blank = PIL.Image.new("RGB", SHEET, _PAPER)
        draw = PIL.ImageDraw.Draw(self._blank)
        draw.text((12, _HEAD / 2), title, _INK, _font(24), anchor="lm")
        left, _, right, bottom = _CURVE
        size = right - left, SHEET[1] - (_HEAD + OUTSIDE[1] + _FOOT)
        curve = _curve(narrator, (_FINE * size[0], _FINE * size[1])).resize(size, PIL.Image.Resampling.BOX)
        self._blank.paste(curve, (left, SHEET[1] - size[1]))
        draw.text((left - 8, _CURVE[1]), "100 %", PAPER, _font(15), anchor="rm")
        draw.text((left - 8, bottom), "0 %", PAPER, _font(15), anchor="rm")

    def frame(self, frame: int, still: Still) -> Image:
        """One frame of the film, shape (height, width, 3), RGB, of the size `SHEET`.

        Args:
            frame: which of the run it is.
            still: what it looked like.
        """
        import PIL.Image
        import PIL.ImageDraw

        caption, sheet = self._narrator.caption(frame), self._blank.copy()
        sheet.paste(PIL.Image.fromarray(_ringed(still)), (0, _HEAD))
        sheet.paste(PIL.Image.fromarray(_outlined(still, caption)), (OUTSIDE[0] + _GAP, _HEAD))
        draw = PIL.ImageDraw.Draw(sheet)
        self._say(draw, caption)
        self._point(draw, frame)
        return np.array(sheet)

    def _say(self, draw: PIL.ImageDraw.ImageDraw, caption: Caption) -> None:
        middle = _HEAD + OUTSIDE[1] + _FOOT / 2
        draw.text((12, middle), f"{caption.time}, {caption.phase}", _INK, _font(20), anchor="lm")
        draw.text((OUTSIDE[0] + _GAP + 12, middle), caption.rate, _INK, _font(20), anchor="lm")
        box = SHEET[0] - 116, middle - 15, SHEET[0] - 12, middle + 15
        draw.rounded_rectangle(box, 6, BORDER if caption.hit else HITS)
        draw.text((SHEET[0] - 64, middle), "seen" if caption.hit else "missed", "white", _font(20), anchor="mm")
        for x, words in ((10, "from outside"), (OUTSIDE[0] + _GAP + 10, "what its eye sees")):
            there = draw.textbbox((x, _HEAD + 8), words, _font(16))
            draw.rectangle((there[0] - 5, there[1] - 4, there[2] + 5, there[3] + 4), _PAPER)
            draw.text((x, _HEAD + 8), words, _INK, _font(16))

    def _point(self, draw: PIL.ImageDraw.ImageDraw, frame: int) -> None:
        """Show on the curve where the frame is."""
        left, top, right, bottom = _CURVE
        x = left + _along(frame, self._narrator) * (right - left)
        y = bottom - float(self._narrator.rates[frame]) * (bottom - top)
        draw.line((x, top - 6, x, bottom + 6), _INK, 1)
        draw.ellipse((x - 5, y - 5, x + 5, y + 5), HITS, "white")


def fitted(width: int, height: int) -> tuple[float, int, int]:
    """How a picture of any shape comes into the box `INSIDE`: by which factor it is enlarged, and its left and top, px.

    Example:
        >>> fitted(320, 240), fitted(640, 120)
        ((2.0, 0, 0), (1.0, 0, 180))
    """
    factor = min(INSIDE[0] / width, INSIDE[1] / height)
    return factor, round((INSIDE[0] - factor * width) / 2), round((INSIDE[1] - factor * height) / 2)


def _ringed(still: Still) -> Image:
    """The picture from outside, with a ring around the eye where only that tells where it is."""
    import cv2

    picture = still.outside.copy()
    if still.eye is not None:
        cv2.circle(picture, np.round(still.eye).astype(int).tolist(), 14, _FOUND, 2, cv2.LINE_AA)
    return picture


def _outlined(still: Still, caption: Caption) -> Image:
    """What the eye sees, in its box; on a hit with the tags outlined and a cross on the hand's centre."""
    import cv2

    height, width = still.inside.shape[:2]
    factor, left, top = fitted(width, height)
    size = round(factor * width), round(factor * height)
    picture = np.full((INSIDE[1], INSIDE[0], 3), _EMPTY, np.uint8)
    picture[top : top + size[1], left : left + size[0]] = cv2.resize(still.inside, size, interpolation=cv2.INTER_CUBIC)
    if caption.pixel is None:
        return picture
    shift = np.array([left, top])
    for corners in still.tags.values():
        outline = np.round(16 * (_enlarged(corners, factor) + shift)).astype(np.int32)  # in sixteenths of a pixel
        cv2.polylines(picture, [outline.reshape(-1, 1, 2)], True, _FOUND, 3, cv2.LINE_AA, 4)
    centre = np.round(_enlarged(np.array(caption.pixel), factor) + shift).astype(int).tolist()
    cv2.drawMarker(picture, centre, _FOUND, cv2.MARKER_CROSS, 17, 2)
    return picture


def _enlarged(pixels: Floats, factor: float) -> Floats:
    """Where pixels come to lie in a picture that is enlarged; whole numbers are the middles of pixels."""
    return np.asarray((pixels + 0.5) * factor - 0.5)


def _along(frame: int, narrator: Narrator) -> float:
    """Where a frame lies in the run, from 0 to 1."""
    return frame / max(1, narrator.starts[-1] - 1)


def _curve(narrator: Narrator, size: tuple[int, int]) -> PIL.Image.Image:
    """The running rate of the whole run, broken where a phase begins; green where it does, dotted the ceiling."""
    import PIL.Image
    import PIL.ImageDraw

    width, height = size
    low, high = height - _FINE * (SHEET[1] - _CURVE[3]), _FINE * (_CURVE[1] - (SHEET[1] - _STRIP))
    curve = PIL.Image.new("RGB", size, _PAPER)
    draw = PIL.ImageDraw.Draw(curve)
    for share in (0.0, 0.5, 1.0):
        draw.line((0, low + share * (high - low), width, low + share * (high - low)), "#e6e6e6", 2)
    if narrator.ceiling is not None:
        level = low + narrator.ceiling * (high - low)
        for left in range(0, width, 24):
            draw.line((left, level, left + 10, level), CEILING, 3)
    for start, stop in pairwise(narrator.starts):
        if 0 < start < stop:
            border = width * _along(start, narrator)
            draw.line((border, 0, border, height), BORDER, 4)
        told = _told(start, stop, width)
        points = [(width * _along(k, narrator), low + float(narrator.rates[k]) * (high - low)) for k in told]
        draw.line(points, HITS, 4, joint="curve")
    return curve


def _told(start: int, stop: int, width: int) -> list[int]:
    """The frames of a phase whose running rates are drawn: as many as can be told apart, none of its first seconds."""
    first = start + _SOON * FRAMES_PER_SECOND
    return np.unique(np.linspace(first, stop - 1, width // 2, dtype=int)).tolist() if first < stop else []


@cache
def _font(size: int) -> PIL.ImageFont.FreeTypeFont | PIL.ImageFont.ImageFont:
    import PIL.ImageFont

    return PIL.ImageFont.load_default(size)
