"""Studies: many runs, in many processes, whose measures are gathered in one table.

Names are imported when they are first used, which keeps processes small that only start others on a cluster.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from somatopy.studies.api import study
    from somatopy.studies.plan import Condition, Study
    from somatopy.studies.reading import load_plan, planned

__all__ = ["Condition", "Study", "load_plan", "planned", "study"]

_HOMES = {"Condition": "plan", "Study": "plan", "load_plan": "reading", "planned": "reading", "study": "api"}


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(f"{__name__}.{_HOMES[name]}"), name)


def __dir__() -> list[str]:
    return [*__all__]
