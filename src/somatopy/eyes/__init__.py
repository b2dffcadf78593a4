"""Eyes: the Eye contract, the detector of fiducial markers, and a geometric model of it."""

from somatopy.eyes.base import Eye
from somatopy.eyes.check import check_eye
from somatopy.eyes.fiducial import FiducialEye
from somatopy.eyes.geometric import GeometricEye

__all__ = ["Eye", "FiducialEye", "GeometricEye", "check_eye"]
