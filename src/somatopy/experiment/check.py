"""The laws of damages, tried on any implementation."""

from __future__ import annotations

from collections.abc import Callable
from copy import deepcopy
from typing import Any

import numpy as np

from somatopy.bodies import Body, MujocoBody
from somatopy.contract import check_members, facts, law, same
from somatopy.experiment.damage import Damage
from somatopy.percept import Percept, Sighting

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
    damage, body = make(), make_body()
    check_members(damage, Damage)
    with law("alters_ceiling is True or False", "say whether the injured body sees otherwise") as holds:
        holds(isinstance(damage.alters_ceiling, bool), "{!r}", damage.alters_ceiling)
    try:
        percepts = _percepts(body)
        _senses_soundly(make, percepts)
        _draws_from_the_generator(make, percepts)
        _heals_what_it_injured(make(), body)
    finally:
        body.close()


def _percepts(body: Body) -> list[Percept]:
    rng, found = np.random.default_rng(0), []
    for k in range(60):
        arm, head, arm_command, head_command = (rng.uniform(g.lower, g.upper) for g in 2 * (body.arm, body.head))
        sighting = Sighting((99.0, 77.0), 1, 400.0) if k % 2 else None
        found.append(Percept(k / 15, arm, head, arm_command, head_command, sighting, 1 / 15))
    return found


def _senses_soundly(make: Make, percepts: list[Percept]) -> None:
    damage, rng, before = make(), np.random.default_rng(1), list(map(facts, percepts))
    with law("sense leaves its percept alone", "make a new one: dataclasses.replace(percept, arm=...)") as holds:
        sensed = [damage.sense(percept, rng) for percept in percepts]
        for old, given in zip(before, percepts, strict=True):
            holds(same(old, facts(given)), "{} became {}", old, given)
    with law("sense gives a percept of the same shapes, finite", "change values only") as holds:
        for percept, after in zip(percepts, sensed, strict=True):
            holds(isinstance(after, Percept), "{}", after)
            for name in ("arm", "head", "arm_command", "head_command"):
                vector = getattr(after, name)
                fits = np.shape(vector) == getattr(percept, name).shape
                holds(fits and np.isfinite(vector).all(), "{} = {}", name, vector)


def _draws_from_the_generator(make: Make, percepts: list[Percept]) -> None:
    with law("sense draws from the generator that it is given", "use its argument rng and no other source") as holds:
        twins = [(make(), np.random.default_rng(2)) for _ in range(2)]
        for k, percept in enumerate(percepts):
            a, b = (facts(damage.sense(percept, rng)) for damage, rng in twins)
            holds(same(a, b), "two equal generators gave {} and {} in frame {}", a, b, k)


def _heals_what_it_injured(damage: Damage, body: Body) -> None:
    _start(body)
    state = deepcopy(body.state())
    intact = _seen_from(body, state)
    with law("alters_ceiling is True where an injury changes what the camera can see", "set it to True") as holds:
        damage.injure(body)
        views = [[moment["view"] for moment in moments] for moments in (intact, _seen_from(body, state))]
        holds(damage.alters_ceiling or same(*views), "the injured body has other poses on the same commands")
    with law("heal undoes all that injure did to the body", "keep what injure replaces, and put it back") as holds:
        damage.heal(body)
        holds(same(_seen_from(body, state), intact), "other readings from the same state on the same commands")
        _start(body)
        holds(same(body.state(), state), "reset and a step lead to another state")


def _start(body: Body) -> None:
    body.reset(0)
    body.step(body.arm.lower, body.head.upper)


def _seen_from(body: Body, state: dict[str, Any]) -> list[dict[str, Any]]:
    """What a body senses in a state, and in 20 frames on the way from there to the middle of its ranges."""
    arm, head = (0.5 * (group.lower + group.upper) for group in (body.arm, body.head))
    return [facts(body.restore(deepcopy(state))), *(facts(body.step(arm, head)) for _ in range(20))]
