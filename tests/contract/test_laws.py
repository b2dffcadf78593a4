"""What the shipped checks share: how a broken law is told, what counts as the same, and the laws of states."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from types import MappingProxyType, SimpleNamespace
from typing import Any, Protocol

import numpy as np
import pytest

from somatopy.contract import (
    ContractError,
    check_members,
    check_seed,
    check_state,
    facts,
    law,
    missing_members,
    refused,
    same,
    size,
    stored,
)
from somatopy.percept import Percept


def test_a_broken_law_is_told_with_what_was_seen_and_the_fix() -> None:
    """The whole message; values are put in only then."""
    with (
        pytest.raises(ContractError, match=r"^The law: all is well\. Seen: 1 and \{x\}\. The fix: try again\.$"),
        law("all is well", "try again") as holds,
    ):
        holds(True, "{nothing}")
        holds(False, "{} and {}", 1, "{x}")


def test_what_an_implementation_raises_breaks_the_law() -> None:
    """The error is named, and kept as the cause."""
    with pytest.raises(ContractError, match=r"Seen: KeyError: 'pixel'\. The fix: f") as caught, law("w", "f"):
        raise KeyError("pixel")
    assert isinstance(caught.value.__cause__, KeyError)
    assert isinstance(caught.value, AssertionError)


def test_a_law_does_not_stop_the_user() -> None:
    """Ctrl-C is no broken law."""
    with pytest.raises(KeyboardInterrupt), law("w", "f"):
        raise KeyboardInterrupt


class Named(Protocol):
    name: str

    def call(self) -> None: ...


class Private(Protocol):
    _name: str

    def _call(self) -> None: ...


def test_missing_members_are_listed() -> None:
    """Attributes and methods alike; private names do not count."""
    with pytest.raises(ContractError, match=r"all members of Named\. Seen: object lacks call, name\. .*\.Named for"):
        check_members(object(), Named)
    assert missing_members(object(), Named) == ["call", "name"]


def test_nothing_is_missing_from_what_has_all() -> None:
    """Whatever else it has; of what it lacks one, that one is named, and private names are nobody's business."""
    whole = SimpleNamespace(name="x", call=len, more=1)
    assert missing_members(whole, Named) == []
    check_members(whole, Named)
    assert missing_members(SimpleNamespace(call=None), Named) == ["name"]
    assert missing_members(object(), Private) == []


def test_only_value_errors_refuse() -> None:
    """A kind of ValueError refuses; returning does not; another error passes."""
    assert refused(lambda: int("x")) and not refused(lambda: int("1"))
    with pytest.raises(KeyError):
        refused(lambda: {}["x"])


@pytest.mark.parametrize(
    ("a", "b", "expected"),
    [
        (np.array([1.0, np.nan]), np.array([1.0, np.nan]), True),
        (np.array([1.0]), np.array([1.0 + 2e-16]), False),
        (np.array([1.0]), np.array([1]), False),
        (np.zeros((2, 1)), np.zeros((1, 2)), False),
        (np.zeros(1), 0.0, False),
        ({"a": [1, {"b": float("nan")}]}, {"a": (1, {"b": float("nan")})}, True),
        ({"a": 1}, {"b": 1}, False),
        ([1, 2], [1], False),
        (None, None, True),
        ("x", 1, False),
    ],
)
def test_same_is_to_the_last_bit(a: Any, b: Any, expected: bool) -> None:
    """Types, shapes and bytes of arrays, keys and lengths; NaN is like NaN."""
    assert same(a, b) is expected


def test_facts_are_copies_without_functions() -> None:
    """Dataclasses inside become dictionaries; what is changed later does not reach the facts."""

    @dataclass
    class Inner:
        array: Any

    @dataclass
    class Outer:
        inner: Inner
        call: Callable[[], int]
        number: int = 3

    record = Outer(Inner(np.zeros(2)), lambda: 1)
    found = facts(record)
    record.inner.array[:] = 1
    assert same(found, {"inner": {"array": np.zeros(2)}, "number": 3})


def test_facts_hold_what_mappings_hold() -> None:
    """Also of those that can be neither changed nor copied, such as the further senses of a percept."""
    torso, zero = np.array([0.5]), np.zeros(2)
    for more in ({}, {"torso": torso}, MappingProxyType({"torso": torso})):
        percept = Percept(0.0, zero, zero, zero, zero, more=more)
        found = facts(percept)["more"]
        assert type(found) is dict and same(found, {"torso": np.array([0.5])} if more else {})
    assert facts(Percept(0.0, zero, zero, zero, zero))["more"] == {}
    torso[:] = 9
    assert found["torso"].tolist() == [0.5]


def test_size_counts_arrays_text_and_single_values() -> None:
    """8 bytes a single value, however large a number: a counter does not grow."""
    assert size({"a": np.zeros(3), "b": ["xy", 1, 10**40, None]}) == 24 + 2 + 3 * 8


def test_stored_is_what_a_checkpoint_gives_back() -> None:
    """Scalars of NumPy and tuples become plain; NaN and infinities, generators' large numbers and arrays stay."""
    rng = np.random.default_rng(0).bit_generator.state
    state = {"a": np.float64(1.5), "b": (1, 2), "c": -np.inf, "d": np.array(["x"]), "rng": rng}
    assert same(stored(state), {"a": 1.5, "b": [1, 2], "c": -np.inf, "d": np.array(["x"]), "rng": rng})


@pytest.mark.parametrize(
    ("state", "message"),
    [
        ({"a": {"b": object()}}, r"state\(\)\['a'\]\['b'\] is a object"),
        ({"a": np.array([None])}, r"state\(\)\['a'\] is a ndarray"),
        ({"a": [np.zeros(1)]}, r"state\(\)\['a'\] is a list"),
        ({1: 2}, r"state\(\) has the key 1; keys are text without slashes"),
        ({"a/b": 2}, r"has the key 'a/b'"),
    ],
)
def test_what_no_checkpoint_can_hold_is_named(state: Any, message: str) -> None:
    """Objects, arrays of objects or in lists, and keys that are no plain text: the message says where."""
    with pytest.raises(TypeError, match=message):
        stored(state)


class Walk:
    """A sound random walk."""

    def __init__(self, seed: int) -> None:
        self.rng, self.place, self.steps = np.random.default_rng(seed), np.zeros(2), 0

    def step(self) -> Any:
        self.place += self.rng.normal(size=2)
        self.steps += 1
        return self.place.copy()

    def state(self) -> dict[str, Any]:
        return {"rng": self.rng.bit_generator.state, "place": self.place.copy(), "steps": self.steps}

    def restore(self, state: dict[str, Any]) -> None:
        self.rng.bit_generator.state = state["rng"]
        self.place, self.steps = state["place"].copy(), state["steps"]


class Unseeded(Walk):
    def __init__(self, seed: int) -> None:
        super().__init__(np.random.default_rng().integers(10**9))


class Opaque(Walk):
    def state(self) -> dict[str, Any]:
        return super().state() | {"rng": self.rng}


class Lent(Walk):
    def state(self) -> dict[str, Any]:
        return super().state() | {"place": self.place}


class Adopting(Walk):
    def restore(self, state: dict[str, Any]) -> None:
        super().restore(state)
        self.place = state["place"]


class Undrawn(Walk):
    def restore(self, state: dict[str, Any]) -> None:
        super().restore(state | {"rng": self.rng.bit_generator.state})


class Miscounted(Walk):
    def restore(self, state: dict[str, Any]) -> None:
        super().restore(state | {"steps": 0})


def play(walk: Walk, first: int, last: int) -> list[Any]:
    return [walk.step() for _ in range(first, last)]


def test_a_sound_state_passes() -> None:
    """Generator, arrays and counters, all copied."""
    check_state(Walk, play)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (Unseeded, "one seed, one behaviour"),
        (Opaque, r"state\(\) is plain data.*state\(\)\['rng'\] is a Generator"),
        (Lent, "a state stays as it was taken"),
        (Adopting, r"restore\(\) leaves the state that it is given alone"),
        (Undrawn, "continues bit for bit.*a fresh one of another seed, restored, went on differently"),
        (Miscounted, "continues bit for bit.*ended in another state"),
    ],
)
def test_each_law_of_states_is_held(make: Callable[[int], Walk], message: str) -> None:
    """One walk that breaks each."""
    with pytest.raises(ContractError, match=message):
        check_state(make, play)


def test_the_laws_of_seeds_are_held_alone() -> None:
    """One behaviour a seed, and a state that a checkpoint can hold; whether it continues is not asked."""
    check_seed(Undrawn, play)
    with pytest.raises(ContractError, match="one seed, one behaviour"):
        check_seed(Unseeded, play)
    with pytest.raises(ContractError, match=r"state\(\) is plain data"):
        check_seed(Opaque, play)
