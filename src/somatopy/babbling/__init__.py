"""Motor babbling: the paper's uniform random targets, and a check for babblers of your own."""

from somatopy.babbling.check import check_babbler
from somatopy.babbling.uniform import UniformBabbler, check_bounds
from somatopy.contract import Babbler
from somatopy.registry import BABBLERS

BABBLERS.add("uniform", "somatopy.babbling.uniform:Uniform")

__all__ = ["Babbler", "UniformBabbler", "check_babbler", "check_bounds"]
