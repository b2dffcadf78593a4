"""A babbler of your own: every joint swings through its range, each with its own period and phase."""

import numpy as np


class Waves:
    """Sets targets on sine waves. They depend on the time alone, so that every learner meets the same movement."""

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
