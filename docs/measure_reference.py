"""Print the table of docs/damages.md: what an oracle without memory reaches where a damage takes information away."""

from __future__ import annotations

import numpy as np

from somatopy.bodies import MujocoBody
from somatopy.experiment.ceiling import Vantages, reachable
from somatopy.experiment.reference import blurred, memoryless, unfelt

POSTURES, BABBLED, ALIKE = 400, 5000, 48


def main() -> None:
    """One line for each joint and each noise, in percent of the ceiling, for each range."""
    body = MujocoBody("nao", motion="kinematic")
    vantages = Vantages.of(body)
    for name in ("mechanical", "confined"):
        low, high = body.ranges[name].T
        arms = np.random.default_rng(1).uniform(low, high, (POSTURES, 4))
        babbled = np.random.default_rng(0).uniform(low, high, (BABBLED, 4))
        ceiling = reachable(vantages, arms).mean()
        print(f"{name}: ceiling {ceiling:.2f}")
        for k, joint in enumerate(body.arm.names):
            rate = memoryless(vantages, arms, unfelt([k], babbled, ALIKE)).mean()
            print(f"  {joint} dead {100 * rate / ceiling:.0f}")
        for deviation in (0.05, 0.2):
            alike = blurred(deviation, babbled, np.random.default_rng(2), ALIKE)
            print(f"  noise of {deviation} {100 * memoryless(vantages, arms, alike).mean() / ceiling:.0f}")


if __name__ == "__main__":
    main()
