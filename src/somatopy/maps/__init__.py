"""Self-organising maps that learn one input at a time."""

from somatopy.maps.base import Map, Topology
from somatopy.maps.check import check_map
from somatopy.maps.dsom import DSOM
from somatopy.maps.evolving_som import EvolvingSOM
from somatopy.maps.graph import Graph
from somatopy.maps.grow_when_required import GrowWhenRequired
from somatopy.maps.growing_neural_gas import GrowingNeuralGas
from somatopy.maps.lattice import Lattice
from somatopy.maps.neural_gas import NeuralGas
from somatopy.maps.som import SOM
from somatopy.maps.storage import load_map

__all__ = [
    "DSOM",
    "SOM",
    "EvolvingSOM",
    "Graph",
    "GrowWhenRequired",
    "GrowingNeuralGas",
    "Lattice",
    "Map",
    "NeuralGas",
    "Topology",
    "check_map",
    "load_map",
]
