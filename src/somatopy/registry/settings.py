"""What configures a part: the base of all settings, and what they find when they build it."""

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
    """What an experiment hands over to settings that build a part. Each sort of part finds there what is built by then.

    The body is built first, then eye, babbler, learner, and the interventions last. What is asked for too early, or
    cannot be told of this robot, is a ValueError.
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
        """Speed of the arm's set-points, rad/s, where the babbler's settings say it."""
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
        """The same, with further attributes: what a part tells the parts that it is made of."""
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
    """What configures a part, typed and validated. Derive a frozen dataclass; its docstring says what the part is."""

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
        """The name by which a description knows it."""
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
    """Settings as a table; tables in it likewise, but not the kinds of other parts, which validate themselves."""
    values = {entry.name: getattr(settings, entry.name) for entry in fields(settings)}
    return {key: table_of(value) if _is_table(value) else value for key, value in values.items()}


def _is_table(value: Any) -> bool:
    return is_dataclass(value) and not isinstance(value, Settings | type)


def kind_of(settings: type[Settings]) -> str:
    """The name of a class of settings: the registered one, or its place."""
    own = vars(settings).get("own_kind")
    place = f"{settings.__module__}:{settings.__qualname__}"
    return str(own) if own is not None else NAMES.get(place, place)
