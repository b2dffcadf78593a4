"""A robot that learners meet without a simulator: an arm, a head that looks about, and a hand that is easily seen."""

from __future__ import annotations

import numpy as np

from somatopy.clock import FRAME
from somatopy.learners import BestLearner
from somatopy.percept import Camera, Floats, Percept, Robot, Sighting, Space

HEAD = Space(("yaw", "pitch"), [-2.0, -0.7], [2.0, 0.6])


def robot(joints: int = 4, head: Space = HEAD, width: int = 320, height: int = 240) -> Robot:
    arm = Space([f"arm{k}" for k in range(joints)], np.full(joints, -1.5), np.full(joints, 1.2))
    return Robot({"arm": arm, "head": head}, ("head",), Camera("eye", width, height, fovy=0.83))


class World:
    """An arm, a hand that is in a direction given by the arm, and a head that is where it is told to be.

    The arm babbles in a share of its range, `reach`, about the middle.
    The hand is seen where it is within the picture, but for a strip that a shoulder hides.
    """

    def __init__(self, robot: Robot, seed: int = 0, reach: float = 1.0) -> None:
        self.robot, self.rng, limits = robot, np.random.default_rng(seed), robot.arm.limits
        self.babbled = limits if reach == 1.0 else (1 - reach) * limits.mean(axis=1)[:, None] + reach * limits
        self.mix = self.rng.normal(size=(len(robot.head), len(robot.arm))) / np.sqrt(len(robot.arm))
        self.arm, self.goal = robot.arm.limits.mean(axis=1), robot.arm.limits.mean(axis=1)
        self.head = np.zeros(len(robot.head))
        self.frame = 0

    def percept(self, command: Floats) -> Percept:
        """What is sensed one frame after a command."""
        head_limits = self.robot.head.limits
        if self.frame % 30 == 0:
            self.goal = self.rng.uniform(*self.babbled.T)
        self.arm = self.arm + np.clip(self.goal - self.arm, -0.05, 0.05)
        clipped = np.clip(command, *head_limits.T)
        self.head = self.head + np.clip(clipped - self.head, -0.5, 0.5)
        self.frame += 1
        return Percept(self.frame * FRAME, self.arm, self.head, self.goal, clipped, self.sighting(), FRAME)

    def sighting(self) -> Sighting | None:
        """Where the hand is in the picture, if it is."""
        camera = self.robot.camera
        hand = 0.25 * np.tanh(self.mix @ self.arm) * np.ptp(self.robot.head.limits, axis=1)
        apart = np.resize(np.append(hand - self.head, 0.0), 2) if len(hand) == 1 else (hand - self.head)[:2]
        u, v = camera.centre[0] - camera.focal * apart[0], camera.centre[1] + camera.focal * apart[1]
        hidden = -0.1 < apart[0] < 0.05 and self.arm[0] < -0.3
        inside = 10 < u < camera.width - 10 and 10 < v < camera.height - 10
        return Sighting((u, v), 0, 400.0) if inside and not hidden else None


def live(learner: BestLearner, world: World, frames: int) -> Floats:
    """Whether the hand was seen in each frame."""
    command, hits = world.head, np.zeros(frames)
    for k in range(frames):
        percept = world.percept(command)
        hits[k] = percept.sighting is not None
        learner.observe(percept)
        command = learner.gaze(percept)
    return hits
