"""Small run folders as the recorder writes them, from columns of one's choice; and one with everything in it."""

from __future__ import annotations

import json
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


ARM_JOINTS = ("ShoulderPitch", "ShoulderRoll", "ElbowYaw", "ElbowRoll")
HEAD_JOINTS = ("HeadYaw", "HeadPitch")
ARM_LIMITS = np.array([[-2.0, 2.0], [-0.3, 1.3], [-2.0, 2.0], [-1.5, 0.0]])
HEAD_LIMITS = np.array([[-2.0, 2.0], [-0.6, 0.5]])
CEILING = 0.5


def write_rich_run(folder: Path, windows: tuple[int, int] = (5, 4), seed: int = 0) -> None:
    """A run with all that a run folder can hold: postures, maps, ceiling, controls, cost, versions."""
    rng = np.random.default_rng(seed)
    n = 4500 * sum(windows)
    arm = rng.uniform(*ARM_LIMITS.T, size=(n, 4))
    seen = rng.random(n) < np.where(arm[:, 0] > 0, 0.5, 0.1)
    columns = {f"arm_{name}_rad": arm[:, k] for k, name in enumerate(ARM_JOINTS)}
    columns |= {f"arm_command_{name}_rad": arm[:, k] for k, name in enumerate(ARM_JOINTS)}
    columns |= {f"head_{name}_rad": rng.uniform(*HEAD_LIMITS[k], n) for k, name in enumerate(HEAD_JOINTS)}
    columns |= {f"head_command_{name}_rad": np.zeros(n) for name in HEAD_JOINTS}
    columns |= {"gaze_error_rad": rng.uniform(0, 1.5, n)}
    columns |= {f"{side}_distance": rng.uniform(0, 0.03, n) for side in ("arm", "head")}
    split = 4500 * windows[0]
    write_run(folder, [seen[:split], seen[split:]], distances=columns, breaks=(1,))
    with (folder / "experiment.toml").open("a", encoding="utf-8") as file:
        file.write('[versions]\nsomatopy = "1.2.3"\n')
    text = (folder / "experiment.toml").read_text(encoding="utf-8")
    (folder / "experiment.toml").write_text('cite = ["A <paper> & co."]\n' + text, encoding="utf-8")
    (folder / "cost.json").write_text(json.dumps({"wall_s": 12.5, "frames": n, "frames_per_s": n / 12.5}))
    write_ceiling(folder, windows)
    for window in range(sum(windows)):
        write_snapshot(folder / "maps" / f"window-{window:05d}.npz", 4500 * (window + 1), rng)
    for name, share in (("random", 0.05), ("frozen", 0.4)):
        hits = rng.random(n) < share
        write_run(folder / "controls" / name, [hits[:split], hits[split:]], learner=name)


def write_ceiling(folder: Path, windows: Sequence[int]) -> None:
    """ceiling.json with the same share in every window."""
    phases = [{"rate": CEILING, "per_window": [CEILING] * n} for n in windows]
    reactive = {"rate": 0.45, "ceiling_rate": CEILING, "frames": 900}
    table = {"eye": "geometric", "grid": [97, 29], "every": 10, "rate": CEILING, "phases": phases, "reactive": reactive}
    (folder / "ceiling.json").write_text(json.dumps(table))


def write_snapshot(path: Path, frame: int, rng: np.random.Generator) -> None:
    """Two small maps with random links."""
    path.parent.mkdir(exist_ok=True)
    table = np.where(rng.random((20, 12)) < 0.3, rng.random((20, 12)), 0.0)
    pre, post = np.nonzero(table)
    np.savez(
        path,
        frame=frame,
        arm_codebook=rng.random((20, 4)),
        head_codebook=rng.random((12, 2)),
        arm_shape=(4, 5),
        head_shape=(3, 4),
        arm_limits=ARM_LIMITS,
        head_limits=HEAD_LIMITS,
        link_pre=pre.astype(np.int32),
        link_post=post.astype(np.int32),
        link_weight=table[pre, post],
    )


@pytest.fixture(scope="session")
def rich_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of `rich_run`; not to be written to."""
    folder = tmp_path_factory.mktemp("runs") / "rich"
    write_rich_run(folder)
    return folder


@pytest.fixture
def rich_run(rich_folder: Path) -> Run:
    """A run of 5 and 4 windows with everything in its folder; not to be written to."""
    return load_run(rich_folder)


@pytest.fixture
def rich_copy(tmp_path: Path) -> Run:
    """Another, to be written to."""
    write_rich_run(tmp_path / "copy", windows=(3, 3), seed=1)
    return load_run(tmp_path / "copy")
