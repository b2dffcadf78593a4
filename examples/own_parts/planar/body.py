"""A body of your own without MuJoCo: an arm with two joints on a table, and above it a camera that pans and tilts."""

import numpy as np

from somatopy.clock import FRAME
from somatopy.percept import Camera, JointGroup, Marker, Reading, Shapes, View


class PlanarArm:
    """An arm and a head whose joints go straight to their targets, as fast as their velocity limits allow.

    This body has two capabilities beyond the contract of bodies. It can be resumed (`state`, `restore`), and it has a
    model of itself (`view`, `legal` and the methods after them), so that its runs have a ceiling. A body with neither
    can run as well.
    """

    arm = JointGroup(("shoulder", "elbow"), np.array([-1.2, 0.0]), np.array([1.2, 2.2]), np.array([2.0, 2.0]))
    head = JointGroup(("pan", "tilt"), np.array([-1.5, 0.0]), np.array([1.5, 1.4]), np.array([4.0, 4.0]))
    camera = Camera("eye", 320, 240, fovy=0.83)
    marker = Marker()
    occluders = Shapes(np.empty(0, np.int64), np.empty((0, 4)))

    def __init__(self, upper_arm: float = 0.2, forearm: float = 0.15):
        self.upper_arm, self.forearm = upper_arm, forearm
        self.ranges = {"front": np.array([[-0.8, 0.8], [0.2, 1.8]])}
        self.reset()

    def reset(self, seed=None):
        self.frame, self.posture = 0, np.array([0.0, 1.0, 0.0, 0.7])
        self.target = self.posture.copy()
        return self.sense(0.0)

    def step(self, arm, head):
        targets = np.array(arm, float), np.array(head, float)
        if targets[0].shape != (2,) or targets[1].shape != (2,) or not np.isfinite(targets).all():
            raise ValueError(f"arm and head targets are two finite angles each, {self.arm.names} and {self.head.names}")
        lower, upper, speed = (
            np.concatenate([getattr(group, name) for group in (self.arm, self.head)])
            for name in ("lower", "upper", "velocity")
        )
        self.target = np.clip(np.concatenate(targets), lower, upper)
        self.posture = self.posture + np.clip(self.target - self.posture, -speed * FRAME, speed * FRAME)
        self.frame += 1
        return self.sense(FRAME)

    def sense(self, dt):
        arm, head = self.posture[:2].copy(), self.posture[2:].copy()
        commands = self.target[:2].copy(), self.target[2:].copy()
        return Reading(self.frame * FRAME, arm, head, *commands, dt, view=self.view(arm, head))

    def close(self):
        """There is nothing to release."""

    # It can be resumed.

    def state(self):
        return {"frame": self.frame, "posture": self.posture.copy(), "target": self.target.copy()}

    def restore(self, state):
        self.frame = int(state["frame"])
        self.posture, self.target = np.array(state["posture"]), np.array(state["target"])
        return self.sense(FRAME if self.frame else 0.0)

    # It has a model of itself.

    def view(self, arm, head):
        shoulder, elbow = arm
        along = np.array([np.cos(shoulder + elbow), np.sin(shoulder + elbow), 0.0])
        hand = self.upper_arm * np.array([np.cos(shoulder), np.sin(shoulder), 0.0]) + self.forearm * along
        up = np.array([0.0, 0.0, 1.0])
        pan, tilt = head
        ahead = np.array([np.cos(pan) * np.cos(tilt), np.sin(pan) * np.cos(tilt), -np.sin(tilt)])
        right = np.array([np.sin(pan), -np.cos(pan), 0.0])
        looking = np.column_stack([right, np.cross(right, ahead), -ahead])
        holding = np.column_stack([along, np.cross(up, along), up])
        camera = np.concatenate([[0.0, 0.0, 0.25], looking.ravel()])
        return View(camera, np.concatenate([hand, holding.ravel()]), np.empty((0, 12)))

    def legal(self, head):
        return np.clip(head, self.head.lower, self.head.upper)

    def fingerprint(self):
        return repr((self.upper_arm, self.forearm)).encode()

    def another(self):
        return PlanarArm(self.upper_arm, self.forearm)
