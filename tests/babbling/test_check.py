"""The laws of babblers: ours keep them, and a babbler that breaks one is told which."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from somatopy.babbling import UniformBabbler, check_babbler
from somatopy.contract import ContractError
from somatopy.percept import JointGroup

BOUNDS = np.array([[-1.5, 1.0], [-0.5, 0.75]])


@pytest.mark.parametrize("bounds", [BOUNDS, BOUNDS[:, :1] + [0.0, 0.0]])
def test_ours_keep_them(bounds: Any) -> None:
    """Uniform targets, in a range and in one of a single point."""
    arm = JointGroup(("shoulder", "elbow"), np.array([-2.0, -1.0]), np.array([2.0, 1.0]), np.array([8.0, 0.25]))
    check_babbler(lambda rng: UniformBabbler(arm, bounds, 0.5, [0.25, -0.1], rng), bounds)


class Hopping:
    """A sound babbler: a new target every second."""

    def __init__(self, rng: np.random.Generator) -> None:
        self.rng, self.until, self.target = rng, -np.inf, np.zeros(2)

    def command(self, time: float) -> Any:
        if time >= self.until:
            self.target, self.until = self.draw(time), time + 1
        return self.target.copy()

    def draw(self, time: float) -> Any:
        return self.rng.uniform(*BOUNDS.T)

    def state(self) -> dict[str, Any]:
        return {"target": self.target.copy(), "until": self.until, "rng": self.rng.bit_generator.state}

    def restore(self, state: dict[str, Any]) -> None:
        self.target, self.until = state["target"].copy(), state["until"]
        self.rng.bit_generator.state = state["rng"]


class Stateless:
    def __init__(self, rng: np.random.Generator) -> None: ...

    def command(self, time: float) -> Any:
        return np.zeros(2)


class Wide(Hopping):
    def draw(self, time: float) -> Any:
        return super().draw(time) * 1.5


class OneJoint(Hopping):
    def draw(self, time: float) -> Any:
        return super().draw(time)[:1]


class Early(Hopping):
    def draw(self, time: float) -> Any:
        return np.zeros(2) if time < 3600 else np.full(2, np.nan)


class Restless(Hopping):
    def command(self, time: float) -> Any:
        return self.draw(time)


class Lending(Hopping):
    def command(self, time: float) -> Any:
        super().command(time)
        return self.target


class Reusing(Hopping):
    def command(self, time: float) -> Any:
        self.sheet = getattr(self, "sheet", np.zeros(2))
        self.sheet[:] = super().command(time)
        return self.sheet


class Unseeded(Hopping):
    def __init__(self, rng: np.random.Generator) -> None:
        super().__init__(np.random.default_rng())


class Forgetful(Hopping):
    def restore(self, state: dict[str, Any]) -> None:
        super().restore(state | {"until": 0.0})


def test_another_sound_babbler_passes() -> None:
    """Targets on a clock."""
    check_babbler(Hopping, BOUNDS)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (Stateless, "all members of Babbler.*Stateless lacks restore, state"),
        (Wide, r"asked every frame gives finite targets \(2,\) inside its bounds"),
        (OneJoint, r"finite targets \(2,\)"),
        (Early, "asked from an hour on gives finite targets"),
        (Restless, "asked again at the same time it says the same"),
        (Lending, "what a babbler returns belongs to the caller"),
        (Reusing, "what a babbler returned stays as it was"),
        (Unseeded, "one seed, one behaviour"),
        (Forgetful, r"restore\(state\) continues bit for bit"),
    ],
)
def test_each_law_is_held(make: Any, message: str) -> None:
    """One babbler that breaks each."""
    with pytest.raises(ContractError, match=message):
        check_babbler(make, BOUNDS)
