"""The frame: what a session yields for each 1/15 s of robot time."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import NamedTuple

from somatopy.percept import Floats, Percept, Reading, Sighting

__all__ = ["PARTS", "Frame", "Sink"]

#: Parts of a frame whose time is taken.
PARTS = ("physics", "render", "detect", "babble", "damage", "learn")


class Frame(NamedTuple):
    """Everything that happened in one frame of 1/15 s.

    Attributes:
        number: number of the frame in the experiment, from 0.
        phase: index of its phase.
        begins: whether it is the first frame of the phase.
        ends: whether it is the last frame of the phase.
        reading: what the body sensed at the start of the frame.
        sighting: what the eye found, or None on a miss.
        percept: what the learner was told, after the phase's interventions.
        target: the arm's target as the babbler gave it, shape (n_arm,), rad.
        gaze: the head's target as the learner gave it, shape (n_head,), rad.
        clipped: the head's target as the body took it, after interventions and clipping, shape (n_head,), rad.
        probes: values of the columns that eye, learner and interventions declare, by name.
        seconds: wall time of each of `PARTS`.
    """

    number: int
    phase: int
    begins: bool
    ends: bool
    reading: Reading
    sighting: Sighting | None
    percept: Percept
    target: Floats
    gaze: Floats
    clipped: Floats
    probes: Mapping[str, float]
    seconds: Mapping[str, float]


Sink = Callable[[Frame], object]
