"""A learner of your own: it predicts head postures as a quadratic function of arm postures."""

import numpy as np

from somatopy.learners import Plastic, Scale


class QuadraticGaze(Plastic):
    """Fits the prediction to the hits by least squares; old hits fade.

    While the hand is out of view, the gaze searches around the prediction.
    """

    parts = frozenset({"fit"})

    def __init__(self, robot, rng, forgetting: float = 0.001):
        self.arm, self.head, self.rng = Scale(robot.arm.limits), Scale(robot.head.limits), rng
        self.forgetting = forgetting
        terms = len(self.features(self.arm.low))
        self.gram, self.sums = np.eye(terms), np.zeros((terms, len(robot.head)))

    def features(self, arm):
        x = np.append(1.0, 2 * self.arm.to_unit(arm) - 1)
        return np.outer(x, x)[np.triu_indices(len(x))]

    def observe(self, percept):
        if percept.sighting is not None and "fit" in self.plastic:
            z, y = self.features(percept.arm), self.head.to_unit(percept.head) - 0.5
            self.gram += np.outer(z, z) - self.forgetting * (self.gram - np.eye(len(z)))
            self.sums += np.outer(z, y) - self.forgetting * self.sums

    def predict(self, arm):
        y = 0.5 + self.features(arm) @ np.linalg.solve(self.gram, self.sums)
        return self.head.to_angle(np.clip(y, 0, 1))

    def gaze(self, percept):
        search = 0.02 if percept.sighting else 0.3
        y = self.head.to_unit(self.predict(percept.arm)) + self.rng.normal(0, search, len(self.head.low))
        return self.head.to_angle(np.clip(y, 0, 1))

    def state(self):
        return {"gram": self.gram.copy(), "sums": self.sums.copy(), "rng": self.rng.bit_generator.state}

    def restore(self, state):
        self.gram, self.sums = np.array(state["gram"]), np.array(state["sums"])
        self.rng.bit_generator.state = state["rng"]
