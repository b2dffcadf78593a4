"""Experiments that come with somatopy."""

from __future__ import annotations

from somatopy.experiment.description import Description, NoDamage, OffsetDamage, Phase

__all__ = ["PRESETS", "paper"]


def paper() -> Description:
    """The experiment of Schillaci, Hafner and Lara 2014, in full.

    197.58 minutes intact, then 106.72 minutes with the arm vector shifted. The paper gives neither elasticities nor
    babbling range and speed: these are starting points, not calibrated.
    """
    return Description(
        name="paper",
        phases=(
            Phase(name="intact", frames=177_823, damage=NoDamage()),
            Phase(name="damaged", frames=96_049, damage=OffsetDamage(), trend_breaks=(7,)),
        ),
    )


#: Presets by name.
PRESETS = {"paper": paper}
