"""The probes, which are the columns that eye, learner and interventions add to the record of frames."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from somatopy.contract import Body, Eye, Intervention, Learner, Recorded
from somatopy.experiment.columns import check_names, vector_columns
from somatopy.experiment.description import DescriptionError, Phase
from somatopy.percept import Column

__all__ = ["Probes"]

#: What a column has in frames of which its part says nothing.
_SILENT: dict[str, float] = {"float": float("nan"), "int": -1, "bool": False}


class Probes:
    """The columns that the parts of an experiment declare, and their values in a frame.

    A kind of intervention counts once, if it is in several phases. Two of a kind in one phase would write the same
    columns: these count twice, and are refused.

    Args:
        phases: the phases of the description.
        body: the robot, whose vectors have columns, too.
        eye: what finds the marker.
        learner: what moves the head.
        interventions: those of each phase, in the order of the description.

    Attributes:
        columns: what eye, learner and interventions declare.

    Raises:
        DescriptionError: two columns have the same name.
    """

    def __init__(
        self,
        phases: Sequence[Phase],
        body: Body,
        eye: Eye,
        learner: Learner,
        interventions: Sequence[Sequence[Intervention]],
    ) -> None:
        owners: list[tuple[str, int, Any]] = [("the eye", 0, eye), ("the learner", 0, learner)]
        for phase, parts in zip(phases, interventions, strict=True):
            kinds = [settings.kind for settings in phase.interventions]
            for k, (kind, intervention) in enumerate(zip(kinds, parts, strict=True)):
                owners.append((f"the {kind} intervention", kinds[:k].count(kind), intervention))
        found = list(dict.fromkeys((name, nth, column) for name, nth, part in owners for column in _columns_of(part)))
        recording = [part for _, _, part in owners if part is not learner and _columns_of(part)]
        self._others_record = bool(recording)
        self._silent = {c.name: _SILENT[c.type] for part in recording for c in _columns_of(part)}
        try:
            vectors = [("a frame", column) for column, _, _ in vector_columns(body)]
            check_names([*vectors, *((name, column) for name, _, column in found)])
        except ValueError as error:
            raise DescriptionError(f"Frames cannot be recorded: {error}.") from error
        self.columns: tuple[Column, ...] = tuple(column for _, _, column in found)

    def of(self, learner: Learner, eye: Eye, interventions: Sequence[Intervention]) -> dict[str, float]:
        """What the parts say of this frame; interventions of other phases have nothing to say."""
        found = {**self._silent, **learner.probes()}
        for part in (eye, *interventions) if self._others_record else ():
            if isinstance(part, Recorded):
                found.update(part.probes())
        return found


def _columns_of(part: Any) -> Sequence[Column]:
    declared: Sequence[Column] = getattr(part, "columns", ())
    return declared
