"""The laws of damages: ours keep them, and a damage that breaks one is told which."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from somatopy.bodies import Body, MujocoBody
from somatopy.contract import ContractError
from somatopy.experiment import check_damage
from somatopy.experiment.damage import Damage, JointOffset, NoDamage
from somatopy.percept import Percept

RNG = np.random.default_rng(0)


def kinematic() -> MujocoBody:
    return MujocoBody("nao", motion="kinematic")


@pytest.mark.parametrize("motion", ["kinematic", "dynamic"])
@pytest.mark.parametrize("damage", [NoDamage(), JointOffset([0.1265, 1.1411, 1.2295, -0.2242])])
def test_ours_keep_them(damage: Damage, motion: Any) -> None:
    """None, and the paper's, on both kinds of NAO."""
    check_damage(lambda: damage, lambda: MujocoBody("nao", motion=motion))


class TiltedCamera(NoDamage):
    """A sound damage of the body, with noise in what is sensed."""

    alters_ceiling = True

    def injure(self, body: Body) -> None:
        assert isinstance(body, MujocoBody)
        self.before = body.model.cam_quat.copy()
        body.model.cam_quat[:] = [1, 0, 0, 0]

    def heal(self, body: Body) -> None:
        assert isinstance(body, MujocoBody)
        body.model.cam_quat[:] = self.before

    def sense(self, percept: Percept, rng: np.random.Generator) -> Percept:
        return replace(percept, arm=percept.arm + rng.normal(0, 0.01, percept.arm.shape))


class Partial:
    alters_ceiling = False


class Unsure(TiltedCamera):
    alters_ceiling: Any = 1


class Denying(TiltedCamera):
    alters_ceiling = False


class Lasting(TiltedCamera):
    def heal(self, body: Body) -> None: ...


class Pushing(TiltedCamera):
    def heal(self, body: Body) -> None:
        super().heal(body)
        assert isinstance(body, MujocoBody)
        body.model.key_qpos[:] += 0.01


class InPlace(NoDamage):
    def sense(self, percept: Percept, rng: np.random.Generator) -> Percept:
        percept.arm[:] += 0.1
        return percept


class Cutting(NoDamage):
    def sense(self, percept: Percept, rng: np.random.Generator) -> Percept:
        return replace(percept, arm=percept.arm[:2])


class Blanking(NoDamage):
    def sense(self, percept: Percept, rng: np.random.Generator) -> Percept:
        return replace(percept, arm_command=percept.arm_command * np.nan)


class Numbing(NoDamage):
    def sense(self, percept: Percept, rng: np.random.Generator) -> Any:
        return None


class OwnNoise(NoDamage):
    def sense(self, percept: Percept, rng: np.random.Generator) -> Percept:
        return replace(percept, arm=percept.arm + RNG.normal(0, 0.01, percept.arm.shape))


def test_another_sound_damage_passes() -> None:
    """Of the body and of what is sensed."""
    check_damage(TiltedCamera, kinematic)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (Partial, "all members of Damage.*Partial lacks heal, injure, sense"),
        (Unsure, "alters_ceiling is True or False. Seen: 1"),
        (Denying, "alters_ceiling is True where an injury changes what the camera can see"),
        (Lasting, "heal undoes all that injure did to the body.*other readings from the same state"),
        (Pushing, "heal undoes all.*reset and a step lead to another state"),
        (InPlace, "sense leaves its percept alone"),
        (Cutting, r"a percept of the same shapes, finite\. Seen: arm = "),
        (Blanking, r"a percept of the same shapes, finite\. Seen: arm_command = \[nan"),
        (Numbing, "a percept of the same shapes.*Seen: None"),
        (OwnNoise, "sense draws from the generator that it is given"),
    ],
)
def test_each_law_is_held(make: Any, message: str) -> None:
    """One damage that breaks each."""
    with pytest.raises(ContractError, match=message):
        check_damage(make, kinematic)
