"""Eyes: the Eye contract and the detector of fiducial markers."""

from somatopy.eyes.base import Eye
from somatopy.eyes.fiducial import FiducialEye

__all__ = ["Eye", "FiducialEye"]
