"""Experiments that come with somatopy: the paper's, and its controls."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from somatopy.experiment.description import (
    Babbling,
    Description,
    FixedControl,
    Hebbian,
    NearestControl,
    NoDamage,
    OffsetDamage,
    Phase,
    RandomControl,
)

__all__ = ["CONTROLS", "PRESETS", "paper"]


def paper() -> Description:
    """The experiment of Schillaci, Hafner and Lara 2014, in full.

    197.58 minutes intact, then 106.72 minutes with the arm vector shifted. The paper gives neither elasticities nor
    babbling range and speed. These are starting points, not calibrated: a rough trial with a hand that nothing hides
    came nearest to the paper's levels with them.
    """
    return Description(
        name="paper",
        babbling=Babbling(range=((-1.2, 1.6), (-0.3141, 1.3264), (-1.3, 1.3), (-1.5446, -0.0350)), speed=0.8),
        phases=(
            Phase(name="intact", frames=177_823, damage=NoDamage()),
            Phase(name="damaged", frames=96_049, damage=OffsetDamage(), trend_breaks=(7,)),
        ),
    )


def random(described: Description) -> Description:
    """Uniform random head postures: what ignorance scores."""
    return _instead(described, RandomControl())


def fixed(described: Description) -> Description:
    """The single head posture that sees the hand most often while babbling."""
    return _instead(described, FixedControl())


def nearest(described: Description) -> Description:
    """The nearest remembered hit: experience without a map."""
    return _instead(described, NearestControl())


def frozen(described: Description) -> Description:
    """Maps that never learn; links do."""
    return described.replaced(phases=[_with(phase, plastic=("links",)) for phase in described.phases])


def sampled(described: Description) -> Description:
    """An arm map drawn from 30 minutes of other babbling, and frozen; links learn."""
    learner = described.learner if isinstance(described.learner, Hebbian) else Hebbian()
    return frozen(described.replaced(learner=learner.model_copy(update={"arm_codes": "sampled"})))


def shuffled(described: Description) -> Description:
    """After the first phase the rows of the links change places, and nothing learns for three windows."""
    after = Phase(name="shuffled", frames=3 * 4500, plastic=(), start="shuffled")
    return described.replaced(phases=[described.phases[0], after])


def scratch(described: Description) -> Description:
    """A learner that begins anew with each phase after the first."""
    return described.replaced(phases=[described.phases[0], *(_with(p, start="afresh") for p in described.phases[1:])])


def stopped(described: Description) -> Description:
    """Nothing learns after the first phase."""
    return _plastic_after(described, ())


def links_only(described: Description) -> Description:
    """Only links learn after the first phase."""
    return _plastic_after(described, ("links",))


def maps_only(described: Description) -> Description:
    """Only maps learn after the first phase."""
    return _plastic_after(described, ("arm_map", "head_map"))


def _instead(described: Description, learner: RandomControl | FixedControl | NearestControl) -> Description:
    """Another learner, to which what phases said of the old one's parts does not apply."""
    return described.replaced(
        learner=learner, phases=[_with(phase, plastic=None, start="continue") for phase in described.phases]
    )


def _plastic_after(described: Description, parts: tuple[str, ...]) -> Description:
    return described.replaced(phases=[described.phases[0], *(_with(p, plastic=parts) for p in described.phases[1:])])


def _with(phase: Phase, **changes: object) -> Phase:
    return phase.model_copy(update=changes)


#: What each control makes of an experiment, by name.
CONTROLS: dict[str, Callable[[Description], Description]] = {
    "random": random,
    "fixed": fixed,
    "frozen": frozen,
    "sampled": sampled,
    "nearest": nearest,
    "shuffled": shuffled,
    "scratch": scratch,
    "stopped": stopped,
    "links-only": links_only,
    "maps-only": maps_only,
}


def _preset(control: Callable[[Description], Description], name: str) -> Description:
    return control(paper()).model_copy(update={"name": name})


#: Presets by name: the paper's experiment, and each control of it.
PRESETS: dict[str, Callable[[], Description]] = {
    "paper": paper,
    **{f"paper-{name}": partial(_preset, control, f"paper-{name}") for name, control in CONTROLS.items()},
}
