"""From a description to the parts of an experiment; everything that can be wrong is found here, before a run starts."""

from __future__ import annotations

import zlib

import numpy as np

from somatopy.babbling import Babbler, UniformBabbler
from somatopy.bodies import Body, MujocoBody
from somatopy.experiment.damage import Damage, JointOffset, NoDamage
from somatopy.experiment.description import (
    Description,
    DescriptionError,
    FixedControl,
    Geometric,
    MapSettings,
    OffsetDamage,
    Phase,
    RandomControl,
)
from somatopy.eyes import Eye, FiducialEye, GeometricEye
from somatopy.learners import FixedGaze, HebbianLearner, Learner, RandomGaze
from somatopy.links import PositiveHebb
from somatopy.maps import DSOM
from somatopy.percept import Floats, JointGroup

__all__ = ["build_babbler", "build_body", "build_damage", "build_eye", "build_learner", "stream"]


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
    return FiducialEye(body.camera, body.marker)


def build_babbler(description: Description, body: MujocoBody, start: Floats) -> Babbler:
    """The babbler, from the arm's posture at time 0."""
    choice = description.babbling
    bounds = babbling_bounds(choice.range, body) if isinstance(choice.range, str) else np.array(choice.range)
    try:
        return UniformBabbler(body.arm, bounds, choice.speed, start, stream(description.seed, "babbling"))
    except ValueError as error:
        raise DescriptionError(f"babbling: {error}") from error


def babbling_bounds(name: str, body: MujocoBody) -> Floats:
    """Low and high of each arm joint (n_arm, 2), rad, by the range's name.

    Raises:
        DescriptionError: the body names no such range.
    """
    ranges: dict[str, Floats] = {"mechanical": limits(body.arm)}
    ranges |= {key: np.array(value) for key, value in body.anatomy.ranges.items()}
    if name not in ranges:
        raise DescriptionError(f"babbling.range {name!r} is unknown to this body; choose one of {', '.join(ranges)}.")
    return ranges[name]


def build_learner(description: Description, body: Body) -> Learner:
    """The learner, with random numbers of its own."""
    choice, rng = description.learner, stream(description.seed, "learner")
    if isinstance(choice, RandomControl):
        return RandomGaze(limits(body.head), rng)
    if isinstance(choice, FixedControl):
        check_posture("learner.head", choice.head, body.head)
        return FixedGaze(choice.head)
    return HebbianLearner(
        limits(body.arm),
        limits(body.head),
        (body.camera.width, body.camera.height),
        rng,
        arm_map=_build_map(choice.arm_map),
        head_map=_build_map(choice.head_map),
        rule=PositiveHebb(choice.link_rate),
    )


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


def limits(group: JointGroup) -> Floats:
    """Low and high of each joint, shape (n, 2), rad."""
    return np.column_stack([group.lower, group.upper])


def check_posture(key: str, posture: tuple[float, ...], group: JointGroup) -> None:
    """Raise a DescriptionError that names the joint if a posture does not fit or leaves the limits."""
    if len(posture) != len(group):
        raise DescriptionError(
            f"{key} has {len(posture)} angles; there are {len(group)} joints: {', '.join(group.names)}."
        )
    for name, angle, low, high in zip(group.names, posture, group.lower, group.upper, strict=True):
        if not low <= angle <= high:
            raise DescriptionError(f"{key}: {name} = {angle:g} lies outside its limits [{low:.4f}, {high:.4f}] rad.")
