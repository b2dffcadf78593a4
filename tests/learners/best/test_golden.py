"""The learner's equations against a recorded life of the program that they were first tried in.

`learner_s.npz` is the beginning of a life in the mechanical range; `learner_s_hard.npz` goes on through a damage that
permutes and shifts all arm joints, and through minutes without any sight of the hand, so that surprise, schema and
being lost all act. Its sheet had 31 x 27 cells and a fixed reach, its pixels were divided by 100, it blurred the
evidence by [1 2 1] / 4 on both axes before it chose, and let bias learn from all moves. All its monomials learned
alike, visibility had no polynomial, the pixel gain learned from movements of head and image alone, the map measured
distances by the limits of the joints, directions learned at one rate, and nothing was forgotten. Here blur and pixel
gain stand in the test. After each frame the test takes back what metric and polynomial have learned, how far the arm
moves, how long all has been calm, and that a surprise lasts.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.ndimage import convolve1d

from somatopy.learners.best.action import best_gaze
from somatopy.learners.best.calibration import learn_bias, learn_ends, learn_speed
from somatopy.learners.best.directions import NEAREST, active, direction, powers
from somatopy.learners.best.frame import PARTS, live
from somatopy.learners.best.memory import CALM, HITS, LASTING, SURPRISE, UNITS, Memory, fresh
from somatopy.learners.best.schema import CALM_HITS
from somatopy.learners.best.visibility import evidence
from somatopy.percept import Camera, Floats, Robot, Space

DATA = Path(__file__).parents[2] / "data"
REST = np.array([part != "calibration" for part in PARTS])


def as_recorded(arm_limits: Floats, head_limits: Floats) -> Memory:
    """A fresh memory with the recorded program's sheet; it is given arm postures in [0, 1] units."""
    arm, head = Space(tuple("abcd"), *arm_limits.T), Space(("yaw", "pitch"), *head_limits.T)
    memory = fresh(Robot({"arm": arm, "head": head}, ("head",), Camera("eye", 320, 240, fovy=0.83)))
    return memory._replace(
        shape=np.array([31, 27]),
        reach=np.array([0.75, 0.65]),
        scale=np.array([0.5, 0.4]),
        sheet=np.zeros(31 * 27),
        recent=np.zeros(31 * 27),
        stride=np.full(2, np.inf),
        low=np.zeros(4),
        span=np.ones(4),
    )


def calibrate(memory: Memory, x: Floats, head: Floats, command: Floats, pixel: Floats) -> None:
    """The calibration, with the recorded program's pixel gain: G += .05 e dp' / (|dp|^2 + .02), e = -dy - G dp."""
    learn_bias(memory, head, command)
    learn_ends(memory, command)
    learn_speed(memory, x)
    turn, slip = head - memory.head, pixel - memory.pixel
    if not np.isnan(slip).any() and np.linalg.norm(turn) > 0.05:
        error = -turn - memory.gain @ slip
        memory.gain[:] += 0.05 * np.outer(error, slip) / (slip @ slip + 0.05 / 2.56)


def command_of(memory: Memory) -> Floats:
    """The command, with the recorded program's blur."""
    most = np.maximum(memory.speed, 0)
    x = memory.felt[0] + np.clip(memory.felt[1] - memory.felt[0], -most, most)
    index, share = np.empty(NEAREST, np.int64), np.empty(NEAREST)
    found = active(memory.units, memory.extent, int(memory.numbers[UNITS]), x, index, share)
    phi, centre, command = np.empty(memory.plane.shape[1]), np.empty(2), np.empty(2)
    powers(x, phi)
    direction(memory.plane, memory.turns, phi, index, share, found, centre)
    field = evidence(memory, True, phi, index, share, found).reshape(31, 27)
    for axis in (0, 1):
        field = convolve1d(field, [0.25, 0.5, 0.25], axis, mode="nearest")
    best_gaze(memory, centre + memory.drift, field.ravel(), command)
    return command


@pytest.mark.parametrize("name", ["learner_s", "learner_s_hard"])
def test_a_recorded_life(name: str) -> None:
    """Inner values to 1e-6, and commands, of which every fifth is asked for, within .01 rad in 99.9 % of the frames."""
    recorded = np.load(DATA / f"{name}.npz")
    frames = dict(zip(recorded["columns"].tolist(), recorded["frames"].astype(float).T, strict=True))
    memory = as_recorded(recorded["arm_limits"], recorded["head_limits"])

    def all_of(*names: str) -> Floats:
        return np.column_stack([frames[name] for name in names])

    felt, goals = (all_of(*(f"{letter}{k}" for k in range(4))) for letter in "xt")
    heads, asked, clipped = (all_of(f"{kind}yaw", f"{kind}pitch") for kind in ("", "command_", "clipped_"))
    pixels = (all_of("u", "v") - [159.5, 119.5]) / 160
    told, alike = np.vstack([heads[:1], clipped]), memory.metric.copy()
    apart: dict[str, float] = {}
    late: list[bool] = []

    def compare(**values: Any) -> None:
        for key, (value, columns) in values.items():
            difference = float(np.abs(np.ravel(value) - [frames[column][k] for column in columns]).max())
            apart[key] = max(apart.get(key, 0.0), difference)

    for k in range(len(felt)):
        calibrate(memory, felt[k] + memory.shift, heads[k], told[k], pixels[k])
        live(memory, felt[k], goals[k], heads[k], told[k], pixels[k], 0.75, REST)
        memory.metric[:], memory.common[:], memory.extent[:] = alike, 0.0, 1.0
        memory.numbers[[LASTING, CALM]] = 0.0, 0.0 if memory.numbers[HITS] < CALM_HITS else -1.0  # the next hit adds 1
        compare(
            drift=(memory.drift, ("eps_yaw", "eps_pitch")),
            shift=(memory.shift, ("c0", "c1", "c2", "c3")),
            speed=(memory.speed, ("v0", "v1", "v2", "v3")),
            gain=(memory.gain / 1.6, ("G00", "G01", "G10", "G11")),
            surprise=(memory.numbers[SURPRISE], ("kappa",)),
            units=(memory.numbers[UNITS], ("units",)),
        )
        if memory.numbers[HITS] and k % 5 == 0:
            expected = np.clip(asked[k], *recorded["head_limits"].T)
            late.append(bool(np.abs(command_of(memory) - expected).max() > 0.01))
        memory.asked[:] = asked[k]
    assert max(apart.values()) < 1e-6, apart
    assert np.mean(late) < 0.001
    assert name == "learner_s" or frames["kappa"].max() > 0.5  # surprise acted
