"""Frames of a film: what is said of each follows from the record, and pictures and outlines lie where they belong."""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np
import pytest

from somatopy.analysis.film import INSIDE, OUTSIDE, SHEET, Narrator, Sheet, fitted
from somatopy.experiment.film import Still
from somatopy.percept import Image

FOUND = np.array([230, 0, 126])
LEFT, TOP = SHEET[0] - INSIDE[0], 48  # of the box with what the eye sees
HITS = [np.random.default_rng(k).random(count) < share for k, (count, share) in enumerate([(2000, 0.8), (1200, 0.4)])]


@pytest.fixture
def run(make_run: Any) -> Any:
    """33 hundred frames under two phases; where the hand was seen, its pixel is (40 + frame / 100, 30)."""
    seen = np.concatenate(HITS)
    u = np.where(seen, 40 + np.arange(len(seen)) / 100, np.nan)
    return make_run(*HITS, distances={"pixel_u": u, "pixel_v": np.where(seen, 30.0, np.nan)})


def still(size: tuple[int, int] = (320, 240), **more: Any) -> Still:
    """Noise from outside and through the eye, without magenta."""
    rng = np.random.default_rng(3)
    pictures = [rng.integers(0, 99, (height, width, 3), np.uint8) for width, height in (OUTSIDE, size)]
    return Still(pictures[0], None, pictures[1], {}, **more)


def inside(sheet: Image) -> Image:
    return sheet[TOP : TOP + INSIDE[1], LEFT : LEFT + INSIDE[0]]


def magenta(picture: Image) -> np.ndarray:
    """Places (x, y) that are drawn in the colour of outlines."""
    rows, columns = np.nonzero(np.abs(picture.astype(int) - FOUND).max(axis=2) < 25)
    return np.column_stack([columns, rows])


def test_the_running_rate_is_that_of_the_last_minute_in_the_phase(run: Any) -> None:
    """Counted one by one: 900 frames at most, none of the phase before."""
    narrator, seen = Narrator(run), np.concatenate(HITS)
    assert narrator.starts == [0, 2000, 3200]
    for frame in (0, 1, 899, 900, 1999, 2000, 2001, 2950, 3199):
        first = max(0 if frame < 2000 else 2000, frame - 899)
        assert narrator.rates[frame] == pytest.approx(np.mean([bool(seen[k]) for k in range(first, frame + 1)]))
        assert narrator.phase_of(frame) == (frame >= 2000)


def test_captions_say_when_and_what(run: Any) -> None:
    """Robot time, phase, rate and the recorded pixel; the rate of a young phase says how long it counts."""
    narrator = Narrator(run)
    late, young = narrator.caption(1899), narrator.caption(2029)
    assert (late.time, late.phase) == ("2 min 06.6 s", "phase 1, intact")
    assert late.rate == f"hand seen in {np.mean(HITS[0][1000:1900]):.0%} of the last minute".replace("%", " %")
    assert young.phase == "phase 2, damaged (offset)" and young.rate.endswith("% of the last 2.0 s")
    for frame in (5, 6, 7, 8, 2500, 2501, 2502):
        caption = narrator.caption(frame)
        assert caption.hit == np.concatenate(HITS)[frame]
        assert caption.pixel == ((40 + frame / 100, 30.0) if caption.hit else None)


def test_pictures_stand_side_by_side_untouched(run: Any) -> None:
    """On a miss: from outside as it is, and the eye's picture as it is, but enlarged; above them are labels."""
    frame, shown = int(np.flatnonzero(~HITS[0])[0]), still()
    sheet = Sheet(Narrator(run), "A title").frame(frame, shown)
    assert sheet.shape == (SHEET[1], SHEET[0], 3) and sheet.dtype == np.uint8
    assert SHEET[0] % 2 == 0 and SHEET[1] % 2 == 0
    assert np.array_equal(sheet[TOP + 40 : TOP + OUTSIDE[1], : OUTSIDE[0]], shown.outside[40:])
    enlarged = cv2.resize(shown.inside, INSIDE, interpolation=cv2.INTER_CUBIC)
    assert np.array_equal(inside(sheet)[40:], enlarged[40:])


@pytest.mark.parametrize("size", [(320, 240), (480, 160), (100, 300)])
def test_outline_and_cross_lie_where_the_marker_is(run: Any, size: tuple[int, int]) -> None:
    """In a picture of any shape: outlines on the corners, the cross on the recorded pixel; neither on a miss."""
    frames = [int(np.flatnonzero(HITS[0] == hit)[5]) for hit in (True, False)]
    corners = np.array([[60.0, 50.0], [90.0, 55.0], [85.0, 80.0], [62.0, 75.0]])
    shown, narrator = still(size), Narrator(run)
    shown.tags[2] = corners
    sheet = Sheet(narrator, "A title")
    factor, left, top = fitted(*size)
    places = magenta(inside(sheet.frame(frames[0], shown)))
    pixel = np.array(narrator.caption(frames[0]).pixel)
    for point in (*corners, pixel, 0.5 * (corners[0] + corners[1])):
        nearest = np.linalg.norm(places - (factor * (point + 0.5) - 0.5 + [left, top]), axis=1).min()
        assert nearest <= 1.5
    near = np.linalg.norm(places - (factor * (pixel + 0.5) - 0.5 + [left, top]), axis=1) < 12
    cross = places[near]
    assert (
        np.abs(0.5 * (cross.min(axis=0) + cross.max(axis=0)) - (factor * (pixel + 0.5) - 0.5 + [left, top])).max() <= 1
    )
    assert len(magenta(inside(sheet.frame(frames[1], shown)))) == 0


def test_a_picture_of_another_shape_is_whole_and_in_the_middle() -> None:
    """As large as the box allows, its shape kept, its rest even on both sides."""
    for width, height in ((320, 240), (640, 120), (100, 300), (1920, 1080)):
        factor, left, top = fitted(width, height)
        assert factor * width <= INSIDE[0] + 1e-9 and factor * height <= INSIDE[1] + 1e-9
        assert min(left, top) == 0
        assert abs(2 * left + factor * width - INSIDE[0]) <= 1 and abs(2 * top + factor * height - INSIDE[1]) <= 1


def test_the_eye_is_ringed_only_where_its_place_is_told(run: Any) -> None:
    """A ring around that pixel of the picture from outside."""
    sheet, shown = Sheet(Narrator(run), "A title"), still()
    frame = int(np.flatnonzero(~HITS[0])[0])
    outside = (slice(TOP, TOP + OUTSIDE[1]), slice(0, OUTSIDE[0]))
    assert len(magenta(sheet.frame(frame, shown)[outside])) == 0
    ringed = Still(shown.outside, np.array([200.0, 150.0]), shown.inside, {})
    ring = magenta(sheet.frame(frame, ringed)[outside])
    assert np.abs(np.linalg.norm(ring - [200, 150], axis=1) - 14).max() < 3 and len(ring) > 40
