"""Self-organising maps that learn one input at a time."""

from somatopy.maps.base import Map
from somatopy.maps.check import check_map
from somatopy.maps.classifier import MapClassifier
from somatopy.maps.dsom import DSOM
from somatopy.maps.evolving_som import EvolvingSOM
from somatopy.maps.graph import Graph
from somatopy.maps.grow_when_required import GrowWhenRequired
from somatopy.maps.growing_neural_gas import GrowingNeuralGas
from somatopy.maps.lattice import Lattice
from somatopy.maps.neural_gas import NeuralGas
from somatopy.maps.som import SOM
from somatopy.maps.storage import load_map
from somatopy.maps.topology import Topology
from somatopy.registry import MAPS

MAPS.add("dsom", "somatopy.maps.dsom:DSOM")
MAPS.add("som", "somatopy.maps.som:SOM")
MAPS.add("neural-gas", "somatopy.maps.neural_gas:NeuralGas")
MAPS.add("growing-neural-gas", "somatopy.maps.growing_neural_gas:GrowingNeuralGas")
MAPS.add("evolving-som", "somatopy.maps.evolving_som:EvolvingSOM")
MAPS.add("grow-when-required", "somatopy.maps.grow_when_required:GrowWhenRequired")

__all__ = [
    "DSOM",
    "SOM",
    "EvolvingSOM",
    "Graph",
    "GrowWhenRequired",
    "GrowingNeuralGas",
    "Lattice",
    "Map",
    "MapClassifier",
    "NeuralGas",
    "Topology",
    "check_map",
    "load_map",
]
