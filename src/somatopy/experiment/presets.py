"""Experiments that come with somatopy: the paper's, and its controls."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from somatopy.clock import WINDOW
from somatopy.experiment.description import Description, Phase
from somatopy.learners.hebbian import Hebbian
from somatopy.registry import BABBLERS, INTERVENTIONS, LEARNERS, MAPS, RULES

__all__ = ["CONTROLS", "PRESETS", "best", "paper", "paper_2016", "paper_wide"]


def paper() -> Description:
    """The experiment of Schillaci, Hafner and Lara 2014, in full.

    The intact robot babbles for 197.58 minutes. Its sense of the arm is then shifted, and it babbles for 106.72 more.
    The paper leaves open the babbling range and speed, the speed of the head, and the learning rates and elasticities
    of the maps. These were calibrated and rounded to two digits. docs/calibration.md says how, and to what they were
    fitted.
    """
    chart = MAPS.validated({"kind": "dsom", "shape": (30, 30), "learning_rate": 0.093, "elasticity": 0.62})
    return paper_wide().replaced(
        name="paper",
        body={"kind": "mujoco", "head_speed": 0.77},
        babbling=BABBLERS.validated({"range": "confined", "speed": 0.36}),
        learner=Hebbian(arm_map=chart, head_map=chart),
    )


def paper_wide() -> Description:
    """The paper's experiment with a wide babbling range, fast joints, and loosely coupled map units.

    The preset `paper` had these settings before its calibration. In a rough trial in which nothing could hide the hand,
    they came nearest to the levels of the paper.
    """
    return Description(
        name="paper-wide",
        babbling=BABBLERS.validated({"range": "wide", "speed": 0.8}),
        phases=(
            Phase(name="intact", frames=177_823),
            Phase(name="damaged", frames=96_049, interventions=(INTERVENTIONS.validated("offset"),), trend_breaks=(7,)),
        ),
    )


def paper_2016() -> Description:
    """The paper's experiment with the maps and links of the library that its first author published in 2016.

    That library works on radians, and measures distances on the lattice in cells (preset `schillaci2016` of DSOM). Its
    activation is 1 / (1 + 2 tanh d). It divides each row of links by its sum. All hits count equally, wherever the hand
    is in the picture.
    """
    table = {"kind": "dsom", "shape": (30, 30), "learning_rate": 0.2, "elasticity": 1.5, "preset": "schillaci2016"}
    return paper().replaced(
        name="paper-2016",
        learner=Hebbian(
            arm_map=MAPS.validated(table),
            head_map=MAPS.validated(table),
            rule=RULES.validated("normalised"),
            activation_slope=2.0,
            units="radian",
            centring="none",
        ),
    )


def best() -> Description:
    """The learner `best` in the wide babbling range: an hour intact, then half an hour with the paper's damage."""
    intact, damaged = paper_wide().phases
    phases = [intact.replaced(frames=54_000), damaged.replaced(frames=27_000)]
    return paper_wide().replaced(name="best", learner=LEARNERS.validated("best"), phases=phases)


def random(described: Description) -> Description:
    """A control that moves the head at random. It shows what a robot reaches that knows nothing."""
    return _instead(described, "random")


def fixed(described: Description) -> Description:
    """A control that holds the head still, in the posture that sees the hand most often during babbling."""
    return _instead(described, "fixed")


def nearest(described: Description) -> Description:
    """A control without maps: it looks where it looked at the remembered hit with the nearest arm posture."""
    return _instead(described, "nearest")


def delta(described: Description) -> Description:
    """The paper's learner with the delta rule on its links, which also learns from misses."""
    learner = described.learner if isinstance(described.learner, Hebbian) else Hebbian()
    taught = learner.replaced(rule=RULES.validated("delta"), link_rate=0.3, centring="none")
    return described.replaced(learner=taught)


def frozen(described: Description) -> Description:
    """The paper's learner, in which the links learn and the maps never do."""
    return described.replaced(phases=[phase.replaced(plastic=("links",)) for phase in described.phases])


def sampled(described: Description) -> Description:
    """The paper's learner with an arm map of postures from 30 minutes of other babbling. Only the links learn."""
    learner = described.learner if isinstance(described.learner, Hebbian) else Hebbian()
    return frozen(described.replaced(learner=learner.replaced(arm_codes="sampled")))


def shuffled(described: Description) -> Description:
    """The paper's learner, whose links are shuffled after the first phase. For three windows then nothing learns."""
    after = Phase.model_validate({"name": "shuffled", "frames": 3 * WINDOW, "plastic": (), "start": "shuffled"})
    return described.replaced(phases=[described.phases[0], after])


def scratch(described: Description) -> Description:
    """The paper's learner, which starts anew with each phase after the first."""
    later = [phase.replaced(start="afresh") for phase in described.phases[1:]]
    return described.replaced(phases=[described.phases[0], *later])


def stopped(described: Description) -> Description:
    """The paper's learner, in which nothing learns after the first phase."""
    return _plastic_after(described, ())


def links_only(described: Description) -> Description:
    """The paper's learner, in which only the links learn after the first phase."""
    return _plastic_after(described, ("links",))


def maps_only(described: Description) -> Description:
    """The paper's learner, in which only the maps learn after the first phase."""
    return _plastic_after(described, ("arm_map", "head_map"))


def _instead(described: Description, kind: str) -> Description:
    """Another learner, to which what phases said of the old one's parts does not apply."""
    phases = [phase.replaced(plastic=None, start="continue") for phase in described.phases]
    return described.replaced(learner=LEARNERS.validated(kind), phases=phases)


def _plastic_after(described: Description, parts: tuple[str, ...]) -> Description:
    later = [phase.replaced(plastic=parts) for phase in described.phases[1:]]
    return described.replaced(phases=[described.phases[0], *later])


#: What each control makes of an experiment, by name.
CONTROLS: dict[str, Callable[[Description], Description]] = {
    "random": random,
    "fixed": fixed,
    "frozen": frozen,
    "sampled": sampled,
    "nearest": nearest,
    "delta": delta,
    "shuffled": shuffled,
    "scratch": scratch,
    "stopped": stopped,
    "links-only": links_only,
    "maps-only": maps_only,
}


def _preset(control: Callable[[Description], Description], name: str) -> Description:
    return control(paper()).replaced(name=name)


#: Presets by name: the paper's experiment, its variants, the best learner, and each control of the paper's.
PRESETS: dict[str, Callable[[], Description]] = {
    "paper": paper,
    "paper-wide": paper_wide,
    "paper-2016": paper_2016,
    "best": best,
    **{f"paper-{name}": partial(_preset, control, f"paper-{name}") for name, control in CONTROLS.items()},
}
