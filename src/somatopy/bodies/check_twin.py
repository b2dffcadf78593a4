"""A check that a body with a model of itself keeps the contract `Twin`."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from somatopy.contract import Alterable, facts, law, same
from somatopy.percept import Floats, Shapes, View

__all__ = ["check_twin"]

#: How far joints that are neither arm nor head may move a pose, m, and turn it (entries of the rotation matrix), once
#: the body moves; at the start only rounding is allowed.
_SWAY = 0.02
_ROUNDING = 1e-6
#: What is tried of a body that is `Alterable`.
_ALTERATIONS = {"turn_camera": (0.1, 0.2), "move_marker": (0.05,), "stretch_arm": (1.1,), "pace_arm": (0.7,)}


def check_twin(start: Callable[[int], Any], injure: Callable[[Any], object] | None) -> None:
    """Check that a body keeps the contract of `Twin`.

    Args:
        start: function that makes a new body and resets it with the seed that it is given.
        injure: function that changes the body it is given, as a damage does. With None, this check is left out.

    Raises:
        ContractError: the body breaks a law. The message says which law, what was seen, and how to mend it.
    """
    _names_ranges(start(0))
    _imagines_what_is_sensed(start(0))
    _keeps_still(start(3), start(3))
    _clips_heads(start(0))
    _makes_another(start(0), start(0))
    _has_one_fingerprint(start(0), start(5))
    if isinstance(body := start(0), Alterable):
        _undoes_alterations(body)
    if injure is not None:
        _shows_injuries(start(0), injure)


def _targets(body: Any, count: int = 40) -> list[tuple[Floats, Floats]]:
    rng = np.random.default_rng(0)
    return [(rng.uniform(*body.arm.space.limits.T), rng.uniform(*body.head.space.limits.T)) for _ in range(count)]


def _play(body: Any, count: int = 40) -> list[dict[str, Any]]:
    return [facts(body.step(arm, head)) for arm, head in _targets(body, count)]


def _names_ranges(body: Any) -> None:
    with law(
        "occluders are Shapes, and ranges are low and high of each arm joint, inside its limits",
        "set occluders in __init__, and ranges to a mapping from names to arrays (n_arm, 2)",
    ) as holds:
        holds(isinstance(body.occluders, Shapes), "the occluders {}", body.occluders)
        for name, bounds in body.ranges.items():
            fits = np.shape(bounds) == (len(body.arm), 2) and (bounds[:, 0] <= bounds[:, 1]).all()
            holds(fits, "the range {!r} {} for {}", name, bounds, body.arm.names)
            inside = (body.arm.lower <= bounds[:, 0]).all() and (bounds[:, 1] <= body.arm.upper).all()
            holds(inside, "the range {!r} {} beyond {}", name, bounds, body.arm.space.limits)


def _imagines_what_is_sensed(body: Any) -> None:
    with law(
        "view at the sensed posture is the reading's view, but for joints that are neither arm nor head",
        "compute both from one model, in the order of the posture vectors, and let all other joints stand still (in an "
        'anatomy: [add] freeze = "rest")',
    ) as holds:
        readings = [body.reset(0), *(body.step(arm, head) for arm, head in _targets(body))]
        for reading in filter(lambda reading: reading.view is not None, readings):
            seen, imagined = _poses(reading.view), _poses(body.view(reading.arm, reading.head))
            holds(seen.shape == imagined.shape, "{} poses sensed, {} imagined", len(seen), len(imagined))
            apart, at = np.abs(seen - imagined).max(), (reading.arm, reading.head)
            most = _SWAY if reading.time else _ROUNDING
            holds(apart <= most, "they differ by {} at arm and head {}", apart, at)


def _poses(view: View) -> Floats:
    return np.vstack([view.camera, view.marker, view.occluders])


def _keeps_still(asked: Any, unasked: Any) -> None:
    with law(
        "view, legal, fingerprint and another move nothing and change nothing",
        "imagine in a second copy of the simulation's state",
    ) as holds:
        (low, high), arm = asked.head.space.limits.T, asked.arm.lower
        before = [facts(asked.view(arm, head)) for head in (low, high)]
        _play(asked, 5), _play(unasked, 5)
        after = [facts(asked.view(arm, head)) for head in (low, high)]
        holds(same(before, after), "view depends on more than the postures that it is asked for")
        asked.legal(high), asked.fingerprint()
        second = asked.another()
        second.reset(0)
        _play(second, 7)
        second.close()
        holds(same(_play(asked, 10), _play(unasked, 10)), "asked for them, the body moved otherwise")


def _clips_heads(body: Any) -> None:
    with law(
        "legal clips a head posture to all limits, and leaves a legal one as it is",
        "clip to the position limits first, then to those that couple joints",
    ) as holds:
        group = body.head
        for head in np.random.default_rng(0).uniform(
            2 * group.lower - group.upper, 2 * group.upper - group.lower, (200, len(group))
        ):
            given, found = head.copy(), body.legal(head)
            holds(same(given, head), "legal changed the posture that it was given")
            inside = np.shape(found) == head.shape and (group.lower <= found).all() and (found <= group.upper).all()
            holds(inside, "{} for {} of {}", found, head, group.names)
            holds(same(body.legal(found), found), "{} for {}, which is legal", body.legal(found), found)


def _makes_another(body: Any, twin: Any) -> None:
    second = body.another()
    try:
        with law("another moves alike, by itself", "build it from the same model, with a state of its own") as holds:
            holds(second is not body, "it is the body itself")
            holds(same(facts(second.reset(0)), facts(twin.reset(0))), "it starts otherwise")
            holds(same(_play(second), _play(twin)), "it moves otherwise")
    finally:
        second.close()


def _has_one_fingerprint(body: Any, other: Any) -> None:
    with law(
        "equal bodies have one fingerprint, whatever they have done", "hash what they are made of, not where they are"
    ) as holds:
        first = body.fingerprint()
        holds(isinstance(first, bytes), "{!r}", first)
        _play(other, 5)
        holds(same(other.fingerprint(), first), "two fingerprints of equal bodies")
        second = other.another()
        fingerprint = second.fingerprint()
        second.close()
        holds(same(fingerprint, first), "another one of another")


def _shows_injuries(body: Any, injure: Callable[[Any], object]) -> None:
    before, (arm, head) = body.fingerprint(), _targets(body, 1)[0]
    injure(body)
    second = body.another()
    try:
        with law("an injury changes the fingerprint", "hash the model as it is now") as holds:
            holds(not same(body.fingerprint(), before), "the same fingerprint")
        with law("another has the injuries too", "copy the model as it is now") as holds:
            holds(same(second.fingerprint(), body.fingerprint()), "two fingerprints")
            holds(same(facts(second.view(arm, head)), facts(body.view(arm, head))), "two views of one posture")
    finally:
        second.close()


def _undoes_alterations(body: Any) -> None:
    arm, head = _targets(body, 1)[0]

    def said() -> list[Any]:
        return [body.fingerprint(), facts(body.view(arm, head)), facts(body.occluders)]

    for name, arguments in _ALTERATIONS.items():
        before = said()
        try:
            undo = getattr(body, name)(*arguments)
        except ValueError:  # this body cannot have it
            continue
        with law("what is altered counts in the fingerprint", "hash the model as it is now") as holds:
            holds(not same(body.fingerprint(), before[0]), "the same fingerprint after {}{}", name, arguments)
        undo()
        with law("what an alteration returns undoes it", "keep what it replaces, and put it back") as holds:
            holds(same(said(), before), "another body after {}{} was undone", name, arguments)
