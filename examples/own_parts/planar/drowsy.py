"""An intervention of your own: the head follows its commands late."""

import numpy as np

from somatopy.interventions import NoIntervention


class Drowsy(NoIntervention):
    """Delays the learner's commands to the head by some frames. Commands that still wait are part of its state."""

    def __init__(self, frames: int = 6):
        self.frames, self.waiting = frames, []

    def act(self, target, gaze, rng):
        self.waiting.append(np.array(gaze))
        return target, self.waiting.pop(0) if len(self.waiting) > self.frames else self.waiting[0]

    def state(self):
        return {"waiting": np.array(self.waiting)}

    def restore(self, state):
        self.waiting = list(np.array(state["waiting"]))
