"""The best learner that knows where the hand is, and not from where it is seen: see docs/best.md.

somatopy run best --eye geometric --motion kinematic --learner docs.best_centring:CentringLater

A learner that never does anything but look at the hand's direction (`docs.best_variants:Varied` with `centring`) hardly
turns its head from frame to frame, and so may learn the pixel gain late. This one lives as `best` until that gain has
settled.
"""

from __future__ import annotations

import numpy as np
from docs.best_variants import Varied, bowl

from somatopy.learners.best.memory import TURNS, Memory
from somatopy.percept import Percept, Robot

SETTLED = 1600  # frames from which the pixel gain has learned


class CentringLater(Varied):
    """`BestLearner` that forgets visibility and working memory, and looks at g + eps, once its pixel gain has settled.

    Args:
        robot: limits of arm and head joints, and the size of the camera's picture.
        rng: random numbers for gazes before the first hit.
    """

    def __init__(self, robot: Robot, rng: np.random.Generator) -> None:
        super().__init__(robot, rng)

    def _change(self, before: Memory, percept: Percept) -> None:
        if self._bowl is None and self._memory.numbers[TURNS] >= SETTLED:
            self._bowl = bowl(self._memory)
            self._factors |= dict.fromkeys(("sheet", "fields", "recent"), 0.0)
        super()._change(before, percept)
