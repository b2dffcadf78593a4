"""Motor babbling: the Babbler contract and the paper's uniform random targets."""

from somatopy.babbling.base import Babbler
from somatopy.babbling.check import check_babbler
from somatopy.babbling.uniform import UniformBabbler, check_bounds

__all__ = ["Babbler", "UniformBabbler", "check_babbler", "check_bounds"]
