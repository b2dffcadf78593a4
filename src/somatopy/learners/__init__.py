"""Learners: the Learner contract, the paper's learner, and controls that do not learn."""

from somatopy.contract import Learner
from somatopy.learners.base import Plastic, Scale
from somatopy.learners.best import BestLearner
from somatopy.learners.check import check_learner
from somatopy.learners.controls import FixedGaze, RandomGaze
from somatopy.learners.hebbian import HebbianLearner, centring
from somatopy.learners.nearest import NearestGaze
from somatopy.registry import LEARNERS

LEARNERS.add("hebbian", "somatopy.learners.hebbian:Hebbian")
LEARNERS.add("best", "somatopy.learners.best:BestLearner")
LEARNERS.add("random", "somatopy.learners.controls:RandomGaze")
LEARNERS.add("fixed", "somatopy.learners.controls:Fixed")
LEARNERS.add("nearest", "somatopy.learners.nearest:NearestGaze")

__all__ = [
    "BestLearner",
    "FixedGaze",
    "HebbianLearner",
    "Learner",
    "NearestGaze",
    "Plastic",
    "RandomGaze",
    "Scale",
    "centring",
    "check_learner",
]
