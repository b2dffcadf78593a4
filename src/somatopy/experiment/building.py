"""Builds parts from their settings, and settings from parts that are given in Python; reports whatever does not fit."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from typing import Any

from somatopy.bodies import Anatomy, BodyError, NoGL, anatomy_path
from somatopy.contract import Body, missing_members
from somatopy.experiment.context import Context
from somatopy.experiment.description import Description, DescriptionError
from somatopy.experiment.provenance import line_of
from somatopy.percept import JointGroup
from somatopy.registry import BABBLERS, BODIES, EYES, INTERVENTIONS, LEARNERS, Kinds, Settings, handed_over

__all__ = ["arm_of", "built", "check_numbers", "hand_over", "handed_over_again", "said_of"]

#: Parts that may be handed over, where a description has them, and their kinds.
_WHERE: dict[str, tuple[str, Kinds]] = {
    "body": ("body", BODIES),
    "eye": ("eye", EYES),
    "babbler": ("babbling", BABBLERS),
    "learner": ("learner", LEARNERS),
}


@contextmanager
def said_of(key: str) -> Iterator[None]:
    """Raise errors of values that come up while a part is built as errors of the description, which name its key.

    Errors of any other sort, as code of somebody's own may raise, get a note that names it.
    """
    try:
        yield
    except (DescriptionError, BodyError, NoGL, ImportError):
        raise
    except ValueError as error:
        raise DescriptionError(f"{key}: {str(error).rstrip('.')}.") from error
    except Exception as error:
        error.add_note(f"This came while the part {key} of the experiment was made{line_of(error)}.")
        raise


def built(key: str, contract: type, settings: Settings, context: Context) -> Any:
    """Build the part that settings describe, and check that it has all members of its contract."""
    with said_of(key):
        part = settings.build(context)
    if lacks := missing_members(part, contract):
        raise DescriptionError(
            f"{key}: a {type(part).__name__} lacks {', '.join(lacks)}, which the contract "
            f"{contract.__name__} asks for (somatopy.contract)."
        )
    return part


def arm_of(description: Description) -> JointGroup:
    """The joints of the arm that an experiment moves. Its body is built for that, and closed.

    Raises:
        DescriptionError: the body does not fit its contract.
        BodyError: the robot's model or anatomy does not fit.
    """
    body: Body = built("body", Body, description.body, Context(description))
    try:
        return body.arm
    finally:
        body.close()


def check_numbers(description: Description) -> None:
    """Check, before anything is simulated, that babbling range and offsets have one entry for each joint of the arm.

    Only parts that come with somatopy are checked, and only the anatomy file is read. The session finds all other
    faults.

    Raises:
        DescriptionError: a number of entries is wrong.
    """
    body, babbling = description.body, description.babbling
    if body.kind != "mujoco":
        return
    with suppress(BodyError):
        joints = Anatomy.load(anatomy_path(str(getattr(body, "model", "")))).arm.joints
        if babbling.kind == "uniform":
            _check_number("babbling.range", "intervals", getattr(babbling, "range", None), joints)
        for index, phase in enumerate(description.phases):
            for place, settings in enumerate(phase.interventions):
                if settings.kind == "offset":
                    key = f"phases.{index}.interventions.{place}.offset"
                    _check_number(key, "offsets", getattr(settings, "offset", None), joints)


def _check_number(key: str, what: str, given: Any, joints: tuple[str, ...]) -> None:
    if isinstance(given, tuple) and len(given) != len(joints):
        raise DescriptionError(
            f"{key}: {len(given)} {what}; the arm has {len(joints)} joints: {', '.join(joints)}. Give one for each."
        )


def hand_over(
    description: Description,
    *,
    body: Any = None,
    eye: Any = None,
    babbler: Any = None,
    learner: Any = None,
    interventions: Mapping[str, Iterable[Any]] | None = None,
) -> Description:
    """The description, in which parts that are given in Python replace its own; see `Session`.

    Raises:
        DescriptionError: an object is neither a part nor makes one, or there is no phase of that name.
    """
    given = {
        "body": (BODIES, body),
        "eye": (EYES, eye),
        "babbling": (BABBLERS, babbler),
        "learner": (LEARNERS, learner),
    }
    changes: dict[str, Any] = {}
    for key, (kinds, part) in given.items():
        if part is not None:
            with said_of(key):
                changes[key] = handed_over(kinds, part)
    if interventions:
        changes["phases"] = _with_interventions(description, interventions)
    return description.replaced(**changes) if changes else description


def _with_interventions(description: Description, interventions: Mapping[str, Iterable[Any]]) -> list[Any]:
    names = [phase.name for phase in description.phases]
    if not isinstance(interventions, Mapping) or not all(map(_lists, interventions.values())):
        raise DescriptionError(
            f"interventions: must be lists by the name of their phase, such as {{{names[0]!r}: [...]}}."
        )
    if unknown := [name for name in interventions if name not in names]:
        raise DescriptionError(f"interventions: there is no phase {unknown[0]!r}; phases: {', '.join(names)}.")
    return [
        phase.replaced(interventions=(*phase.interventions, *interventions.get(phase.name, ())))
        for phase in description.phases
    ]


def _lists(own: Any) -> bool:
    return isinstance(own, Iterable) and not isinstance(own, str)


def handed_over_again(table: dict[str, Any], given: Mapping[str, Any], forked: bool = False) -> dict[str, Any]:
    """Put parts that were given to a run in Python, and are given again to continue it, into its description.

    Args:
        table: the description as plain data, as its file has it.
        given: the parts by the names of the arguments of `Session`.
        forked: whether they may include interventions that only the fork of a run has.

    Returns:
        The description as plain data, with these parts.

    Raises:
        DescriptionError: an object is neither a part nor makes one, or the run began with another part.
    """
    found = dict(table)
    for name, part in given.items():
        if name == "interventions":
            with said_of(name):
                found["phases"] = _interventions_again(table.get("phases", []), part, forked)
            continue
        key, kinds = _WHERE[name]
        with said_of(name):
            own, recorded = handed_over(kinds, part), table.get(key, {}).get("kind")
        if own.kind != recorded:
            raise DescriptionError(f"The run began with the {name} {recorded!r}; {own.kind!r} was handed over.")
        found[key] = table[key] | {"kind": type(own)}
    return found


def _interventions_again(phases: list[dict[str, Any]], given: Mapping[str, Any], forked: bool) -> list[dict[str, Any]]:
    own = {}
    for name, parts in given.items():
        began = [entry.get("kind") for p in phases if p.get("name") == name for entry in p.get("interventions", [])]
        for entry in (handed_over(INTERVENTIONS, part) for part in parts):
            if entry.kind not in began and not forked:
                raise DescriptionError(
                    f"The run began without the intervention {entry.kind!r} in a phase {name!r}. Hand over those that "
                    "it began with; to go on with others, fork it."
                )
            own[entry.kind] = type(entry)
    return [
        phase
        | {
            "interventions": [
                entry | {"kind": own.get(entry.get("kind"), entry.get("kind"))}
                for entry in phase.get("interventions", [])
            ]
        }
        for phase in phases
    ]
