"""Experiments that come with somatopy."""

from __future__ import annotations

from somatopy.experiment.description import Babbling, Description, NoDamage, OffsetDamage, Phase

__all__ = ["PRESETS", "paper"]


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


#: Presets by name.
PRESETS = {"paper": paper}
