"""The laws of link rules, tried on any implementation."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from somatopy.contract import check_state, law, missing, refused, same
from somatopy.links.rules import Rule

__all__ = ["check_rule"]

Floats = NDArray[np.float64]
Call = dict[str, Any]

_SIZES = (1, 7, 300)


def check_rule(make: Callable[[], Rule], *, whole_row: bool = False) -> None:
    """Check that a rule keeps its contract, on rows of several lengths.

    Args:
        make: a fresh rule. A class that needs no arguments will do.
        whole_row: whether it may change links of the row beside the one that is named, as normalising rules do.

    Raises:
        ContractError: it breaks a law; the message says which, what was seen and how to fix it.

    Example:
        >>> from somatopy.links import PositiveHebb
        >>> check_rule(PositiveHebb)
    """
    with law("a rule has all members of Rule", "see somatopy.links.Rule") as holds:
        rule = make()
        holds(not missing(rule, Rule), "{} lacks {}", type(rule).__name__, missing(rule, Rule))
    for size in _SIZES:
        _stays_finite(make, size)
        _is_local(make, size, whole_row)
        _refuses_what_is_not_finite(make, size)
        _keeps_no_row(make, size)
        check_state(lambda seed: make(), lambda rule, first, last, n=size: _play(rule, n, first, last))


def _calls(size: int, count: int = 100) -> list[Call]:
    """Hits and misses, with activations as two pairs of winners have them; every link is named."""
    rng = np.random.default_rng(0)
    return [
        {"j": k % size, "activation": rng.uniform(0.25, 1.0), "target": rng.choice([0.0, 1.0, rng.random()])}
        for k in range(count)
    ]


def _play(rule: Rule, size: int, first: int, last: int) -> object:
    """The row after each of some updates, from one that has learned nothing."""
    row, rows = np.zeros(size), []
    for call in _calls(size)[first:last]:
        rule.update(row, **call)
        rows.append(row.copy())
    return rows


def _stays_finite(make: Callable[[], Rule], size: int) -> None:
    with law(
        "links stay finite whatever is hit or missed, from a row of zeros on", "divide by nothing that can be 0"
    ) as holds:
        for target in (0.0, 0.5, 1.0):
            rule, row = make(), np.zeros(size)
            for k in range(1000):
                rule.update(row, k % size, 1.0, target)
            holds(np.isfinite(row).all(), "after 1000 updates with the target {}: {}", target, row)


def _is_local(make: Callable[[], Rule], size: int, whole_row: bool) -> None:
    allowed = "its row" if whole_row else "link j of its row"
    fix = "write row[...] only" if whole_row else "write row[j] only, or say check_rule(..., whole_row=True)"
    table, rule = np.full((3, size), 0.5), make()
    with law(f"an update changes nothing but {allowed}", fix) as holds:
        for call in _calls(size):
            before, j = table.copy(), call["j"]
            rule.update(table[1], **call)
            elsewhere = np.ones(table.shape, bool)
            elsewhere[1, slice(None) if whole_row else j] = False
            holds(same(table[elsewhere], before[elsewhere]), "another link changed in update({})", call)


def _refuses_what_is_not_finite(make: Callable[[], Rule], size: int) -> None:
    with law(
        "a value that is not finite, or a j outside the row, is refused before anything changes",
        "raise a ValueError that names the value, first of all",
    ) as holds:
        good = {"j": 0, "activation": 0.5, "target": 1.0}
        for wrong in ({"activation": np.nan}, {"target": np.nan}, {"target": np.inf}, {"j": size}):
            rule, row = make(), np.full(size, 0.5)
            before = rule.state()
            holds(refused(lambda r=rule, a=row, w=wrong: r.update(a, **(good | w))), "update took {}", wrong)
            holds((row == 0.5).all() and same(rule.state(), before), "{} was refused too late", wrong)


def _keeps_no_row(make: Callable[[], Rule], size: int) -> None:
    with law(
        "an update depends on its arguments and the rule's own memory alone",
        "keep no row between updates, only copies, and draw no random numbers",
    ) as holds:
        tampered, left, row = make(), make(), np.zeros(size)
        for call in _calls(size):
            own = row.copy()
            tampered.update(row, **call)
            left.update(own, **call)
            holds(same(row, own), "two equal rules made {} and {} of one row", row, own)
            spoilt, row = row, row.copy()
            spoilt[:] = np.nan
