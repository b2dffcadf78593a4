"""Experiments: their descriptions, the session that runs one, and the run folder that records it."""

from somatopy.experiment.curves import Curves, TensorBoard, WandB
from somatopy.experiment.description import Description, DescriptionError, Phase, frames_of, load_description
from somatopy.experiment.frame import Frame
from somatopy.experiment.presets import PRESETS, paper
from somatopy.experiment.run_folder import RunFolder
from somatopy.experiment.session import Session

__all__ = [
    "PRESETS",
    "Curves",
    "Description",
    "DescriptionError",
    "Frame",
    "Phase",
    "RunFolder",
    "Session",
    "TensorBoard",
    "WandB",
    "frames_of",
    "load_description",
    "paper",
]
