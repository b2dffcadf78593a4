"""Reads a study from TOML: a grid, a list of conditions, or random draws, and what all conditions have in common."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator, Mapping, Sequence
from itertools import product
from math import isfinite
from pathlib import Path
from typing import Any

import numpy as np

from somatopy.experiment import PRESETS, Description, DescriptionError, load_description
from somatopy.experiment.ceiling import EVERY
from somatopy.experiment.changes import changed
from somatopy.studies.plan import Condition, Study, seeds_of
from somatopy.validation import near, no_toml

__all__ = ["KEYS", "base_of", "distributions", "flattened", "load_plan", "planned", "space_of", "with_changes"]

#: Keys of a study file.
KEYS = (
    *("name", "preset", "base", "seed", "seeds", "ceilings", "ceiling_every", "keep_frames"),
    *("every", "grid", "conditions", "sweep", "search"),
)
_OF_A_CONDITION = ("name", "seed", "seeds")


def load_plan(path: str | Path) -> dict[str, Any]:
    """A study file as plain data.

    Raises:
        DescriptionError: it cannot be read, or is no TOML.
    """
    try:
        table = tomllib.loads(Path(path).read_text(encoding="utf-8-sig"))
    except OSError as error:
        raise DescriptionError(f"Cannot read the study {path}: {error.strerror}.") from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise DescriptionError(f"The study {path} {no_toml(error)}.") from error
    if "base" in table:
        table["base"] = str(Path(path).parent / str(table["base"]))
    return {"name": Path(path).stem, **table}


def planned(table: Mapping[str, Any]) -> Study:
    """A study from plain data.

    Args:
        table: `preset` or `base`, a description file; `every`, changes of all conditions; `grid`, lists of values by
            key; `conditions`, tables of changes, each with its name; `sweep`, distributions to draw from. Changes are
            as in `changed`. Where both are given, each condition is crossed with the grid and the sweep.
            The changes in `every` are applied first.

    Raises:
        DescriptionError: an unknown key, or something that cannot be run; each condition is named.
    """
    if unknown := [key for key in table if key not in KEYS]:
        raise DescriptionError(
            f"A study has no key {unknown[0]!r}; its keys: {', '.join(KEYS)}{near(unknown[0], KEYS)}."
        )
    if "search" in table:
        raise DescriptionError("A study with search proposes its conditions as it goes; it is no fixed plan.")
    base = changed(base_of(table), {"eye": "geometric"})
    base = with_changes(base, flattened(_table(table, "every")), "every")
    conditions = []
    for entry in _conditions(table):
        own_name = [entry["name"]] if "name" in entry else []
        own = {key: value for key, value in entry.items() if key not in _OF_A_CONDITION}
        seeds = seeds_of(entry.get("seeds", table.get("seeds", 1)), entry.get("seed", table.get("seed", 0)))
        for label, drawn in _draws(_table(table, "sweep")):
            for point in _points(_table(table, "grid")):
                name = ", ".join([*own_name, *label, *_labels(point)]) or "all"
                factors = {**own, **drawn, **point}
                conditions.append(
                    Condition(name, with_changes(base, factors, f"The condition {name!r}"), seeds, factors)
                )
    every = table.get("ceiling_every", EVERY)
    return Study(_name(table), tuple(conditions), _flag(table, "ceilings"), _kept(table), every)


def with_changes(base: Description, changes: Mapping[str, Any], source: str) -> Description:
    """`changed`, with a source that every error begins with."""
    try:
        return changed(base, changes, source)
    except DescriptionError as error:
        raise error if str(error).startswith(source) else DescriptionError(f"{source}: {error}") from error


def base_of(table: Mapping[str, Any]) -> Description:
    if "base" in table and "preset" in table:
        raise DescriptionError("A study begins with a preset or with a base, a description file: give one of both.")
    if "base" in table:
        return load_description(table["base"])
    preset = table.get("preset", "paper")
    if not isinstance(preset, str) or preset not in PRESETS:
        raise DescriptionError(f"preset = {preset!r} is unknown; choose one of {', '.join(PRESETS)}.")
    return PRESETS[preset]()


def _name(table: Mapping[str, Any]) -> str:
    name = table.get("name", "study")
    if not isinstance(name, str) or not name.strip():
        raise DescriptionError(f"name = {name!r} must be a text: it goes into the name of the study folder.")
    return name


def _flag(table: Mapping[str, Any], key: str, default: bool = True) -> bool:
    value = table.get(key, default)
    if not isinstance(value, bool):
        raise DescriptionError(f"{key} = {value!r} must be true or false.")
    return value


def _kept(table: Mapping[str, Any]) -> bool:
    return _flag(table, "keep_frames", default=False)


def _table(table: Mapping[str, Any], key: str) -> Mapping[str, Any]:
    found = table.get(key, {})
    if not isinstance(found, Mapping):
        raise DescriptionError(f"{key} must be a table of keys, not {found!r}.")
    own = ("draws", "seed") if key == "sweep" else ()
    if beside := [word for word in _OF_A_CONDITION if word in found and word not in own]:
        raise DescriptionError(
            f"{key} has no key {beside[0]!r}: write {beside[0]} at the top of the study, or in one of its conditions."
        )
    return found


def _conditions(table: Mapping[str, Any]) -> list[dict[str, Any]]:
    listed = table.get("conditions", [{}])
    if not isinstance(listed, list) or not all(isinstance(entry, Mapping) for entry in listed) or not listed:
        raise DescriptionError('conditions must be a list of tables, such as [[conditions]] with name = "fast".')
    names = [entry.get("name") for entry in listed] if "conditions" in table else []
    for name, entry in zip(names, listed, strict=False):
        if not name or not isinstance(name, str):
            raise DescriptionError(f"Each of the conditions needs a name, a text; {dict(entry)!r} has none.")
    return [flattened(entry) for entry in listed]


def flattened(table: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    """Nested tables as dotted keys. A table that names a kind stays whole, since it describes a part.

    Example:
        >>> flattened({"babbling": {"speed": 0.25}, "learner": {"kind": "nearest"}})
        {'babbling.speed': 0.25, 'learner': {'kind': 'nearest'}}
    """
    found: dict[str, Any] = {}
    for key, value in table.items():
        name = f"{prefix}{key}"
        if isinstance(value, Mapping) and "kind" not in value:
            found |= flattened(value, f"{name}.")
        else:
            found[name] = value
    return found


def _points(grid: Mapping[str, Any]) -> Iterator[dict[str, Any]]:
    """All points of a grid; one point without keys if there is none."""
    axes = flattened(grid)
    for key, values in axes.items():
        if not isinstance(values, list) or not values:
            raise DescriptionError(f"grid: {key} = {values!r} must be a list of the values to try.")
    for values in product(*axes.values()):
        yield dict(zip(axes, values, strict=True))


def _labels(changes: Mapping[str, Any]) -> list[str]:
    """What each change is called: by the last word of its key, or by the whole key where others end with that word."""
    ends = {key: key.rpartition(".")[2] for key in changes}
    twice = [end for end in ends.values() if [*ends.values()].count(end) > 1]
    return [f"{key if ends[key] in twice else ends[key]} {_said(value)}" for key, value in changes.items()]


def _said(value: Any) -> str:
    if isinstance(value, Mapping):
        return " ".join([str(value.get("kind", "")), *_labels({k: v for k, v in value.items() if k != "kind"})])
    return "x".join(map(_said, value)) if isinstance(value, list) else str(value)


# -- random draws ------------------------------------------------------------------------------------------------------


def _draws(sweep: Mapping[str, Any]) -> list[tuple[list[str], dict[str, Any]]]:
    """Random draws of a sweep, with what to call each; one without keys or name if there is none.

    Draws are counted, since values may be drawn twice.
    """
    if not sweep:
        return [([], {})]
    table = dict(sweep)
    draws, seed = table.pop("draws", None), table.pop("seed", 0)
    if not isinstance(draws, int) or isinstance(draws, bool) or draws < 1:
        raise DescriptionError(f"sweep: draws = {draws!r} must say how many conditions are drawn, such as 20.")
    if not isinstance(seed, int) or isinstance(seed, bool) or seed < 0:
        raise DescriptionError(f"sweep: seed = {seed!r} must be a whole number from 0 up.")
    if not table:
        raise DescriptionError(
            "sweep: name what is drawn by its key, such as babbling.speed = {low = 0.1, high = 0.8}."
        )
    rng = np.random.default_rng(seed)
    spaces = {key: space_of(key, space) for key, space in distributions(table).items()}
    found = [{key: _drawn(space, rng) for key, space in spaces.items()} for _ in range(draws)]
    return [([f"draw {k}", *_labels(_short(drawn))], drawn) for k, drawn in enumerate(found)]


def _short(drawn: Mapping[str, Any]) -> dict[str, Any]:
    return {key: f"{value:.4g}" if isinstance(value, float) else value for key, value in drawn.items()}


def distributions(table: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    """The distributions in nested tables, by dotted key."""
    found: dict[str, Any] = {}
    for key, value in table.items():
        if isinstance(value, Mapping) and not {"low", "high", "choices"} & value.keys():
            found |= distributions(value, f"{prefix}{key}.")
        else:
            found[f"{prefix}{key}"] = value
    return found


def space_of(key: str, space: Any) -> dict[str, Any]:
    """A distribution: {low, high}, with log = true or not, or {choices}; a list is a choice.

    Raises:
        DescriptionError: it is no distribution.
    """
    found: Any = {"choices": space} if isinstance(space, list) else space
    if isinstance(found, Mapping):
        if found.keys() == {"choices"} and isinstance(found["choices"], list) and found["choices"]:
            return dict(found)
        low: Any = found.get("low")
        high: Any = found.get("high")
        log = found.get("log", False)
        scaled = isinstance(log, bool) and not found.keys() - {"low", "high", "log"}
        if scaled and _is_number(low) and _is_number(high) and low < high and (not log or low > 0):
            return dict(found)
    raise DescriptionError(
        f"{key} = {space!r} is no distribution. Write {{low = 0.1, high = 0.8}}, with log = true for a logarithmic "
        "scale (low must be over 0), or a list of choices. Whole numbers as bounds give whole numbers."
    )


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and isfinite(value)


def _drawn(space: Mapping[str, Any], rng: np.random.Generator) -> Any:
    if "choices" in space:
        choices: Sequence[Any] = space["choices"]
        return choices[int(rng.integers(len(choices)))]
    low, high = space["low"], space["high"]
    whole = isinstance(low, int) and isinstance(high, int)
    if space.get("log"):
        drawn = float(np.exp(rng.uniform(np.log(low), np.log(high))))
        return round(drawn) if whole else drawn
    return int(rng.integers(low, high + 1)) if whole else float(rng.uniform(low, high))
