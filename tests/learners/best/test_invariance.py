"""The learner knows no robot: another description of the same one gives the same gazes.

A recorded life, with a damage at which surprise and schema act, is fed to two learners. What the second one is told is
described otherwise, and its inner values must be those of the first one, described so. What it asks of the head is laid
aside, and both get the recorded commands. docs/measure_invariance.py measures what no law says.
"""

from __future__ import annotations

import inspect
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from somatopy.learners import BestLearner
from somatopy.learners.best.memory import SURPRISE, UNITS
from somatopy.percept import Camera, Floats, Percept, Robot, Sighting, Space

FRAMES = 12_400  # of the recorded life
LOOKED_AT = (300, 4000, 12_000, 12_400)  # frames after which inner values are compared; the damage is after 12,000


@dataclass(frozen=True)
class Described:
    """Arm value k is sign[k] arm[order[k]] + zero[k], head value k is turn[k] head[k]; so many times as many pixels."""

    order: tuple[int, ...] = (0, 1, 2, 3)
    sign: tuple[float, ...] = (1, 1, 1, 1)
    zero: tuple[float, ...] = (0, 0, 0, 0)
    turn: tuple[float, ...] = (1, 1)
    finer: int = 1

    def arm(self, values: Floats) -> Floats:
        return np.array(self.sign) * values[list(self.order)] + np.array(self.zero)

    def head(self, values: Floats) -> Floats:
        return np.array(self.turn) * values

    def pixel(self, u: float, v: float) -> tuple[float, float]:
        """A pixel has its number in its middle."""
        return self.finer * (u + 0.5) - 0.5, self.finer * (v + 0.5) - 0.5

    def robot(self, arm_limits: Floats, head_limits: Floats) -> Robot:
        """The robot with limits of shape (n, 2), so described."""
        arm, head = (
            np.sort([say(limits[:, 0]), say(limits[:, 1])], axis=0)
            for say, limits in ((self.arm, arm_limits), (self.head, head_limits))
        )
        senses = {"arm": Space([f"joint{k}" for k in self.order], *arm), "head": Space(("yaw", "pitch"), *head)}
        return Robot(senses, ("head",), Camera("eye", 320 * self.finer, 240 * self.finer, fovy=0.83))

    def memory(self, held: dict[str, Any]) -> dict[str, Any]:
        """What a learner must hold that was told so, where the other one holds `held`; all but the polynomial."""
        order, sign, turn = list(self.order), np.array(self.sign), np.array(self.turn)
        flipped = tuple(int(axis) for axis in np.flatnonzero(turn < 0))
        count, m = int(held["numbers"][UNITS]), len(turn)
        pairs = [turn[k] * turn[other] for k in range(m) for other in range(k + 1, m)]
        psi = np.concatenate([[1.0], turn, np.ones(m), pairs])
        ends = np.flip(held["ends"], 2) if 0 in flipped else held["ends"]
        said: dict[str, Any] = {name: held[name] for name in ("numbers", "pixel", "stride", "reach", "scale", "used")}
        said |= {name: turn * held[name] for name in ("head", "bias", "drift", "asked", "turns")}
        postures = {"home": held["home"], "felt": held["felt"], "units": held["units"][:count]}
        said |= {name: np.where(sign < 0, 1 - x[..., order], x[..., order]) for name, x in postures.items()}
        said |= {name: np.flip(held[name].reshape(held["shape"]), flipped).ravel() for name in ("sheet", "recent")}
        said["shift"], said["speed"] = sign * held["shift"][order], held["speed"][order]
        said["gain"], said["fields"] = turn[:, None] * held["gain"], psi * held["fields"]
        said["extent"], said["apart"] = held["extent"][order], held["apart"][order]
        said["ends"] = np.stack([ends[0], -ends[1, ::-1] if 1 in flipped else ends[1]])
        return said


PLAIN = Described()
OTHERS = {
    "arm joints in another order": Described(order=(2, 0, 3, 1)),
    "an arm joint turned round": Described(sign=(1, -1, 1, 1)),
    "zeros of arm joints shifted": Described(zero=(0.7, 0, 0, -2.0)),
    "the head's yaw turned round": Described(turn=(-1, 1)),
    "the head's pitch turned round": Described(turn=(1, -1)),
    "a picture of 640 x 480": Described(finer=2),
}


@cache
def recording() -> dict[str, Any]:
    """Limits, and arm, target, head, command, clipped command and pixel of each frame."""
    with np.load(Path(__file__).parents[2] / "data" / "learner_s_hard.npz") as file:
        columns, limits, head_limits = file["columns"].tolist(), file["arm_limits"], file["head_limits"]
        frames = dict(zip(columns, file["frames"][:FRAMES].astype(float).T, strict=True))
    low, span = limits[:, 0], np.ptp(limits, axis=1)

    def all_of(*names: str) -> Floats:
        return np.column_stack([frames[name] for name in names])

    return {
        "limits": (limits.astype(float), head_limits.astype(float)),
        "arm": low + span * all_of("x0", "x1", "x2", "x3"),
        "target": low + span * all_of("t0", "t1", "t2", "t3"),
        "head": all_of("yaw", "pitch"),
        "asked": all_of("command_yaw", "command_pitch"),
        "clipped": all_of("clipped_yaw", "clipped_pitch"),
        "pixel": all_of("u", "v"),
    }


def percepts(told: Described) -> Iterator[tuple[Percept, Floats]]:
    """Each frame as it is told, and what was then asked of the head."""
    life = recording()
    for k in range(FRAMES):
        u, v = life["pixel"][k]
        sighting = None if np.isnan(u) else Sighting(told.pixel(u, v), 0, 400.0)
        arm, target = told.arm(life["arm"][k]), told.arm(life["target"][k])
        head, clipped = told.head(life["head"][k]), told.head(life["clipped"][max(k - 1, 0)])
        yield Percept(k / 15, arm, head, target, clipped, sighting), told.head(life["asked"][k])


def learner(told: Described) -> BestLearner:
    return BestLearner(told.robot(*recording()["limits"]), np.random.default_rng(0))


@cache
def lived(told: Described) -> tuple[Floats, list[dict[str, Any]]]:
    """Commands in each frame, shape (frames, 2), NaN before the first hit, and the states that are looked at."""
    own, commands, states = learner(told), np.full((FRAMES, 2), np.nan), []
    for k, (percept, asked) in enumerate(percepts(told)):
        own.observe(percept)
        if own.probes()["direction_error"] >= 0 or k > 100:
            commands[k] = own.gaze(percept)
        own._memory.asked[:] = asked
        if k + 1 in LOOKED_AT:
            states.append(own.state())
    return commands, states


@pytest.mark.parametrize("name", OTHERS)
def test_inner_values_are_those_of_the_other_description(name: str) -> None:
    """To 1e-7, through a damage, at which they are no longer what they were."""
    told = OTHERS[name]
    for one, other in zip(lived(PLAIN)[1], lived(told)[1], strict=True):
        held = dict(other["memory"])
        held["units"] = held["units"][: int(held["numbers"][UNITS])]
        for key, expected in told.memory(one["memory"]).items():
            np.testing.assert_allclose(held[key], expected, rtol=0, atol=1e-7, err_msg=key)
    assert one["memory"]["numbers"][SURPRISE] > 0.2 and np.abs(one["memory"]["shift"]).max() > 0.05


@pytest.mark.parametrize("name", OTHERS)
def test_commands_are_those_of_the_other_description(name: str) -> None:
    """To 1e-9, but where several gazes are equally good; then another of them may be the first."""
    told = OTHERS[name]
    apart = np.abs(told.head(lived(PLAIN)[0]) - lived(told)[0]).max(axis=1)
    assert np.isfinite(apart).mean() > 0.98
    assert (apart[np.isfinite(apart)] < 1e-9).mean() > 0.99
    one, other, arms = learner(PLAIN), learner(told), recording()["arm"][::120]
    for state, described in zip(lived(PLAIN)[1], lived(told)[1], strict=True):
        one.restore(state)
        other.restore(described)
        for arm in arms:
            gazes = [one.predict(arm), told.head(other.predict(told.arm(arm)))]
            believed = one.belief([arm], gazes)[0]
            assert believed[0] == pytest.approx(believed[1], abs=1e-9)


def test_it_is_made_of_a_robot_and_a_generator_alone() -> None:
    """And of the robot neither names nor the field of view make a difference, to the last bit."""
    assert list(inspect.signature(BestLearner).parameters) == ["robot", "rng"]
    robot = PLAIN.robot(*recording()["limits"])
    arm, head = (Space([f"{k}" for k in range(len(s))], s.lower, s.upper, "m") for s in (robot.arm, robot.head))
    unnamed = Robot({"arm": arm, "head": head}, (), replace(robot.camera, name="", fovy=2.0))
    one, other = (BestLearner(body, np.random.default_rng(0)) for body in (robot, unnamed))
    for k, (percept, _) in enumerate(percepts(PLAIN)):
        one.observe(percept)
        other.observe(percept)
        np.testing.assert_array_equal(one.gaze(percept), other.gaze(percept))
        if k == 500:
            break
