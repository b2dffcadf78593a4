"""Adding to a model what its own default classes must not change."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import mujoco
import numpy as np

__all__ = ["add_plain"]

_OWN = ("name", "id", "info", "signature")  # these make a thing that thing
_NUMBERS = (bool, int, float, str, np.ndarray)


def add_plain(add: Callable[..., Any], **values: Any) -> Any:
    """Add something to a spec with MuJoCo's defaults, whatever the model's `<default>` says.

    A model in which all meshes are scaled by 0.001, or all geoms are invisible unless they say otherwise, would else do
    the same to what is added.

    Args:
        add: what adds it: a method of a spec, or of a body of one.
        values: what it is to be, by the names of MuJoCo's attributes.

    Example:
        >>> spec = mujoco.MjSpec.from_string("<mujoco><default><geom group='3'/></default><worldbody/></mujoco>")
        >>> geoms = spec.worldbody.add_geom(), add_plain(spec.worldbody.add_geom, name="ball", size=(0.1, 0, 0))
        >>> [geom.group for geom in geoms]
        [3, 0]
    """
    thing, fresh = add(), _fresh(add.__name__)
    for name in dir(fresh):
        value: Any = None if name.startswith("_") or name in _OWN else getattr(fresh, name)
        if name == "alt":
            thing.alt.type = value.type
        elif isinstance(value, _NUMBERS) or type(value).__name__.startswith("mjt"):
            setattr(thing, name, value)
    for name, value in values.items():
        setattr(thing, name, value)
    return thing


def _fresh(add: str) -> Any:
    """The same in an empty model."""
    spec = mujoco.MjSpec()
    body = spec.worldbody.add_body()
    return getattr(body if hasattr(body, add) else spec, add)()
