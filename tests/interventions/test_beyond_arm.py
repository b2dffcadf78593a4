"""What is sensed besides the arm: head posture and picture."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from tests.interventions.damages import built, percept, postures

from somatopy.percept import Sighting

RNG = np.random.default_rng(0)


@pytest.mark.parametrize(("offset", "shift"), [(0.2, [0.2, 0.2]), ([0.1, -0.3], [0.1, -0.3])])
def test_a_head_offset_shifts_the_posture_and_not_the_command(offset: object, shift: list[float]) -> None:
    """Nothing else changes."""
    before = percept(postures(1)[0], sighting=Sighting((1.0, 2.0), 0, 30.0))
    after = built({"kind": "head-offset", "offset": offset}).sense(before, RNG)
    assert np.allclose(after.head - before.head, shift)
    assert after.head_command is before.head_command and after.arm is before.arm and after.arm_command is before.arm
    assert after.sighting == before.sighting


def test_a_mirrored_picture_keeps_the_middle_and_swaps_the_edges() -> None:
    """Rows, tag and area stay; mirrored twice is the identity; a miss stays a miss."""
    damage, arm = built("mirrored"), postures(1)[0]
    for u, mirrored in ((0.0, 319.0), (159.5, 159.5), (300.25, 18.75), (-4.0, 323.0)):
        before = percept(arm, sighting=Sighting((u, 33.0), 2, 400.0))
        after = damage.sense(before, RNG)
        assert before.sighting and after.sighting == replace(before.sighting, pixel=(mirrored, 33.0))
        assert damage.sense(after, RNG).sighting == before.sighting
        assert after.arm is before.arm and after.head is before.head
    assert damage.sense(percept(arm), RNG).sighting is None
