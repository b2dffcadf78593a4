"""The laws of damages, tried on any implementation."""

from __future__ import annotations

from collections.abc import Callable
from copy import deepcopy

import numpy as np

from somatopy.bodies import Body, MujocoBody
from somatopy.contract import law, missing, same
from somatopy.experiment.damage import Damage
from somatopy.percept import Floats, JointGroup, Percept, Reading, Sighting

__all__ = ["check_damage"]

Make = Callable[[], Damage]


def _kinematic_nao() -> Body:
    return MujocoBody("nao", motion="kinematic")


def check_damage(make: Make, make_body: Callable[[], Body] = _kinematic_nao) -> None:
    """Check that a damage keeps its contract on a body.

    Args:
        make: a fresh damage.
        make_body: a fresh body that this damage fits; the NAO by default.

    Raises:
        ContractError: it breaks a law; the message says which, what was seen and how to fix it.

    Example:
        >>> from somatopy.experiment.damage import JointOffset
        >>> check_damage(lambda: JointOffset([0.1, 0.2, 0.0, -0.1]))
    """
    with law(
        "a damage has all members of Damage, and alters_ceiling is True or False", "see Damage; derive from NoDamage"
    ) as holds:
        damage = make()
        holds(not missing(damage, Damage), "{} lacks {}", type(damage).__name__, missing(damage, Damage))
        holds(isinstance(damage.alters_ceiling, bool), "alters_ceiling is {!r}", damage.alters_ceiling)
    body = make_body()
    try:
        percepts = _percepts(body.arm, body.head)
        _senses_soundly(make, percepts)
        _draws_from_the_generator(make, percepts)
        _heals_what_it_injured(make, body)
    finally:
        body.close()


def _percepts(arm: JointGroup, head: JointGroup) -> list[Percept]:
    rng, found = np.random.default_rng(0), []
    for k in range(60):
        vectors = [rng.uniform(group.lower, group.upper) for group in (arm, head, arm, head)]
        found.append(Percept(k / 15, *vectors, sighting=Sighting((99.0, 77.0), 1, 400.0) if k % 2 else None, dt=1 / 15))
    return found


def _vectors(percept: Percept) -> dict[str, Floats]:
    return {name: getattr(percept, name) for name in ("arm", "head", "arm_command", "head_command")}


def _senses_soundly(make: Make, percepts: list[Percept]) -> None:
    damage, rng = make(), np.random.default_rng(1)
    with law("sense leaves its percept alone", "build a new one: dataclasses.replace(percept, arm=...)") as holds:
        before = deepcopy(percepts)
        sensed = [damage.sense(percept, rng) for percept in percepts]
        for old, given in zip(before, percepts, strict=True):
            holds(same(vars(old), vars(given)), "{} became {}", old, given)
    with law("sense gives a percept of the same shapes, finite", "change values only") as holds:
        for percept, after in zip(percepts, sensed, strict=True):
            holds(isinstance(after, Percept), "{}", after)
            for name, vector in _vectors(after).items():
                fits = np.shape(vector) == getattr(percept, name).shape
                holds(fits and np.isfinite(vector).all(), "{} = {}", name, vector)


def _draws_from_the_generator(make: Make, percepts: list[Percept]) -> None:
    with law(
        "sense draws from the generator that it is given, and from no other",
        "use its argument rng, never numpy.random, random or a generator of its own",
    ) as holds:
        a, b = (
            [vars(damage.sense(percept, rng)) for percept in percepts]
            for damage, rng in ((make(), np.random.default_rng(2)) for _ in range(2))
        )
        different = [k for k in range(len(a)) if not same(a[k], b[k])]
        holds(not different, "with equal generators percept {} differs", different and different[0])


def _heals_what_it_injured(make: Make, body: Body) -> None:
    middle = {"arm": 0.5 * (body.arm.lower + body.arm.upper), "head": 0.5 * (body.head.lower + body.head.upper)}
    body.reset(0)
    body.step(**middle)
    start = deepcopy(body.state())
    here, ahead = _seen(body.restore(start)), _future(body, middle)
    damage = make()
    body.restore(start)
    with law("alters_ceiling is True where an injury changes what the camera can see", "set it to True") as holds:
        damage.injure(body)
        injured = _seen(body.restore(start)), _future(body, middle)
        unseen = injured[0].get("camera") is None or same(_views(injured), _views((here, ahead)))
        holds(unseen or damage.alters_ceiling, "the injured body has other poses at the same commands")
    with law("heal undoes all that injure did to the body", "keep what injure replaces, and put it back") as holds:
        damage.heal(body)
        holds(same(_seen(body.restore(start)), here), "another reading in the same state")
        holds(same(_future(body, middle), ahead), "another movement from the same state on the same commands")
        body.reset(0)
        body.step(**middle)
        holds(same(body.state(), start), "reset and a step lead to another state")


def _future(body: Body, targets: dict[str, Floats]) -> list[dict[str, object]]:
    return [_seen(body.step(**targets)) for _ in range(20)]


def _seen(reading: Reading) -> dict[str, object]:
    """All of a reading but its picture, copied."""
    view = {} if reading.view is None else vars(reading.view)
    return deepcopy({name: value for name, value in vars(reading).items() if name not in ("image", "view")} | view)


def _views(readings: tuple[dict[str, object], list[dict[str, object]]]) -> list[list[object]]:
    return [[each.get(name) for name in ("camera", "marker", "occluders")] for each in (readings[0], *readings[1])]
