"""Write a map of your own in 20 lines, check its contract, and compare it with a neural gas on inputs that move.

usage: python own_map.py
"""

import tempfile
from pathlib import Path

import numpy as np

from somatopy import NeuralGas, check_map, load_map
from somatopy.maps import Map
from somatopy.maps.quality import quantisation_error


class RecentMeans(Map):
    """Each unit is the mean of the inputs that it has won, the latest `memory` of them counting most."""

    def __init__(self, units=9, memory=50, dtype="float64", missing="error", random_state=None):
        self.units = units
        self.memory = memory
        self.dtype = dtype
        self.missing = missing
        self.random_state = random_state

    def _start(self, dims, rng):
        return {"codebook": rng.random((self.units, dims)), "wins": np.zeros(self.units)}

    def _step(self, x):
        codebook, wins = self._learned["codebook"], self._learned["wins"]
        winner, seen = int(self._winners(x[None])[0]), ~np.isnan(x)
        wins[winner] = min(wins[winner] + 1, self.memory)
        codebook[winner, seen] += (x[seen] - codebook[winner, seen]) / wins[winner]
        return winner


def main() -> None:
    check_map(RecentMeans)
    print("RecentMeans keeps the laws of maps")
    rng = np.random.default_rng(0)
    here, there = rng.random((5000, 2)), 0.8 + rng.random((5000, 2))
    for learner in (RecentMeans(random_state=0), NeuralGas(units=9, horizon=5000, random_state=0)):
        settled = quantisation_error(learner.partial_fit(here), here)
        with tempfile.TemporaryDirectory() as folder:
            learner.save(Path(folder) / "map.npz")
            resumed = load_map(Path(folder) / "map.npz").partial_fit(there)
        moved = quantisation_error(resumed, there)
        print(f"{type(learner).__name__}: error {settled:.3f}, and {moved:.3f} where the inputs have moved to")


if __name__ == "__main__":
    main()
