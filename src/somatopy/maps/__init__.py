"""Self-organising maps that learn one input at a time."""

from somatopy.maps.base import Map
from somatopy.maps.dsom import DSOM

__all__ = ["DSOM", "Map"]
