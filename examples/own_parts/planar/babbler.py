"""Babbling of one's own: each joint swings through its range, with a period and a phase of its own."""

import numpy as np


class Waves:
    """Targets on sine waves. It looks at the clock alone, so that every learner meets the same movement."""

    def __init__(self, arm, start, rng, period: float = 7.0):
        self.middle, self.reach = 0.5 * (arm.upper + arm.lower), 0.5 * (arm.upper - arm.lower)
        self.pace = 2 * np.pi / (period * (1 + 0.37 * np.arange(len(arm))))
        self.phase = rng.uniform(0, 2 * np.pi, len(arm))

    def command(self, time):
        return self.middle + self.reach * np.sin(self.pace * time + self.phase)

    def state(self):
        return {"phase": self.phase.copy()}

    def restore(self, state):
        self.phase = np.array(state["phase"])
