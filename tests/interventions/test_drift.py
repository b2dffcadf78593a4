"""An offset that grows: linear in time, and the same after a resumption."""

from __future__ import annotations

import numpy as np
from tests.interventions.damages import ARM, built, percept, postures

from somatopy.clock import FRAME
from somatopy.interventions import JointDrift
from somatopy.interventions.joints import scale

DRIFT = {"kind": "drift", "norm": 1.0, "minutes": 15}


def test_it_begins_at_nothing_and_grows_evenly() -> None:
    """Whenever its phase begins; 1 rad after 15 minutes, 2 after 30, in one direction, posture and command alike."""
    arm, rng = postures(1)[0], np.random.default_rng(0)
    for start in (0.0, 3600.0):
        damage = built(DRIFT)
        found = []
        for minutes in (0, 5, 15, 30):
            sensed = damage.sense(percept(arm, start + 60 * minutes), rng)
            assert np.array_equal(sensed.arm, sensed.arm_command)
            found.append((sensed.arm - arm) / scale(ARM))
        assert np.allclose(np.linalg.norm(found, axis=1), [0, 1 / 3, 1, 2])
        assert np.allclose(found, np.outer([0, 1 / 3, 1, 2], found[2]))


def test_it_has_no_jumps() -> None:
    """From frame to frame by 1 rad in 13,500 frames."""
    damage, rng, zero = built(DRIFT), np.random.default_rng(0), np.zeros(4)
    shifts = np.array([damage.sense(percept(zero, k * FRAME), rng).arm for k in range(200)]) / scale(ARM)
    assert np.allclose(np.linalg.norm(np.diff(shifts, axis=0), axis=1), 1 / 13_500)


def test_it_goes_on_from_a_state_and_never_back() -> None:
    """To the last bit; a posture that is asked of it at an earlier time is sensed as it is now."""
    rate, rng, zero = np.array([0.1, -0.2, 0.3, 0.0]), np.random.default_rng(0), np.zeros(4)
    whole, other = JointDrift(rate), JointDrift(rate)
    for k in range(10, 30):
        whole.sense(percept(zero, k * FRAME), rng)
    other.restore(whole.state())
    assert np.array_equal(other.sense(percept(zero, 0.0), rng).arm, rate * (29 * FRAME - 10 * FRAME))
    for k in range(30, 40):
        one, two = (damage.sense(percept(zero, k * FRAME), rng).arm for damage in (whole, other))
        assert one.tobytes() == two.tobytes()


def test_another_draw_goes_elsewhere() -> None:
    """As long, in another direction."""
    arms = []
    for draw in (0, 1):
        damage = built({**DRIFT, "draw": draw})
        damage.sense(percept(np.zeros(4), 0.0), np.random.default_rng())
        arms.append(damage.sense(percept(np.zeros(4), 900.0), np.random.default_rng()).arm / scale(ARM))
    assert np.allclose(np.linalg.norm(arms, axis=1), 1) and not np.allclose(*arms)
