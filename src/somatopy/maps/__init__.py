"""Self-organising maps that learn one input at a time."""

from somatopy.maps.base import Map, Topology
from somatopy.maps.dsom import DSOM
from somatopy.maps.lattice import Lattice
from somatopy.maps.neural_gas import NeuralGas
from somatopy.maps.som import SOM
from somatopy.maps.storage import load_map

__all__ = ["DSOM", "SOM", "Lattice", "Map", "NeuralGas", "Topology", "load_map"]
