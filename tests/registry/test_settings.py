"""Settings of kinds: those that are derived from a part's arguments, and those that are written beside it."""

from __future__ import annotations

import json
import sys
import tomllib
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import tomli_w
from pydantic import ValidationError

from somatopy.registry import (
    LEARNERS,
    MAPS,
    Kinds,
    Settings,
    UnknownKind,
)
from somatopy.validation import explain

Write = Callable[[str], str]
Stand = Callable[..., str]
CONTEXT: Any = SimpleNamespace(robot="the robot", rng="the generator")


def said(kinds: Kinds, value: Any) -> str:
    """Why a value is refused."""
    with pytest.raises(ValueError) as caught:
        kinds.validated(value)
    error = caught.value
    return explain(error, lambda keys: []) if isinstance(error, ValidationError) else str(error)


def built(settings: Settings) -> Any:
    return settings.build(CONTEXT)


def without_none(table: dict[str, Any]) -> dict[str, Any]:
    kept = {key: value for key, value in table.items() if value is not None}
    return {key: without_none(value) if isinstance(value, dict) else value for key, value in kept.items()}


def test_arguments_after_those_that_every_part_has_are_its_settings(mine: str) -> None:
    """Their names, types and defaults; the part is built from what the context has and from these."""
    settings = LEARNERS.validated(mine)
    assert LEARNERS.dumped(settings) == {"kind": mine, "rate": 0.5, "label": "left"}
    learner = built(LEARNERS.validated({"kind": mine, "rate": 2}))
    assert (learner.robot, learner.rng, learner.rate, learner.label) == ("the robot", "the generator", 2.0, "left")
    assert type(settings).__doc__ == "Looks at one place." and type(settings).__name__ == "Mine"
    assert settings.replaced(rate=3) == LEARNERS.validated({"kind": mine, "rate": 3})


@pytest.mark.parametrize(("key", "value"), [("rate", "fast"), ("rate", None), ("label", 3), ("rate", [1.0])])
def test_values_are_checked_by_their_types(mine: str, key: str, value: Any) -> None:
    """In a table and by `replaced`."""
    assert key in said(LEARNERS, {"kind": mine, key: value})
    with pytest.raises(ValueError, match=key):
        LEARNERS.validated(mine).replaced(**{key: value})


def test_a_function_that_makes_a_part_will_do(stand: Stand) -> None:
    """Its arguments are the settings, whatever it makes."""
    place = stand("def make(robot, rng, count: int = 3):\n    return [robot] * count\n", "make")
    assert LEARNERS.dumped(LEARNERS.validated(place)) == {"kind": place, "count": 3}
    assert built(LEARNERS.validated({"kind": place, "count": 2})) == ["the robot"] * 2


def test_what_an_own_part_inherits_it_can_be_told(stand: Stand, source: str) -> None:
    """Names, types and defaults of the constructor of its base: a changed learner is one method."""
    place = stand(
        source
        + """
class Changed(Mine):
    def gaze(self, percept): ...
""",
        "Changed",
    )
    assert LEARNERS.dumped(LEARNERS.validated(place)) == {"kind": place, "rate": 0.5, "label": "left"}
    assert "rate" in said(LEARNERS, {"kind": place, "rate": "fast"})


def test_a_dataclass_will_do(stand: Stand) -> None:
    """Its fields are the arguments of its constructor."""
    place = stand("""
from dataclasses import dataclass, field
from typing import Any
@dataclass
class Mine:
    robot: Any
    rng: Any
    rate: float = 0.5
    places: list[int] = field(default_factory=list)
""")
    assert built(LEARNERS.validated({"kind": place, "rate": 2, "places": [1]})).places == [1]
    assert "rate" in said(LEARNERS, {"kind": place, "rate": "fast"})


def test_marks_of_types_are_kept(stand: Stand) -> None:
    """Valid ranges and meanings stand in the part's own signature."""
    place = stand("""
from typing import Annotated, Literal
from annotated_types import Gt
from typing_extensions import Doc
class Mine:
    def __init__(self, robot, rng, *, rate: Annotated[float, Gt(0), Doc("Hz.")] = 1.0, way: Literal["a", "b"] = "a"):
        self.rate, self.way = rate, way
""")
    assert "greater than 0" in said(LEARNERS, {"kind": place, "rate": -1})
    assert "'a' or 'b'" in said(LEARNERS, {"kind": place, "way": "c"})
    assert built(LEARNERS.validated({"kind": place, "way": "b"})).way == "b"


def test_an_argument_without_a_default_must_be_given(stand: Stand) -> None:
    """A table that lacks it is refused at its key, wherever the argument stands."""
    for signature in ("robot, rng, rate: float", "*parts, rate: float", "robot, rng, *, rate: float"):
        place = stand(f"class Mine:\n    def __init__(self, {signature}):\n        self.rate = rate\n")
        assert "rate" in said(LEARNERS, place) and "missing" in said(LEARNERS, place)
        assert built(LEARNERS.validated({"kind": place, "rate": 3})).rate == 3.0


def test_an_argument_without_a_type_takes_what_it_is_given(stand: Stand) -> None:
    """Nobody can tell what is valid; the value passes as it is."""
    place = stand("class Mine:\n    def __init__(self, robot, rng, odd=None):\n        self.odd = odd\n")
    for value in (None, 3, "x", [1, {"a": 2}]):
        assert built(LEARNERS.validated({"kind": place, "odd": value})).odd == value


def test_types_that_cannot_be_found_are_no_types(stand: Stand) -> None:
    """Names that are imported for type checkers alone."""
    place = stand("""
from typing import TYPE_CHECKING
if TYPE_CHECKING:
    from nowhere import Robot
class Mine:
    def __init__(self, robot: Robot, rng, rate: float = 1.0):
        self.rate = rate
""")
    assert built(LEARNERS.validated({"kind": place, "rate": 2})).rate == 2


def test_further_arguments_are_no_settings(stand: Stand) -> None:
    """`*args` and `**kwargs` have no names of their own; a key for them is unknown."""
    place = stand("""
class Mine:
    def __init__(self, *given, rate: float = 1.0, **more):
        self.given, self.rate, self.more = given, rate, more
""")
    assert LEARNERS.dumped(LEARNERS.validated(place)) == {"kind": place, "rate": 1.0}
    assert vars(built(LEARNERS.validated(place))) == {"given": ("the robot", "the generator"), "rate": 1.0, "more": {}}
    assert said(LEARNERS, {"kind": place, "more": 1}) == "unknown key 'more'; valid keys there: kind, rate"


@pytest.mark.parametrize("default", ["[1, 2]", "{'a': 1}", "numpy.array([1.0, 2.0])"])
def test_a_default_that_can_change_is_everybodys_own(stand: Stand, default: str) -> None:
    """What a part does to it reaches neither the settings nor the next part that is built."""
    place = stand(f"""
import numpy
class Mine:
    def __init__(self, robot, rng, kept={default}):
        self.kept = kept
""")
    settings = LEARNERS.validated(place)
    assert settings.kept is not LEARNERS.validated(place).kept  # type: ignore[attr-defined]
    one, two = built(settings), built(settings)
    assert one.kept is not two.kept
    one.kept.clear() if hasattr(one.kept, "clear") else one.kept.fill(0)
    assert len(two.kept) > 0 and np.any(list(two.kept))
    assert len(built(LEARNERS.validated(place)).kept) == len(two.kept) and np.any(list(built(settings).kept))


def test_sequences_become_tuples(stand: Stand) -> None:
    """So that nobody changes them, and equal ones are equal; within unions too."""
    place = stand("""
from collections.abc import Collection, Iterable, Sequence
class Mine:
    def __init__(
        self, robot, rng, a: Sequence[int] = (1,), b: Iterable[str] | None = None, c: float | Sequence[float] = 1.0
    ):
        self.a, self.b, self.c = a, b, c
""")
    settings = LEARNERS.validated({"kind": place, "a": [1, 2], "b": ["x"], "c": [1, 2.5]})
    learner = built(settings)
    assert (learner.a, learner.b, learner.c) == ((1, 2), ("x",), (1.0, 2.5))
    assert settings == LEARNERS.validated({"kind": place, "a": (1, 2), "b": ("x",), "c": (1, 2.5)})
    assert LEARNERS.validated(LEARNERS.dumped(settings)) == settings and hash(settings)
    assert "a" in said(LEARNERS, {"kind": place, "a": ["x"]})


def test_arguments_that_no_file_can_hold_keep_their_defaults(stand: Stand) -> None:
    """A map, or a rule (a Protocol): a changed paper's learner runs as it is, with the settings that a file can say."""
    place = stand("""
from somatopy.learners import HebbianLearner
class Mine(HebbianLearner):
    def gaze(self, percept): ...
""")
    settings = LEARNERS.validated({"kind": place, "ties": "held", "plastic": ["links"]})
    table = LEARNERS.dumped(settings)
    assert LEARNERS.validated(tomllib.loads(tomli_w.dumps(without_none(table)))) == settings
    assert "'unit' or 'radian'" in said(LEARNERS, {"kind": place, "units": "degree"})
    assert "arm_map" in said(LEARNERS, {"kind": place, "arm_map": {"shape": [3, 3]}})


def test_what_users_of_a_map_give_is_no_setting_of_it() -> None:
    """Bounds, start codes, precision and random numbers are the learner's to say."""
    table = MAPS.dumped(MAPS.validated("som"))
    assert set(table) == {"kind", "shape", "learning_rate", "width", "horizon", "lattice", "periodic"}
    assert said(MAPS, {"kind": "som", "random_state": 1}).startswith("unknown key 'random_state'")


@pytest.mark.parametrize(
    ("source", "message"),
    [
        ("class Mine: ...", r"is made from \(robot, rng\), but too many positional arguments"),
        ("def Mine(robot): ...", r"is made from \(robot, rng\), but too many positional arguments"),
        ("def Mine(*, robot, rng): ...", r"is made from \(robot, rng\), but too many positional arguments"),
        ("Mine = 3", "is no learner: it is 3, which is neither a part nor makes one"),
        ("def Mine(robot, rng, kind=1): ...", "an argument may not be called kind"),
        ("def Mine(robot, rng, build=1): ...", "an argument may not be called build"),
    ],
)
def test_what_cannot_be_made_like_its_sort_is_refused(stand: Stand, source: str, message: str) -> None:
    """What every part of its sort is made from is named."""
    with pytest.raises(UnknownKind, match=message):
        LEARNERS.settings(stand(source))


# -- settings that are written -----------------------------------------------------------------------------------------

SETTINGS = """
from dataclasses import dataclass, field
from typing import Annotated
from annotated_types import Gt
from somatopy.registry import MAPS, Settings

@dataclass(frozen=True)
class Table:
    depth: Annotated[float, Gt(0)] = 1.0

@dataclass(frozen=True)
class Mine(Settings):
    '''A learner of one's own.'''
    rate: Annotated[float, Gt(0)] = 0.5
    chart: Annotated[Settings, MAPS] = field(default_factory=lambda: MAPS.validated("dsom"))
    inner: Table = Table()

    def build(self, context):
        return self.rate, self.chart.kind, self.inner.depth, context.robot
"""


def test_settings_of_ones_own_build_the_part(stand: Stand) -> None:
    """By their place; tables and kinds within them are validated too, and what is dumped is read as the same."""
    place = stand(SETTINGS)
    settings = LEARNERS.validated({"kind": place, "rate": 2, "chart": "som", "inner": {"depth": 3}})
    assert built(settings) == (2.0, "som", 3.0, "the robot") and settings.kind == place
    assert LEARNERS.validated(json.loads(json.dumps(LEARNERS.dumped(settings)))) == settings


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"rate": 0}, "greater than 0"),
        ({"chart": "smo"}, "kind = 'smo' is unknown"),
        ({"inner": {"depth": -1}}, "greater than 0"),
        ({"inner": {"width": 1}}, "width"),
        ({"speed": 1}, "unknown key 'speed'; valid keys there: rate, chart, inner"),
    ],
)
def test_replaced_validates_all(stand: Stand, changes: dict[str, Any], message: str) -> None:
    """Values, kinds, tables within, and names; the original stays."""
    settings = LEARNERS.validated(stand(SETTINGS))
    with pytest.raises(ValueError, match=message):
        settings.replaced(**changes)
    assert settings == LEARNERS.validated(settings.kind)


def test_settings_that_nobody_validated_are_validated_where_they_are_used(write: Write) -> None:
    """A value, and a value of a table within."""
    module = write(SETTINGS)
    mine = LEARNERS.settings(f"{module}:Mine")
    table = sys.modules[module].Table
    for wrong in (mine(rate=-1), mine(inner=table(depth=-1)), mine(chart="smo")):  # type: ignore[call-arg]
        with pytest.raises(ValidationError):
            LEARNERS.validated(wrong)
        with pytest.raises(ValueError):
            wrong.replaced()


def test_settings_without_their_decorator_are_refused(write: Write) -> None:
    """Their annotated names would be set by nobody, and in silence."""
    module = write("from somatopy.registry import Settings\nclass Mine(Settings):\n    rate: float = 1.0\n")
    expected = r"has settings that nobody can set \(rate\): put @dataclass\(frozen=True\) over Mine"
    with pytest.raises(UnknownKind, match=expected):
        LEARNERS.settings(f"{module}:Mine")


def test_settings_that_build_nothing_say_so(write: Write) -> None:
    """The class is named."""
    module = write("from somatopy.registry import Settings\nclass Mine(Settings): ...\n")
    with pytest.raises(NotImplementedError, match=r"Mine has no build\(context\)"):
        built(LEARNERS.validated(f"{module}:Mine"))
