"""Hebbian links between the units of two maps, and their learning rules."""

from somatopy.links.check import check_rule
from somatopy.links.delta import DeltaRule
from somatopy.links.hebbian import HebbianLinks
from somatopy.links.rules import NormalisedHebb, PositiveHebb, Rule, activation
from somatopy.registry import RULES

RULES.add("positive", "somatopy.links.rules:PositiveHebb")
RULES.add("normalised", "somatopy.links.rules:NormalisedHebb")
RULES.add("delta", "somatopy.links.delta:DeltaRule")

__all__ = ["DeltaRule", "HebbianLinks", "NormalisedHebb", "PositiveHebb", "Rule", "activation", "check_rule"]
