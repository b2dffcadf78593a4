"""A check that any link rule keeps its contract."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from somatopy.contract import check_members, check_state, law, refused, same
from somatopy.links.rules import Rule

__all__ = ["check_rule"]

Make = Callable[[], Rule]


def check_rule(make: Make) -> None:
    """Check that a rule keeps its contract, on rows of several lengths.

    Args:
        make: makes a fresh rule; a class that needs no arguments will do. A rule that says it is `local` may change
            only the link that an update names. Normalising rules, for instance, are not local.

    Raises:
        ContractError: it breaks a law; the message says which, what was seen and how to fix it.

    Example:
        >>> from somatopy.links import PositiveHebb
        >>> check_rule(PositiveHebb)
    """
    check_members(make(), Rule)
    with law("it says whether it is local", "set local = True or local = False in its class") as holds:
        holds(isinstance(make().local, bool), "local is {!r}", make().local)
    for size in (1, 7, 300):
        _stays_finite(make, size)
        _changes_what_it_may(make, size)
        _refuses_what_is_not_finite(make, size)
        _keeps_no_row(make, size)
        check_state(lambda seed: make(), partial(_play, size))


def _calls(size: int) -> list[dict[str, Any]]:
    """Hits and misses, with activations as two pairs of winners have them; every link is named in turn."""
    rng = np.random.default_rng(0)
    targets = [0.0, 1.0, 0.4]
    return [{"j": k % size, "activation": rng.uniform(0.25, 1.0), "target": rng.choice(targets)} for k in range(100)]


def _play(size: int, rule: Rule, first: int, last: int) -> object:
    """The row after each of some updates, from one that has learned nothing."""
    row, rows = np.zeros(size), []
    for call in _calls(size)[first:last]:
        rule.update(row, **call)
        rows.append(row.copy())
    return rows


def _stays_finite(make: Make, size: int) -> None:
    with law("links stay finite, from a row of zeros on", "divide by nothing that can be 0") as holds:
        for target in (0.0, 0.5, 1.0):
            rule, row = make(), np.zeros(size)
            for k in range(1000):
                rule.update(row, k % size, 1.0, target)
            holds(np.isfinite(row).all(), "after 1000 updates with the target {}: {}", target, row)


def _changes_what_it_may(make: Make, size: int) -> None:
    table, rule = np.full((3, size), 0.5), make()
    what, fix = "an update changes nothing but its row", "write into the row only, not into what it is a view of"
    if rule.local:
        what = "an update of a local rule changes nothing but link j of its row"
        fix = "write row[j] only, or say local = False in the class"
    with law(what, fix) as holds:
        for call in _calls(size):
            before, elsewhere = table.copy(), np.ones(table.shape, bool)
            rule.update(table[1], **call)
            elsewhere[1, call["j"] if rule.local else slice(None)] = False
            holds(same(table[elsewhere], before[elsewhere]), "another link changed in update({})", call)


def _refuses_what_is_not_finite(make: Make, size: int) -> None:
    with law(
        "a value that is not finite, or a j outside the row, is refused before anything changes",
        "raise a ValueError that names the value, first of all",
    ) as holds:
        for wrong in ({"activation": np.nan}, {"target": np.nan}, {"target": np.inf}, {"j": size}):
            rule, row = make(), np.full(size, 0.5)
            before, call = rule.state(), {"j": 0, "activation": 0.5, "target": 1.0} | wrong
            holds(refused(partial(rule.update, row, **call)), "update took {}", wrong)
            holds((row == 0.5).all() and same(rule.state(), before), "{} was refused too late", wrong)


def _keeps_no_row(make: Make, size: int) -> None:
    with law("a rule keeps no row from one update to the next", "keep copies of what must be remembered") as holds:
        tampered, left, row = make(), make(), np.zeros(size)
        for call in _calls(size):
            own = row.copy()
            tampered.update(row, **call)
            left.update(own, **call)
            holds(same(row, own), "{}, but {} if rows of earlier updates are not overwritten", row, own)
            spoilt, row = row, row.copy()
            spoilt[:] = np.nan
