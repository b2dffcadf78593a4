"""Changes a description by short words and dotted keys, as on the command line and in studies."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import accumulate, pairwise
from typing import Any

from somatopy.experiment.description import SHORT_FORMS, Description, DescriptionError, frames_of, stands_for, validated
from somatopy.experiment.presets import CONTROLS
from somatopy.interventions import SUITE
from somatopy.registry import INTERVENTIONS
from somatopy.validation import near

__all__ = ["SHORT_WORDS", "changed", "damage_named", "flagged", "replace_short", "scaled", "standing_for"]

#: Words that stand for changes of more than one key, and are no dotted keys.
SHORT_WORDS = ("eye", "motion", "learner", "minutes", "damage_minutes", "damage", "healed_minutes")

#: Name of the phase in which the damage is undone.
HEALED = "healed"


def changed(
    description: Description, changes: Mapping[str, Any], source: str = "The changed experiment"
) -> Description:
    """A changed copy of a description. Short words are applied first, then dotted keys, and the control last.

    Args:
        description: what is changed.
        changes: values by short word (`SHORT_WORDS`), by dotted key such as "babbling.speed" or "phases.1.plastic", or
            by "control", whose value is the name of one of `CONTROLS`. A key that names a part takes the name of a kind
            or a whole table. Keys joined by + get the same value.
        source: name of the result in error messages.

    Raises:
        DescriptionError: an unknown key (the valid ones are listed), a wrong type or value.

    Example:
        >>> from somatopy.experiment import paper
        >>> slow = changed(paper(), {"minutes": 2, "babbling.speed": 0.25, "control": "frozen"})
        >>> slow.phases[0].frames, slow.babbling.speed, slow.phases[0].interventions[0].parts
        (1800, 0.25, ('links',))
    """
    words = {key.strip().replace("-", "_"): value for keys, value in changes.items() for key in keys.split("+")}
    table = _lists(flagged({key: words[key] for key in SHORT_WORDS if key in words}, description, "damage ="))
    for key in sorted(words.keys() - {*SHORT_WORDS, "control"}, key=_depth):
        _set(table, key, words[key])
    found = validated(table, source)
    control = words.get("control", "none")
    if control == "none":
        return found
    if not isinstance(control, str) or control not in CONTROLS:
        raise DescriptionError(f"control = {control!r} is unknown; choose none or one of {', '.join(CONTROLS)}.")
    return CONTROLS[control](found)


def _depth(key: str) -> tuple[int, str]:
    """In which order keys are set: a part before its settings, which another kind would undo."""
    return key.count(".") - key.endswith(".kind"), key


def _lists(value: Any) -> Any:
    """The same with lists for tuples, so that every entry can be set."""
    if isinstance(value, dict):
        return {key: _lists(entry) for key, entry in value.items()}
    return [_lists(entry) for entry in value] if isinstance(value, list | tuple) else value


def flagged(short: Mapping[str, Any], description: Description, damage: str = "--damage") -> dict[str, Any]:
    """The description as a table, changed by short words. A word that is absent or None changes nothing.

    Args:
        short: values by short word.
        description: what is changed.
        damage: name of the word `damage` in error messages.

    Raises:
        DescriptionError: minutes are negative, or the damage is unknown.
    """
    words = {key: value for key in SHORT_WORDS if (value := short.get(key)) is not None}
    table = description.model_dump()
    table["phases"] = [{**phase, "interventions": list(phase["interventions"])} for phase in table["phases"]]
    if "motion" in words:
        table["body"]["motion"] = words["motion"]
    for part in ("learner", "eye"):
        if part in words:
            _choose(table, part, words[part])
    if "minutes" in words:
        table["phases"][0]["frames"] = frames_of(words["minutes"])
    if "damage_minutes" in words or "damage" in words:
        _damage_second(table["phases"], words, damage)
    if "healed_minutes" in words:
        _heal_last(table["phases"], frames_of(words["healed_minutes"]))
    return table


def scaled(description: Description, minutes: float | None) -> Description:
    """A description whose phases last that many minutes together, each in proportion; as it was if None.

    Raises:
        DescriptionError: minutes that are negative or no number.

    Example:
        >>> from somatopy.experiment import paper
        >>> [phase.frames for phase in scaled(paper(), 10).phases]
        [5844, 3156]
    """
    if minutes is None:
        return description
    total, before = frames_of(minutes), description.frames
    ends = [
        round(total * end / before) if before else total for end in accumulate(p.frames for p in description.phases)
    ]
    lengths = [end - start for start, end in pairwise([0, *ends])]
    phases = [phase.replaced(frames=length) for phase, length in zip(description.phases, lengths, strict=True)]
    return description.replaced(phases=phases)


def _damage_second(phases: list[dict[str, Any]], words: Mapping[str, Any], damage: str) -> None:
    if len(phases) < 2:
        damaged = {"name": "damaged", "frames": 0, "interventions": [{"kind": "offset"}], "trend_breaks": (7,)}
        phases.append(damaged)
    if "damage_minutes" in words:
        phases[1]["frames"] = frames_of(words["damage_minutes"])
    if "damage" in words:
        replace_short(phases[1]["interventions"], "damage", damage_named(words["damage"], damage))


def _heal_last(phases: list[dict[str, Any]], frames: int) -> None:
    """Let a phase without damage come last: what was known before the damage, is it kept?"""
    if phases[-1]["name"] != HEALED:
        phases.append({"name": HEALED, "frames": 0})
    phases[-1]["frames"] = frames


def damage_named(text: Any, word: str) -> dict[str, Any] | None:
    """A damage from its short form; None for no damage.

    Args:
        text: "none", "paper", "offset:A,B,C,D" in rad, a kind of intervention, one of `SUITE`, or a table of settings.
        word: its name in error messages.

    Raises:
        DescriptionError: it is unknown.
    """
    if isinstance(text, Mapping):
        return None if text.get("kind") == "none" else dict(text)
    kind, _, numbers = str(text).partition(":")
    if text == "none":
        return None
    if text == "paper":
        return {"kind": "offset"}
    if text in SUITE:
        return dict(SUITE[text])
    if kind == "offset" and numbers:
        try:
            return {"kind": "offset", "offset": tuple(float(n) for n in numbers.split(","))}
        except ValueError as error:
            raise DescriptionError(f"{word} {text!r}: {error}. Write numbers, rad, one a joint.") from error
    if text == "offset" or (text not in INTERVENTIONS and not numbers):
        known = [name for name in dict.fromkeys([*INTERVENTIONS, *SUITE]) if name != "offset"]
        others = ", ".join(known)
        raise DescriptionError(
            f"{word} {text!r} is unknown; choose none, paper or offset:a,b,c,d (rad, one a joint), another damage or "
            f"intervention ({others}){near(text, known)}, or name one of your own by its place: "
            "my_package.my_file:MyDamage."
        )
    return {"kind": text}


def replace_short(interventions: list[dict[str, Any]], key: str, new: dict[str, Any] | None) -> None:
    """Replace the interventions that a short form of a phase stands for by another one, or remove them."""
    places = standing_for(key, interventions)
    for place in reversed(places):
        del interventions[place]
    if new is not None:
        order = list(SHORT_FORMS)
        behind = [
            k for k, entry in enumerate(interventions) if _short_of(entry.get("kind", ""), order) <= order.index(key)
        ]
        interventions.insert(places[0] if places else max(behind, default=-1) + 1, new)


def standing_for(key: str, interventions: Sequence[Mapping[str, Any]]) -> list[int]:
    """Indices of the interventions that a short form of a phase stands for."""
    return [k for k, entry in enumerate(interventions) if stands_for(key, entry.get("kind", ""))]


def _short_of(kind: str, order: list[str]) -> int:
    return next(k for k, key in enumerate(order) if stands_for(key, kind))


# -- dotted keys -------------------------------------------------------------------------------------------------------


def _set(table: dict[str, Any], key: str, value: Any) -> None:
    """Set what stands at a dotted key; of another kind than before, a part begins with its defaults."""
    path = key.split(".")
    parent, last = _parent(table, path), path[-1]
    if path[0] == "phases" and len(path) == 3 and last in SHORT_FORMS:
        _set_short(parent, last, value, key)
    elif last == "kind":
        _choose(_parent(table, path[:-1]), path[-2], value)
    elif isinstance(parent, list):
        parent[_place(parent, last, key)] = value
    else:
        _choose(parent, last, value)


def _parent(table: dict[str, Any], path: Sequence[str]) -> Any:
    """The table or list in which the last of some keys stands."""
    found: Any = table
    for depth, key in enumerate(path[:-1]):
        if isinstance(found, list | tuple):
            found = found[_place(found, key, ".".join(path))]
        else:
            valid = found
            found = found.get(key) if isinstance(found, Mapping) else None
            if not isinstance(found, dict | list | tuple):
                there = f"; keys there: {', '.join(valid)}" if isinstance(valid, Mapping) else ""
                where = ".".join(path[: depth + 1])
                raise DescriptionError(f"{'.'.join(path)!r}: {where!r} is no table of this experiment{there}.")
    return found


def _place(entries: Sequence[Any], key: str, whole: str) -> int:
    if not (key.isdigit() and int(key) < len(entries)):
        raise DescriptionError(f"{whole!r}: there is no entry {key!r}; there are {len(entries)}, counted from 0.")
    return int(key)


def _choose(parent: dict[str, Any], name: str, value: Any) -> None:
    """Set a value; where a part stands, the name of its kind keeps its settings and another kind replaces them."""
    part = parent.get(name)
    if isinstance(part, Mapping) and "kind" in part and isinstance(value, str):
        if part["kind"] != value:
            parent[name] = {"kind": value}
    else:
        parent[name] = value


def _set_short(phase: dict[str, Any], key: str, value: Any, whole: str) -> None:
    """Set a short form of a phase."""
    new: dict[str, Any] | None
    if key == "damage":
        new = damage_named(value, whole)
    elif key == "plastic":
        new = {"kind": "plastic", "parts": [value] if isinstance(value, str) else value}
    else:
        choices = ["continue", *sorted(SHORT_FORMS["start"])]
        if value not in choices:
            raise DescriptionError(f"{whole} = {value!r} is unknown; choose one of {', '.join(choices)}.")
        new = None if value == "continue" else {"kind": value}
    replace_short(phase["interventions"], key, new)
