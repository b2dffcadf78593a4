"""Learners: the Learner contract, the paper's learner, and controls that do not learn."""

from somatopy.learners.base import Learner, Plastic, Scale
from somatopy.learners.check import check_learner
from somatopy.learners.controls import FixedGaze, RandomGaze
from somatopy.learners.hebbian import HebbianLearner, centring
from somatopy.learners.nearest import NearestGaze

__all__ = [
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
