"""The laws of rules: ours keep them, and a rule that breaks one is told which."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import pytest

from somatopy.contract import ContractError
from somatopy.links import DeltaRule, NormalisedHebb, PositiveHebb, Rule, check_rule


def test_ours_keep_them() -> None:
    """The paper's rule, and the one that divides the row by its sum."""
    check_rule(PositiveHebb)
    check_rule(NormalisedHebb)
    check_rule(DeltaRule)


class Momentum:
    """A sound rule with memory: a link moves on by a part of the rule's last change."""

    local = True

    def __init__(self) -> None:
        self.last = 0.0

    def update(self, row: Any, j: int, activation: float, target: float) -> None:
        if not (0 <= j < len(row) and np.isfinite(activation * target)):
            raise ValueError("j, activation or target")
        self.change(row, j, activation * target)

    def change(self, row: Any, j: int, amount: float) -> None:
        self.last = 0.01 * amount + 0.5 * self.last
        row[j] += self.last

    def state(self) -> dict[str, Any]:
        return {"last": np.array(self.last)}

    def restore(self, state: Mapping[str, Any]) -> None:
        self.last = float(state["last"])


class Normalised(Momentum):
    """A sound rule that spreads over the row."""

    local = False

    def change(self, row: Any, j: int, amount: float) -> None:
        super().change(row, j, amount)
        row /= 1.0 + row.sum()


class Boasting(Normalised):
    """Says to be local, and is not."""

    local = True


class Silent(Momentum):
    """Does not say whether it is local."""

    local: Any = None


class Spreading(Momentum):
    local = False

    def change(self, row: Any, j: int, amount: float) -> None:
        super().change(row, j, amount)
        if row.base is not None:
            row.base[0] += amount


class Dividing(Momentum):
    local = False

    def change(self, row: Any, j: int, amount: float) -> None:
        row[j] = amount / row.sum()


class Trusting(Momentum):
    def update(self, row: Any, j: int, activation: float, target: float) -> None:
        if j < len(row):
            self.change(row, j, activation * target)


class Late(Momentum):
    def update(self, row: Any, j: int, activation: float, target: float) -> None:
        row[0] += 1.0
        super().update(row, j, activation, target)
        row[0] -= 1.0


class Clinging(Momentum):
    before: Any = None

    def change(self, row: Any, j: int, amount: float) -> None:
        if self.before is not None:
            amount = amount + 0.1 * self.before[j]
        self.before = row
        super().change(row, j, amount)


class Random(Momentum):
    def change(self, row: Any, j: int, amount: float) -> None:
        row[j] += amount * np.random.default_rng().random()


class Forgetful(Momentum):
    def restore(self, state: Mapping[str, Any]) -> None:
        self.last = 0.0


class Memoryless:
    def update(self, row: Any, j: int, activation: float, target: float) -> None: ...


def test_other_sound_rules_pass() -> None:
    """With memory of its own; with the whole row, if the rule says that it is not local."""
    check_rule(Momentum)
    check_rule(Normalised)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (Memoryless, "all members of Rule.*Memoryless lacks local, restore, state"),
        (Boasting, "a local rule changes nothing but link j of its row.*or say local = False in the class"),
        (Silent, "says whether it is local.*local is None.*set local = True or local = False in its class"),
        (Spreading, "nothing but its row"),
        (Dividing, "links stay finite, from a row of zeros on"),
        (Trusting, "is refused before anything changes.*update took"),
        (Late, "is refused before anything changes.*refused too late"),
        (Clinging, "keeps no row from one update to the next"),
        (Random, "keeps no row|one seed, one behaviour"),
        (Forgetful, r"restore\(state\) continues bit for bit"),
    ],
)
def test_each_law_is_held(make: Callable[[], Rule], message: str) -> None:
    """One rule that breaks each."""
    with pytest.raises(ContractError, match=message), np.errstate(all="ignore"):
        check_rule(make)
