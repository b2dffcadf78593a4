"""What the shipped checks share: reporting a broken law, and the laws about seeds, `state` and `restore`."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from copy import deepcopy
from dataclasses import is_dataclass
from typing import Any, Protocol, TypeVar

import numpy as np

__all__ = [
    "ContractError",
    "Stateful",
    "check_members",
    "check_state",
    "facts",
    "law",
    "missing_members",
    "refused",
    "same",
    "size",
    "stored",
]


class ContractError(AssertionError):
    """An implementation breaks a law of its contract. The message names the law, what was seen, and the fix."""


class Stateful(Protocol):
    """An object whose state can be saved, and which can continue from a saved state."""

    def state(self) -> dict[str, Any]:
        """All that a bit-exact continuation needs."""
        ...

    def restore(self, state: dict[str, Any]) -> object:
        """Continue from `state`."""
        ...


S = TypeVar("S", bound=Stateful)


@contextmanager
def law(what: str, fix: str) -> Iterator[Callable[..., None]]:
    """Context manager for testing one law. Any exception inside the `with` block counts as breaking the law.

    Args:
        what: the law, a sentence without its full stop.
        fix: what to do if the law is broken, also a sentence without its full stop.

    Yields:
        The function `holds(condition, seen, *values)`, which checks a condition of the law. `seen` says what was
        observed; it is a format string for the values.

    Raises:
        ContractError: a condition does not hold, or the block raised an exception.

    Example:
        >>> with law("a hand has five fingers", fix="count again") as holds:
        ...     holds(4 == 5, "{} fingers", 4)
        Traceback (most recent call last):
        ...
        somatopy.contract.laws.ContractError: The law: a hand has five fingers. Seen: 4 fingers. The fix: count again.
    """

    def holds(condition: object, seen: str, *values: object) -> None:
        if not condition:
            raise _broken(what, seen.format(*values), fix)

    try:
        yield holds
    except ContractError:
        raise
    except Exception as error:
        raise _broken(what, f"{type(error).__name__}: {error}", fix) from error


def _broken(what: str, seen: str, fix: str) -> ContractError:
    return ContractError(f"The law: {what}. Seen: {seen.rstrip('.')}. The fix: {fix}.")


def missing_members(thing: object, contract: type) -> list[str]:
    """Names of the public members of a contract (a Protocol class) that an object lacks."""
    members = {name for base in contract.__mro__ for name in {*vars(base), *vars(base).get("__annotations__", {})}}
    return sorted(name for name in members if not name.startswith("_") and not hasattr(thing, name))


def check_members(thing: object, contract: type) -> None:
    """Check that an object has all public members of a contract, which is a Protocol class."""
    lacks = missing_members(thing, contract)
    where = f"{contract.__module__}.{contract.__name__}"
    with law(f"it has all members of {contract.__name__}", f"see {where} for what they do") as holds:
        holds(not lacks, "{} lacks {}", type(thing).__name__, ", ".join(lacks))


def refused(call: Callable[[], object]) -> bool:
    """Whether a call raises a ValueError. Other exceptions are not caught."""
    try:
        call()
    except ValueError:
        return True
    return False


def same(a: Any, b: Any) -> bool:
    """Whether two nested values agree bit for bit. NaN counts as equal to NaN."""
    if isinstance(a, np.ndarray) and isinstance(b, np.ndarray):
        return a.dtype == b.dtype and a.shape == b.shape and a.tobytes() == b.tobytes()
    if isinstance(a, dict) and isinstance(b, dict):
        return a.keys() == b.keys() and all(same(a[key], b[key]) for key in a)
    if isinstance(a, (list, tuple)) and isinstance(b, (list, tuple)):
        return len(a) == len(b) and all(map(same, a, b))
    if isinstance(a, np.ndarray) or isinstance(b, np.ndarray):
        return False
    return bool(a == b or (a != a and b != b))


def facts(record: Any) -> dict[str, Any]:
    """Copies of the fields of a dataclass, without functions. Dataclasses and mappings in it become dictionaries."""
    fields = record if isinstance(record, Mapping) else vars(record)
    return {
        name: facts(value) if is_dataclass(value) or isinstance(value, Mapping) else deepcopy(value)
        for name, value in fields.items()
        if not callable(value)
    }


def size(value: Any) -> int:
    """Size of a nested state in bytes: that of its arrays and text, and 8 bytes for each other value."""
    if isinstance(value, dict):
        return sum(size(item) for item in value.values())
    if isinstance(value, (list, tuple)):
        return sum(map(size, value))
    return int(value.nbytes) if isinstance(value, np.ndarray) else len(value) if isinstance(value, str) else 8


def stored(state: Any, path: str = "state()") -> Any:
    """A copy of a state, as a checkpoint would give it back.

    A state may hold arrays, numbers, text, lists of numbers or text, and dictionaries of these.

    Raises:
        TypeError: the state holds something else; the message says where.
    """
    if isinstance(state, dict):
        for key in state:
            if not isinstance(key, str) or "/" in key:
                raise TypeError(f"{path} has the key {key!r}; keys are text without slashes")
        return {key: stored(item, f"{path}[{key!r}]") for key, item in state.items()}
    if isinstance(state, np.ndarray) and not state.dtype.hasobject:
        return state.copy()
    try:
        return json.loads(json.dumps(state.item() if isinstance(state, np.generic) else state))
    except TypeError as error:
        raise TypeError(f"{path} is a {type(state).__name__}: {error}") from error


def check_seed(make: Callable[[int], S], play: Callable[[S, int, int], object]) -> None:
    """Check that one seed gives one behaviour, and that a checkpoint can hold the state. See `check_state`."""
    original, twin = make(1), make(1)
    with law("one seed, one behaviour", "draw all random numbers from the generator that is given") as holds:
        holds(same(play(original, 0, 37), play(twin, 0, 37)), "two of one seed behave differently")
    with law("state() is plain data", "return a dictionary of arrays, numbers, text and more such dictionaries"):
        stored(original.state())


def check_state(make: Callable[[int], S], play: Callable[[S, int, int], object]) -> None:
    """Check that one seed gives one behaviour, and that an object continues bit for bit from a saved state.

    Args:
        make: makes a fresh object from a seed.
        play: called with the object, the first frame and the last one (excluded). It lets these frames pass, and
            returns everything that can be observed of the object meanwhile.

    Raises:
        ContractError: it does not. The message names the broken law.
    """
    check_seed(make, play)
    original, fresh = make(1), make(2)
    play(original, 0, 37)
    live, state = original.state(), stored(original.state())
    kept = deepcopy(live)
    future, end = play(original, 37, 80), stored(original.state())
    with law("a state stays as it was taken", "return copies of the arrays, not the ones you work on") as holds:
        holds(same(live, kept), "what happened after state() changed it")
    for name, subject in (("a fresh one of another seed", fresh), ("the object itself", original)):
        given = deepcopy(state)
        with law("restore(state) continues bit for bit", "put all that changes into state(), generators too") as holds:
            subject.restore(given)
            holds(same(play(subject, 37, 80), future), "{}, restored, went on differently", name)
            holds(same(stored(subject.state()), end), "{}, restored, ended in another state", name)
        with law("restore() leaves the state that it is given alone", "copy the arrays in restore()") as holds:
            holds(same(given, state), "what happened after restore() changed it")
