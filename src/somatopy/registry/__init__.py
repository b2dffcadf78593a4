"""Kinds: the parts that the description of an experiment can name, and the settings of each.

A kind is a class of settings, that is, a frozen dataclass derived from `Settings`. Its method `build(context)` makes
the part. Each package registers its kinds in its `__init__`, with one line each, and imports nothing before it is
needed.

You name a part of your own by its place, `my_package.my_file:MyLearner`, or by an entry point of the group
`somatopy.learners`, `somatopy.bodies` and so on. At that place stands either a class of settings, or the part itself: a
class, or a function that makes one. In the second case the arguments of that class or function are its settings, except
for the first ones, which every part of its sort is made from.

Settings use `Annotated` to say what they mean, with `Doc`, and which values are valid, with the marks of
`annotated_types` (`Gt`, `Ge`, `Le`, ...). Pydantic reads and checks them. It is imported when a description is first
read.
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
