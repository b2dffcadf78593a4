"""Small run folders as the recorder writes them, from columns of one's choice."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from somatopy.analysis.runs import Run, load_run

MakeRun = Callable[..., Run]

HEAD = """name = "synthetic"
seed = 7
[body]
model = "nao"
motion = "kinematic"
[eye]
kind = "geometric"
[learner]
kind = "{learner}"
"""
PHASE = """[[phases]]
name = "phase {index}"
frames = {frames}
trend_breaks = {breaks}
[phases.damage]
kind = "{damage}"
"""


@pytest.fixture
def make_run(tmp_path: Path) -> MakeRun:
    """Build a run folder: `make(hits of phase 0, hits of phase 1, ...)`; see the keywords of `write_run`."""

    def make(*hits: Any, **settings: Any) -> Run:
        folder = tmp_path / settings.pop("folder", "run")
        write_run(folder, [np.asarray(phase, dtype=bool) for phase in hits], **settings)
        return load_run(folder)

    return make


def write_run(
    folder: Path,
    hits: Sequence[np.ndarray],
    *,
    distances: dict[str, np.ndarray] | None = None,
    breaks: Sequence[int] = (7,),
    learner: str = "hebbian",
    part_frames: int = 4500,
    recorded: int | None = None,
) -> None:
    """Write a run with damage from its second phase on; `recorded`: frames in finished parts (killed run)."""
    frames = folder / "frames"
    frames.mkdir(parents=True)
    text = HEAD.format(learner=learner)
    for index, phase in enumerate(hits):
        damage, cuts = ("offset", list(breaks)) if index else ("none", [])
        text += PHASE.format(index=index, frames=len(phase), breaks=cuts, damage=damage)
    (folder / "experiment.toml").write_text(text, encoding="utf-8")
    seen = np.concatenate([*hits, np.empty(0, dtype=bool)])
    table = pa.table(
        {
            "frame": np.arange(len(seen)),
            "phase": np.repeat(np.arange(len(hits), dtype=np.int16), [len(phase) for phase in hits]),
            "hit": seen,
            **(distances or {}),
        }
    ).slice(0, recorded)
    for index, start in enumerate(range(0, table.num_rows, part_frames)):
        pq.write_table(table.slice(start, part_frames), frames / f"part-{index:05d}.parquet")


def write_counts(counts: Sequence[float], rest: int = 0, window: int = 4500) -> np.ndarray:
    """Hits whose full windows hold the counts (rounded), the hits first in each, then `rest` frames of misses."""
    flags = [np.arange(window) < round(count) for count in counts]
    return np.concatenate([*flags, np.zeros(rest, dtype=bool)])


@pytest.fixture
def hits_with_counts() -> Callable[..., np.ndarray]:
    """`write_counts`."""
    return write_counts
