"""Eyes: the detector of fiducial markers, a geometric model of it, and a check for eyes of your own."""

from somatopy.contract import Eye
from somatopy.eyes.check import check_eye
from somatopy.eyes.fiducial import FiducialEye
from somatopy.eyes.geometric import GeometricEye
from somatopy.registry import EYES

__all__ = ["Eye", "FiducialEye", "GeometricEye", "check_eye"]

EYES.add("fiducial", "somatopy.eyes.fiducial:Fiducial")
EYES.add("geometric", "somatopy.eyes.geometric:Geometric")
