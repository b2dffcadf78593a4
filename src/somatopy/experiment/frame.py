"""What a session gives out: one frame after the other."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import NamedTuple

from somatopy.percept import Floats, Percept, Reading, Sighting

__all__ = ["PARTS", "Frame", "Sink"]

#: Parts of a frame whose time is taken.
PARTS = ("physics", "render", "detect", "babble", "damage", "learn")


class Frame(NamedTuple):
    """All that happened in one frame of 1/15 s.

    Attributes:
        number: frame of the experiment, from 0.
        phase: index of its phase.
        begins: whether the phase begins with it.
        ends: whether the phase ends with it.
        reading: what the body sensed at its start.
        sighting: what the eye found in it, or None on a miss.
        percept: what reached the learner, after the phase's interventions.
        target: the arm's target as the babbler gave it, shape (n_arm,), rad.
        gaze: the head's target as the learner gave it, shape (n_head,), rad.
        clipped: the same as the body took it, after interventions and clipping.
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
