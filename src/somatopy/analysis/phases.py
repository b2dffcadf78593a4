"""Phases of a run: what was done to it in each, which of them happened, and which stand beside the paper's."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

__all__ = ["NOT_DAMAGE", "beside_paper", "damage_text", "kind_name", "phase_names", "phase_title", "played"]

Phases = Sequence[Mapping[str, Any]]

#: Interventions that freeze, renew or shuffle what was learned, but damage nothing.
NOT_DAMAGE = frozenset({"plastic", "afresh", "shuffled"})


def damage_text(interventions: Sequence[Mapping[str, Any]]) -> str:
    """The damage of a phase in one text: the kinds of its interventions, those of `NOT_DAMAGE` left out.

    Example:
        >>> damage_text([{"kind": "offset"}, {"kind": "plastic"}, {"kind": "my_lab.harm:Tremor"}]), damage_text([])
        ('offset+my_lab.harm:Tremor', 'none')
    """
    return "+".join(str(found["kind"]) for found in interventions if found["kind"] not in NOT_DAMAGE) or "none"


def kind_name(kind: str) -> str:
    """What a reader is shown of a kind: its name, without the place of a class of one's own.

    Example:
        >>> kind_name("hebbian"), kind_name("my_lab.learners:Lookup"), kind_name("handed over:__main__.Lookup")
        ('hebbian', 'Lookup', 'Lookup')
    """
    return kind.rpartition(":")[2].rpartition(".")[2]


def phase_names(summary: Mapping[str, Any]) -> list[str]:
    """Short names of the phases of a summary: intact, damaged (offset)."""
    damages = [phase["damage"] for phase in summary["phases"]]
    shown = ["+".join(kind_name(kind) for kind in damage.split("+")) for damage in damages]
    return ["intact" if damage == "none" else f"damaged ({damage})" for damage in shown]


def played(phases: Phases) -> list[int]:
    """Which phases of a summary have frames. The others did nothing, and nothing is said of them.

    Example:
        >>> played([{"frames": 9}, {"frames": 0}, {"frames": 5}])
        [0, 2]
    """
    return [index for index, phase in enumerate(phases) if phase["frames"]]


def phase_title(summary: Mapping[str, Any], index: int) -> str:
    """Number and state of a phase, counted from 1, as in the description: phase 1, intact."""
    return f"phase {1 + index}, {phase_names(summary)[index]}"


def beside_paper(phases: Phases) -> tuple[int | None, int | None]:
    """Which phases of a summary stand beside the paper's two, the intact one and the damaged one that follows.

    Phases without frames did nothing, so that they come last. A run that is damaged from its start has no intact phase.

    Example:
        >>> intact, damaged = {"frames": 9, "damage": "none"}, {"frames": 9, "damage": "offset"}
        >>> beside_paper([intact, damaged]), beside_paper([intact | {"frames": 0}, intact, damaged])
        ((0, 1), (1, 2))
        >>> beside_paper([damaged]), beside_paper([intact, damaged | {"frames": 0}]), beside_paper([])
        ((None, 0), (0, 1), (None, None))
    """
    order = sorted(range(len(phases)), key=lambda index: not phases[index]["frames"])
    damaged = bool(order) and phases[order[0]]["damage"] != "none"
    found = [*([None] if damaged else []), *order, None, None]
    return found[0], found[1]
