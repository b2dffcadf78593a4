"""Short experiments with small maps, an eye that needs no pictures and a body without physics."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from somatopy.analysis import load_run
from somatopy.analysis.runs import Run
from somatopy.experiment import Description, RunFolder, Session

Short = Callable[..., Description]
RunShort = Callable[..., Run]

SMALL = {"shape": [10, 10]}
TABLE: dict[str, Any] = {
    "name": "short",
    "seed": 3,
    "body": {"motion": "kinematic"},
    "eye": {"kind": "geometric"},
    "learner": {"kind": "hebbian", "arm_map": SMALL, "head_map": SMALL},
    "phases": [
        {"name": "intact", "frames": 200},
        {"name": "damaged", "frames": 100, "damage": {"kind": "offset"}},
    ],
}


@pytest.fixture
def short() -> Short:
    """A description of 200 intact and 100 damaged frames; keywords replace whole tables."""
    return lambda **tables: Description.model_validate(TABLE | tables)


@pytest.fixture
def run_short(short: Short, tmp_path: Path) -> RunShort:
    """Run `short(**tables)` to its end and open its folder, named by `folder`."""

    def run(folder: str = "run", **tables: Any) -> Run:
        with Session(short(**tables)) as session:
            opened = RunFolder.new(tmp_path / folder, session.description)
            with opened.recording(session):
                for _ in session:
                    pass
        return load_run(opened.path)

    return run
