"""Kinds: the parts of an experiment that a description can name, and what configures each.

A kind is a class of settings: a frozen dataclass, derived from `Settings`, which stands beside the part that its
`build(context)` makes. Each package names its kinds in its `__init__`, one line each; nothing is imported before it is
needed. A part of your own is named by its place, `my_package.my_file:MyLearner`, or by an entry point of the group
`somatopy.learners`, `somatopy.bodies` and so on. What stands there is either such settings, or the part itself: a
class, or a function that makes one. Then the arguments that come after those which every part of its sort is made from
are its settings.

Settings say with `Annotated` what they mean and which values are valid, by `Doc` and the marks of `annotated_types`
(`Gt`, `Ge`, `Le`, ...). Reading and checking them takes pydantic, which is imported when a description is first read.
"""

from somatopy.registry.kinds import (
    BABBLERS,
    BODIES,
    EYES,
    INTERVENTIONS,
    LEARNERS,
    MAPS,
    RULES,
    SORTS,
    Kinds,
    handed_over,
)
from somatopy.registry.places import HANDED_OVER, UnknownKind
from somatopy.registry.settings import BuildContext, Finite, Positive, Settings

__all__ = [
    "BABBLERS",
    "BODIES",
    "EYES",
    "HANDED_OVER",
    "INTERVENTIONS",
    "LEARNERS",
    "MAPS",
    "RULES",
    "SORTS",
    "BuildContext",
    "Finite",
    "Kinds",
    "Positive",
    "Settings",
    "UnknownKind",
    "handed_over",
]
