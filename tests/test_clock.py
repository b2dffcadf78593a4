"""The clock: its numbers are those of the paper, and agree with each other."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

import somatopy
from somatopy.clock import DISTORTION_WIDTH, FRAME, FRAMES_PER_MINUTE, FRAMES_PER_SECOND, WINDOW

PACKAGE = Path(somatopy.__file__).parent
PARTS = (
    "analysis",
    "babbling",
    "bodies",
    "cli",
    "contract",
    "experiment",
    "eyes",
    "interventions",
    "learners",
    "links",
    "maps",
)


def test_frames_minutes_and_windows_agree_with_the_paper() -> None:
    """15 Hz; hits are counted in 5 minutes, 4,500 frames; distortion is a mean over 2 minutes, 1,800 inputs."""
    assert FRAMES_PER_SECOND == 15 and pytest.approx(1) == FRAME * FRAMES_PER_SECOND
    assert FRAMES_PER_MINUTE == 60 * FRAMES_PER_SECOND == 900
    assert WINDOW == 5 * FRAMES_PER_MINUTE == 4500
    assert DISTORTION_WIDTH == 2 * FRAMES_PER_MINUTE == 1800


def clock_numbers(source: str) -> Iterator[int]:
    """Lines on which the length of a window is a number, or something is divided or multiplied by 15.

    900 may be a minute, and may be anything else.
    """
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Constant) and type(node.value) is int and node.value in (1800, 4500):
            yield node.lineno
        if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Div | ast.Mult):
            factors = [side.value for side in (node.left, node.right) if isinstance(side, ast.Constant)]
            if 15 in factors:
                yield node.lineno


@pytest.mark.parametrize("part", PARTS)
def test_nowhere_else_is_the_clock_written_down(part: str) -> None:
    """No line of a part's code has the length of a frame or window as a number of its own."""
    files = sorted((PACKAGE / part).rglob("*.py"))
    found = [f"{path.relative_to(PACKAGE)}:{line}" for path in files for line in clock_numbers(path.read_text())]
    assert files and found == []


@pytest.mark.parametrize("line", ["width = 4500", "f(1_800)", "t = k / 15", "t = 1.0 / 15.0", "n = 15 * seconds"])
def test_a_clock_that_is_written_down_is_found(line: str) -> None:
    """Whole numbers of frames, with or without underscores, and sums with 15 Hz; nothing else."""
    assert list(clock_numbers(line)) == [1]
    assert list(clock_numbers("area = 900.0\nn = 15\ny = x / 150\ns = 'k / 15'")) == []
