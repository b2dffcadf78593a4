"""Experiments: the description, the loop, damages, and the run folder."""

from somatopy.experiment.check import check_damage
from somatopy.experiment.description import Description, DescriptionError, frames_of, load_description
from somatopy.experiment.loop import Experiment
from somatopy.experiment.presets import PRESETS, paper

__all__ = [
    "PRESETS",
    "Description",
    "DescriptionError",
    "Experiment",
    "check_damage",
    "frames_of",
    "load_description",
    "paper",
]
