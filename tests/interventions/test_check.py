"""The laws of interventions: ours keep them, and one that breaks a law is told which."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from somatopy.babbling import UniformBabbler
from somatopy.bodies import MujocoBody
from somatopy.contract import ContractError, Stage
from somatopy.interventions import (
    PAPER_OFFSET,
    Afresh,
    DeadJoint,
    EncoderNoise,
    HeadShift,
    Intervention,
    JointDrift,
    JointGain,
    JointOffset,
    JointOrder,
    LongerArm,
    MirroredPicture,
    MovedMarker,
    NoIntervention,
    OtherBabbling,
    PlasticParts,
    Shuffled,
    TurnedCamera,
    check_intervention,
)
from somatopy.percept import Camera, Column, Floats, JointGroup, Percept

Generator = np.random.Generator
RNG = np.random.default_rng(0)
ARM = JointGroup(tuple("abcd"), -np.ones(4), np.array([1.0, 2.0, 0.5, 1.5]), np.ones(4))


def babbler() -> UniformBabbler:
    return UniformBabbler(ARM, ARM.space.limits / 2, 0.5, np.zeros(4), np.random.default_rng(4))


OURS: dict[str, Callable[[], Intervention]] = {
    "none": NoIntervention,
    "offset": lambda: JointOffset(PAPER_OFFSET),
    "gain": lambda: JointGain(ARM, 0.7),
    "permuted": lambda: JointOrder(ARM, [1, 2, 3, 0]),
    "dead-joint": lambda: DeadJoint(2),
    "noise": lambda: EncoderNoise([0.05, 0.0, 0.1, 0.05]),
    "drift": lambda: JointDrift([0.1, -0.2, 0.0, 0.3]),
    "head-offset": lambda: HeadShift(0.2),
    "mirrored": lambda: MirroredPicture(Camera("eye", 320, 240, fovy=0.83)),
    "camera": lambda: TurnedCamera(10, -5),
    "marker": lambda: MovedMarker(0.15),
    "longer-arm": lambda: LongerArm(1.2),
    "babbling": lambda: OtherBabbling(babbler()),
    "plastic": lambda: PlasticParts(("links",)),
    "nothing plastic": PlasticParts,
    "afresh": Afresh,
    "shuffled": Shuffled,
}


def kinematic() -> MujocoBody:
    return MujocoBody("nao", motion="kinematic")


@pytest.mark.parametrize("name", OURS)
def test_ours_keep_them(name: str) -> None:
    """On the check's puppet, and on a NAO that moves without physics."""
    check_intervention(OURS[name])
    check_intervention(OURS[name], kinematic)


@pytest.mark.parametrize("name", ["offset", "longer-arm", "marker", "slow"])
def test_some_keep_them_with_physics(name: str) -> None:
    """On a body whose state is more than its posture, and which may be stepped in parts."""
    made = OURS | {"slow": lambda: OtherBabbling(babbler(), 0.5)}
    check_intervention(made[name], lambda: MujocoBody("nao", motion="dynamic"))


class Drift(NoIntervention):
    """A sound one that has state, columns and random numbers: what is sensed wanders off, and the head trembles."""

    columns: Any = (Column("drift", "float", "how far it has wandered, rad", "rad"),)

    def __init__(self) -> None:
        self.drift = np.zeros(4)

    def sense(self, percept: Percept, rng: Generator) -> Percept:
        self.drift += rng.normal(0, 0.01, 4)
        return replace(percept, arm=percept.arm + self.drift)

    def act(self, target: Floats, gaze: Floats, rng: Generator) -> tuple[Floats, Floats]:
        return target, gaze + rng.normal(0, 0.01, gaze.shape)

    def probes(self) -> dict[str, float]:
        return {"drift": float(np.abs(self.drift).max())}

    def state(self) -> dict[str, Any]:
        return {"drift": self.drift.copy()}

    def restore(self, state: dict[str, Any]) -> None:
        self.drift = state["drift"].copy()


class TiltedCamera(NoIntervention):
    """A sound injury of the body."""

    alters_ceiling = True

    def hold(self, stage: Stage) -> None:
        assert isinstance(stage.body, MujocoBody)
        self.before = stage.body.model.cam_quat.copy()
        stage.body.model.cam_quat[:] = [1, 0, 0, 0]

    def release(self, stage: Stage) -> None:
        assert isinstance(stage.body, MujocoBody)
        stage.body.model.cam_quat[:] = self.before


class Weak(NoIntervention):
    """A sound injury of the arm: it goes half of each way. What can be seen in a posture stays the same."""

    moves_arm = True

    def hold(self, stage: Stage) -> None:
        body: Any = stage.body
        body.step = lambda arm, head: type(body).step(body, 0.5 * np.asarray(arm), head)

    def release(self, stage: Stage) -> None:
        del stage.body.step  # type: ignore[method-assign]


class Shivering(NoIntervention):
    """A sound one that changes the arm's target."""

    moves_arm = True

    def act(self, target: Floats, gaze: Floats, rng: Generator) -> tuple[Floats, Floats]:
        return target + rng.normal(0, 0.01, target.shape), gaze


def test_other_sound_ones_pass() -> None:
    """With state, columns and noise; of what is commanded; of the body, on a puppet and on a model."""
    for make in (Drift, Shivering, Weak):
        check_intervention(make)
    check_intervention(TiltedCamera, kinematic)


class Partial:
    alters_ceiling = False


class Unsure(NoIntervention):
    alters_ceiling: Any = 1


class Undecided(NoIntervention):
    moves_arm: Any = None


class Silent(Drift):
    def probes(self) -> dict[str, float]:
        return {}


class Talkative(Drift):
    columns: Any = ()


class Twice(Drift):
    columns = (*Drift.columns, *Drift.columns)


class LateProbes(Drift):
    def probes(self) -> dict[str, float]:
        return super().probes() if self.drift.any() else {}


class InPlace(NoIntervention):
    def sense(self, percept: Percept, rng: Generator) -> Percept:
        percept.arm[:] += 0.1
        return percept


class Cutting(NoIntervention):
    def sense(self, percept: Percept, rng: Generator) -> Percept:
        return replace(percept, arm=percept.arm[:2])


class Blanking(NoIntervention):
    def sense(self, percept: Percept, rng: Generator) -> Percept:
        return replace(percept, arm_command=percept.arm_command * np.nan)


class Listing(NoIntervention):
    def sense(self, percept: Percept, rng: Generator) -> Percept:
        return replace(percept, head=percept.head.tolist())  # type: ignore[arg-type]


class Numbing(NoIntervention):
    def sense(self, percept: Percept, rng: Generator) -> Any:
        return None


class Halving(NoIntervention):
    def act(self, target: Floats, gaze: Floats, rng: Generator) -> tuple[Floats, Floats]:
        gaze *= 0.5
        return target, gaze


class OneJoint(NoIntervention):
    def act(self, target: Floats, gaze: Floats, rng: Generator) -> tuple[Floats, Floats]:
        return target, gaze[:1]


class Infinite(NoIntervention):
    def act(self, target: Floats, gaze: Floats, rng: Generator) -> tuple[Floats, Floats]:
        return target, gaze * np.inf


class Forgotten(NoIntervention):
    def act(self, target: Floats, gaze: Floats, rng: Generator) -> Any:
        return None


class Secret(Shivering):
    moves_arm = False


class OwnNoise(NoIntervention):
    def sense(self, percept: Percept, rng: Generator) -> Percept:
        return replace(percept, arm=percept.arm + RNG.normal(0, 0.01, percept.arm.shape))


class OwnTremor(NoIntervention):
    def act(self, target: Floats, gaze: Floats, rng: Generator) -> tuple[Floats, Floats]:
        return target, gaze + RNG.normal(0, 0.01, gaze.shape)


class Opaque(Drift):
    def state(self) -> dict[str, Any]:
        return {"drift": list(self.drift.reshape(2, 2))}


class Lending(Drift):
    def state(self) -> dict[str, Any]:
        return {"drift": self.drift}


class Forgetful(Drift):
    def restore(self, state: dict[str, Any]) -> None:
        self.drift = np.zeros(4)


class Adopting(Drift):
    def restore(self, state: dict[str, Any]) -> None:
        self.drift = state["drift"]


class Denying(TiltedCamera):
    alters_ceiling = False


class Denied(Weak):
    moves_arm = False


class Lasting(TiltedCamera):
    def release(self, stage: Stage) -> None: ...


class Pushing(TiltedCamera):
    def release(self, stage: Stage) -> None:
        super().release(stage)
        assert isinstance(stage.body, MujocoBody)
        stage.body.model.key_qpos[:] += 0.01


class Freezing(PlasticParts):
    def release(self, stage: Stage) -> None: ...


class OnlyOnce(TiltedCamera):
    held = False

    def hold(self, stage: Stage) -> None:
        if self.held:
            return
        super().hold(stage)
        self.held = True


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (Partial, "all members of Intervention.*Partial lacks act, begin, check, columns, hold, moves_arm, probes, "),
        (Unsure, "alters_ceiling and moves_arm are True or False. Seen: alters_ceiling = 1"),
        (Undecided, "alters_ceiling and moves_arm are True or False. Seen: moves_arm = None"),
        (Silent, r"probes\(\) has the names of its columns.*Seen: \{\} for the columns \['drift'\]"),
        (Talkative, r"probes\(\) has the names of its columns.*Seen: \{'drift': 0\.0\} for the columns \[\]"),
        (Twice, r"probes\(\) has the names of its columns.*Seen: the columns \['drift', 'drift'\]"),
        (LateProbes, "before the first frame too.*Seen: {} for the columns"),
        (InPlace, "sense leaves its percept alone"),
        (Cutting, r"sense gives a percept of the same shapes, finite\. Seen: arm = "),
        (Blanking, r"sense gives a percept of the same shapes, finite\. Seen: arm_command = array\(\[nan"),
        (Listing, r"sense gives a percept of the same shapes, finite\. Seen: head = \[.*The fix: give arrays"),
        (Numbing, "sense gives a percept of the same shapes.*Seen: None"),
        (Halving, "act leaves its arguments alone"),
        (OneJoint, "act gives a target and a gaze of the same shapes, finite"),
        (Infinite, "act gives a target and a gaze of the same shapes, finite.*inf"),
        (Forgotten, "act gives a target and a gaze of the same shapes, finite.*TypeError"),
        (Secret, "moves_arm is True where act changes the arm's target"),
        (OwnNoise, "sense and act draw from the generator that they are given"),
        (OwnTremor, "sense and act draw from the generator that they are given"),
        (Opaque, r"state\(\) is plain data.*'drift'"),
        (Lending, "a state stays as it was taken"),
        (Forgetful, r"restore\(state\) continues bit for bit"),
        (Adopting, r"restore\(\) leaves the state that it is given alone"),
        (Denied, "moves_arm is True where holding changes how the arm moves"),
        (Freezing, r"release undoes all that hold did.*Seen: frozenset\(\) learn, frozenset"),
    ],
)
def test_each_law_is_held(make: Any, message: str) -> None:
    """One intervention that breaks each, on the check's puppet."""
    with pytest.raises(ContractError, match=message), np.errstate(all="ignore"):
        check_intervention(make)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (Denying, "alters_ceiling is True where holding changes what the camera can see"),
        (Lasting, "release undoes all that hold did.*other readings from the same state"),
        (Pushing, "release undoes all that hold did.*other readings after a reset"),
        (OnlyOnce, "hold can come again after release.*the second time the body behaves otherwise"),
    ],
)
def test_each_law_of_injuries_is_held(make: Any, message: str) -> None:
    """One injury of a body with a model that breaks each."""
    with pytest.raises(ContractError, match=message):
        check_intervention(make, kinematic)


class Plain:
    """A body that cannot be resumed, and counts how often it was closed."""

    closed = 0

    def __init__(self) -> None:
        self.real = kinematic()
        for name in ("arm", "head", "camera", "marker", "reset", "step"):
            setattr(self, name, getattr(self.real, name))

    def close(self) -> None:
        Plain.closed += 1
        self.real.close()


def test_on_a_body_that_cannot_be_resumed_the_rest_is_tried() -> None:
    """A device has no state to compare from; the body is closed, whether or not a law is broken."""
    before = Plain.closed
    make: Any = Plain
    check_intervention(Drift, make)
    with pytest.raises(ContractError, match="sense leaves its percept alone"):
        check_intervention(InPlace, make)
    assert Plain.closed == before + 2
