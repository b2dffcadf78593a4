"""A description file that starts from a preset: what it says replaces what the preset says, key by key."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from somatopy.experiment.description import DescriptionError
from somatopy.experiment.presets import PRESETS
from somatopy.validation import meant

__all__ = ["from_preset"]


def from_preset(table: Mapping[str, Any], source: str) -> dict[str, Any]:
    """The whole table of a description file that names a preset.

    Tables are joined key by key. A part of another kind than the preset's begins with its own defaults, and a list,
    such as `phases`, is replaced as a whole.

    Args:
        table: the parsed TOML, with the key `preset`.
        source: what to call the file in an error.

    Raises:
        DescriptionError: there is no such preset.

    Example:
        >>> found = from_preset({"preset": "paper", "seed": 3, "babbling": {"speed": 0.5}}, "my.toml")
        >>> found["seed"], found["babbling"]["range"], found["babbling"]["speed"]
        (3, 'confined', 0.5)
    """
    own = dict(table)
    name = own.pop("preset")
    if not isinstance(name, str) or name not in PRESETS:
        asked = meant(str(name), PRESETS)
        raise DescriptionError(f"{source}: there is no preset {name!r}. {asked}Choose one of {', '.join(PRESETS)}.")
    return _joined(PRESETS[name]().model_dump(mode="json"), own)


def _joined(before: Mapping[str, Any], own: Mapping[str, Any]) -> dict[str, Any]:
    return {**before, **{key: _entry(before.get(key), value) for key, value in own.items()}}


def _entry(before: Any, value: Any) -> Any:
    """One entry of a table; a text in the place of a part is the name of its kind."""
    if not isinstance(before, Mapping):
        return value
    table = {"kind": value} if "kind" in before and isinstance(value, str) else value
    if not isinstance(table, Mapping) or table.get("kind", before.get("kind")) != before.get("kind"):
        return value
    return _joined(before, table)
