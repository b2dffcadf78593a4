"""The base class of all settings, and the context that settings get when they build their part."""

from __future__ import annotations

from dataclasses import dataclass, fields, is_dataclass
from math import isfinite
from typing import Annotated, Any, ClassVar, Protocol, Self

import numpy as np
from annotated_types import Gt, Predicate

from somatopy.contract import Body
from somatopy.percept import Floats, JointGroup, Robot
from somatopy.registry.places import NAMES
from somatopy.validation import explain, read

__all__ = ["BuildContext", "Finite", "Positive", "Settings", "table_of"]

#: Numbers as settings have them.
Finite = Annotated[float, Predicate(isfinite)]
Positive = Annotated[float, Gt(0), Predicate(isfinite)]


class BuildContext(Protocol):
    """What settings know about the experiment when they build a part, including the parts built so far.

    The body is built first, then eye, babbler and learner, and the interventions last. Asking for something that is not
    built yet, or that this robot does not have, raises a ValueError.
    """

    @property
    def description(self) -> Any:
        """The whole experiment."""
        ...

    @property
    def rng(self) -> np.random.Generator:
        """The part's own random numbers."""
        ...

    @property
    def body(self) -> Body:
        """The robot."""
        ...

    @property
    def arm(self) -> JointGroup:
        """The arm's joints."""
        ...

    @property
    def arm_speed(self) -> float | None:
        """Speed of the arm's set-points, rad/s, if the babbler's settings give it."""
        ...

    @property
    def start(self) -> Floats:
        """The arm's posture at time 0, shape (n_arm,), rad."""
        ...

    @property
    def robot(self) -> Robot:
        """What a learner is told of the robot."""
        ...

    def told(self, **more: Any) -> BuildContext:
        """A copy of the context with further attributes, for the parts that a part itself is made of."""
        ...

    def range(self, name: str) -> Floats:
        """Low and high of each arm joint (n_arm, 2), rad, of a babbling range that the body names."""
        ...

    def babbled(self, count: int) -> Floats:
        """Arm postures (count, n_arm), rad, from babbling of their own."""
        ...

    def best_fixed_head(self) -> Floats:
        """The head posture that sees the hand in most babbled arm postures, shape (n_head,), rad."""
        ...


@dataclass(frozen=True)
class Settings:
    """Typed and validated settings of a part. Derive a frozen dataclass, whose docstring describes the part."""

    #: For pydantic: an unknown key is an error.
    __pydantic_config__: ClassVar[Any] = {"extra": "forbid"}

    def build(self, context: BuildContext) -> Any:
        """The part.

        Raises:
            ValueError: the settings do not fit the robot.
        """
        raise NotImplementedError(f"{type(self).__qualname__} has no build(context)")

    @property
    def kind(self) -> str:
        """Its name in a description."""
        return kind_of(type(self))

    def replaced(self, **changes: Any) -> Self:
        """A copy with some settings changed, validated again.

        Raises:
            ValueError: an unknown setting, or a value that is not valid.
        """
        from pydantic import ValidationError

        values = table_of(self)
        try:
            return read(type(self), values | changes)
        except ValidationError as error:
            raise ValueError(f"The changed {self.kind}: {explain(error, lambda _: list(values))}.") from error


def table_of(settings: Any) -> dict[str, Any]:
    """Settings as a table, with nested tables. Settings of other parts stay as they are; they validate themselves."""
    values = {entry.name: getattr(settings, entry.name) for entry in fields(settings)}
    return {key: table_of(value) if _is_table(value) else value for key, value in values.items()}


def _is_table(value: Any) -> bool:
    return is_dataclass(value) and not isinstance(value, Settings | type)


def kind_of(settings: type[Settings]) -> str:
    """The name of a class of settings: the registered one, or its place."""
    own = vars(settings).get("own_kind")
    place = f"{settings.__module__}:{settings.__qualname__}"
    return str(own) if own is not None else NAMES.get(place, place)
