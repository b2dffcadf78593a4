"""Interventions: what is done to an experiment for the length of a phase, such as damage, freezing or shuffling."""

from somatopy.contract import Intervention, Stage
from somatopy.interventions.base import NoIntervention
from somatopy.interventions.check import check_intervention
from somatopy.interventions.learning import Afresh, PlasticParts, Shuffled
from somatopy.interventions.offset import PAPER_OFFSET, JointOffset
from somatopy.registry import INTERVENTIONS

INTERVENTIONS.add("offset", "somatopy.interventions.offset:Offset")
INTERVENTIONS.add("plastic", "somatopy.interventions.learning:PlasticParts")
INTERVENTIONS.add("afresh", "somatopy.interventions.learning:Afresh")
INTERVENTIONS.add("shuffled", "somatopy.interventions.learning:Shuffled")

__all__ = [
    "PAPER_OFFSET",
    "Afresh",
    "Intervention",
    "JointOffset",
    "NoIntervention",
    "PlasticParts",
    "Shuffled",
    "Stage",
    "check_intervention",
]
