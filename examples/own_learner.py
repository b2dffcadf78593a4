"""Write a learner of your own in 40 lines, check its contract, and compare it with the paper's on the same movements.

usage: python own_learner.py [MINUTES of robot time, 10 by default]
       somatopy compare --learners hebbian,own_learner:QuadraticGaze --damages none,gain   (in the folder of this file)
"""

import sys
import tempfile

import numpy as np

from somatopy import check_learner, paper, run
from somatopy.experiment import frames_of
from somatopy.learners import Plastic, Scale


class QuadraticGaze(Plastic):
    """Predicts the head posture as a quadratic function of the arm posture, fitted to the hits.

    Least squares; old hits fade. While the hand is out of view, the gaze searches around the prediction.
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
            self.sums += np.outer(z, y) - self.forgetting * self.sums  # old hits fade, so damage does too

    def predict(self, arm):
        y = 0.5 + self.features(arm) @ np.linalg.solve(self.gram, self.sums)
        return self.head.to_angle(np.clip(y, 0, 1))

    def gaze(self, percept):
        search = 0.02 if percept.sighting else 0.2
        y = self.head.to_unit(self.predict(percept.arm)) + self.rng.normal(0, search, len(self.head.low))
        return self.head.to_angle(np.clip(y, 0, 1))

    def state(self):
        return {"gram": self.gram.copy(), "sums": self.sums.copy(), "rng": self.rng.bit_generator.state}

    def restore(self, state):
        self.gram, self.sums = np.array(state["gram"]), np.array(state["sums"])
        self.rng.bit_generator.state = state["rng"]


if __name__ == "__main__":  # a study imports this file, and must not run it
    check_learner(QuadraticGaze)
    print("QuadraticGaze keeps the contract of learners.")
    minutes = float(sys.argv[1]) if len(sys.argv) > 1 else 10.0
    phase = paper().phases[0].replaced(frames=frames_of(minutes))
    described = paper().replaced(eye={"kind": "geometric"}, body={"motion": "kinematic"}, phases=[phase])
    with tempfile.TemporaryDirectory() as folder:
        for name, learner in (
            ("HebbianLearner", None),
            ("QuadraticGaze", QuadraticGaze),
        ):  # the same movements of the arm
            summary = run(described, f"{folder}/{name}", learner=learner, progress=False).summary
            print(f"{name} saw the hand in {summary['phases'][0]['rate']:.1%} of {minutes:g} minutes")
