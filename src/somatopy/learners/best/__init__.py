"""The best learner: directions, visibility and a body schema, learned from single frames without a robot model."""

from somatopy.learners.best.learner import BestLearner

__all__ = ["BestLearner"]
