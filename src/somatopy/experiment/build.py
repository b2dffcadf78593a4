"""From a description to the parts of an experiment; everything that can be wrong is found here, before a run starts."""

from __future__ import annotations

import math
import zlib

import numpy as np

from somatopy.babbling import Babbler, UniformBabbler
from somatopy.bodies import FRAME, Body, MujocoBody
from somatopy.experiment.ceiling import best_fixed_head
from somatopy.experiment.damage import Damage, JointOffset, NoDamage
from somatopy.experiment.description import (
    FRAMES_PER_MINUTE,
    Description,
    DescriptionError,
    FixedControl,
    Geometric,
    Hebbian,
    MapSettings,
    NearestControl,
    OffsetDamage,
    OwnLearner,
    Phase,
    RandomControl,
)
from somatopy.eyes import Eye, FiducialEye, GeometricEye
from somatopy.learners import FixedGaze, HebbianLearner, Learner, NearestGaze, RandomGaze, Scale
from somatopy.links import PositiveHebb
from somatopy.maps import DSOM
from somatopy.percept import Floats, JointGroup

__all__ = ["build_babbler", "build_body", "build_damage", "build_eye", "build_learner", "check_phases", "stream"]


def stream(seed: int, name: str) -> np.random.Generator:
    """The named random stream of one part: adding a part never shifts another's numbers."""
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(zlib.crc32(name.encode()),)))


def build_body(description: Description) -> MujocoBody:
    """The robot, its arm moving at babbling speed."""
    choice = description.body
    return MujocoBody(
        choice.model, motion=choice.motion, arm_speed=description.babbling.speed, head_speed=choice.head_speed
    )


def build_eye(description: Description, body: MujocoBody) -> Eye:
    """The eye behind the body's camera."""
    if isinstance(description.eye, Geometric):
        return GeometricEye(body.camera, body.marker, body.occluders)
    return FiducialEye(body.camera, body.marker, skip=description.eye.skip)


def build_babbler(
    description: Description, body: MujocoBody, start: Floats, rng: np.random.Generator | None = None
) -> Babbler:
    """The babbler, from the arm's posture at time 0, with random numbers of its own."""
    bounds = babbling_range(description, body)
    try:
        return UniformBabbler(
            body.arm, bounds, description.babbling.speed, start, rng or stream(description.seed, "babbling")
        )
    except ValueError as error:
        raise DescriptionError(f"babbling: {error}") from error


def babbling_range(description: Description, body: MujocoBody) -> Floats:
    """Low and high of each arm joint (n_arm, 2), rad, in which the arm babbles.

    Raises:
        DescriptionError: the body has no range of that name.
    """
    wanted = description.babbling.range
    if not isinstance(wanted, str):
        return np.array(wanted)
    ranges: dict[str, Floats] = {"mechanical": limits(body.arm)}
    ranges |= {key: np.array(value) for key, value in body.anatomy.ranges.items()}
    if wanted not in ranges:
        raise DescriptionError(f"babbling.range {wanted!r} is unknown to this body; choose one of {', '.join(ranges)}.")
    return ranges[wanted]


def build_learner(description: Description, body: MujocoBody, name: str = "learner") -> Learner:
    """The learner, with random numbers of its own from the stream `name`."""
    choice, rng = description.learner, stream(description.seed, name)
    if isinstance(choice, RandomControl):
        return RandomGaze(limits(body.head), rng)
    if isinstance(choice, NearestControl):
        return NearestGaze(limits(body.arm), limits(body.head), rng)
    if isinstance(choice, FixedControl):
        head = best_fixed_head(body, babbled(description, body, 500)) if choice.head is None else np.array(choice.head)
        check_posture("learner.head", head, body.head)
        return FixedGaze(head)
    if isinstance(choice, OwnLearner):
        raise DescriptionError(f"The learner {choice.name!r} is not somatopy's own: hand it over as `learner`.")
    return _build_hebbian(choice, description, body, rng)


def _build_hebbian(
    choice: Hebbian, description: Description, body: MujocoBody, rng: np.random.Generator
) -> HebbianLearner:
    arm_map = _build_map(choice.arm_map)
    if choice.arm_codes == "sampled":
        codes = babbled(description, body, math.prod(choice.arm_map.shape))
        arm_map.set_params(init=Scale(limits(body.arm)).to_unit(codes))
    return HebbianLearner(
        limits(body.arm),
        limits(body.head),
        (body.camera.width, body.camera.height),
        rng,
        arm_map=arm_map,
        head_map=_build_map(choice.head_map),
        rule=PositiveHebb(choice.link_rate),
    )


def babbled(description: Description, body: MujocoBody, count: int) -> Floats:
    """Arm postures (count, n_arm), rad, drawn from 30 minutes of set-points of a babbling stream of their own."""
    rng = stream(description.seed, "sampled babbling")
    posture = babbling_range(description, body).mean(axis=1)
    babbler = build_babbler(description, body, posture, rng)
    stride = np.minimum(description.babbling.speed, body.arm.velocity) * FRAME
    postures = np.empty((30 * FRAMES_PER_MINUTE, len(body.arm)))
    for k in range(len(postures)):
        posture = posture + np.clip(babbler.command(k * FRAME) - posture, -stride, stride)
        postures[k] = posture
    return postures[rng.choice(len(postures), count, replace=count > len(postures))]


def _build_map(settings: MapSettings) -> DSOM:
    return DSOM(shape=settings.shape, learning_rate=settings.learning_rate, elasticity=settings.elasticity)


def build_damage(phase: Phase, body: Body) -> Damage:
    """The damage of a phase.

    Raises:
        DescriptionError: an offset of another length than the arm.
    """
    if not isinstance(phase.damage, OffsetDamage):
        return NoDamage()
    if len(phase.damage.offset) != len(body.arm):
        raise DescriptionError(
            f"The damage of phase {phase.name!r} has {len(phase.damage.offset)} offsets; "
            f"the arm has {len(body.arm)} joints: {', '.join(body.arm.names)}."
        )
    return JointOffset(phase.damage.offset)


def check_phases(description: Description, learner: Learner) -> None:
    """Raise a DescriptionError if a phase wants of a fresh learner what it cannot do."""
    for phase in description.phases:
        who = f"phase {phase.name!r}: the {description.learner.kind} learner"
        if unknown := sorted(set(phase.plastic or ()) - learner.plastic):
            parts = ", ".join(sorted(learner.plastic)) or "it learns nothing: leave plastic away"
            raise DescriptionError(f"plastic of {who} has no part {unknown[0]!r} that learns; valid parts: {parts}.")
        if phase.start == "shuffled" and not isinstance(learner, HebbianLearner):
            raise DescriptionError(f"start of {who} has no links to shuffle; choose continue or afresh.")


def limits(group: JointGroup) -> Floats:
    """Low and high of each joint, shape (n, 2), rad."""
    return np.column_stack([group.lower, group.upper])


def check_posture(key: str, posture: Floats, group: JointGroup) -> None:
    """Raise a DescriptionError that names the joint if a posture does not fit or leaves the limits."""
    if len(posture) != len(group):
        raise DescriptionError(
            f"{key} has {len(posture)} angles; there are {len(group)} joints: {', '.join(group.names)}."
        )
    for name, angle, low, high in zip(group.names, posture, group.lower, group.upper, strict=True):
        if not low <= angle <= high:
            raise DescriptionError(f"{key}: {name} = {angle:g} lies outside its limits [{low:.4f}, {high:.4f}] rad.")
