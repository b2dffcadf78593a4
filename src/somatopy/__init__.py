"""somatopy: a robot babbles with its arm, watches its hand, and learns online where to look.

The names here are what most users need; they are imported when first used:

- `run(description)` runs an experiment and returns its run folder, opened; `load_run(path)` opens one again;
- `study(descriptions, seeds=5)` runs many, in all cores, and gathers their measures in one table;
- `paper()` describes the paper's experiment, `Description` any other, `load_description(path)` reads one from TOML;
- `DSOM` is the self-organising map, `HebbianLinks` the table that joins two, `HebbianLearner` the paper's learner;
- `MujocoBody` is a simulated robot, `FiducialEye` finds the marker on its hand;
- `Session(description)` is an experiment apart from any file: iterate it, frame by frame;
- `check_learner`, `check_rule`, `check_body`, `check_eye`, `check_babbler`, `check_intervention` and `check_map` try
  the laws of each kind on an implementation of yours, and raise a `ContractError` that names the broken one.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from somatopy.analysis import load_run
    from somatopy.api import fork, resume, run
    from somatopy.babbling import check_babbler
    from somatopy.bodies import MujocoBody, check_body
    from somatopy.contract import ContractError
    from somatopy.experiment import Description, Session, load_description, paper
    from somatopy.eyes import FiducialEye, check_eye
    from somatopy.interventions import check_intervention
    from somatopy.learners import HebbianLearner, check_learner
    from somatopy.links import HebbianLinks, check_rule
    from somatopy.maps import (
        DSOM,
        SOM,
        EvolvingSOM,
        GrowingNeuralGas,
        GrowWhenRequired,
        NeuralGas,
        check_map,
        load_map,
    )
    from somatopy.studies import study

__all__ = [
    "DSOM",
    "SOM",
    "ContractError",
    "Description",
    "EvolvingSOM",
    "FiducialEye",
    "GrowWhenRequired",
    "GrowingNeuralGas",
    "HebbianLearner",
    "HebbianLinks",
    "MujocoBody",
    "NeuralGas",
    "Session",
    "check_babbler",
    "check_body",
    "check_eye",
    "check_intervention",
    "check_learner",
    "check_map",
    "check_rule",
    "fork",
    "load_description",
    "load_map",
    "load_run",
    "paper",
    "resume",
    "run",
    "study",
]

_HOMES = {
    "DSOM": "maps",
    "SOM": "maps",
    "ContractError": "contract",
    "Description": "experiment",
    "FiducialEye": "eyes",
    "HebbianLearner": "learners",
    "HebbianLinks": "links",
    "MujocoBody": "bodies",
    "NeuralGas": "maps",
    "GrowingNeuralGas": "maps",
    "EvolvingSOM": "maps",
    "GrowWhenRequired": "maps",
    "check_map": "maps",
    "load_map": "maps",
    "check_babbler": "babbling",
    "check_body": "bodies",
    "check_intervention": "interventions",
    "Session": "experiment",
    "check_eye": "eyes",
    "check_learner": "learners",
    "check_rule": "links",
    "load_description": "experiment",
    "load_run": "analysis",
    "fork": "api",
    "paper": "experiment",
    "resume": "api",
    "run": "api",
    "study": "studies",
}


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module 'somatopy' has no attribute {name!r}; it has {', '.join(__all__)}")
    value = getattr(importlib.import_module(f"somatopy.{_HOMES[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted([*globals(), *__all__])
