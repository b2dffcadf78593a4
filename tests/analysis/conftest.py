"""Small run folders as the recorder writes them, from columns of one's choice; and one with everything in it."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
import tomli_w

from somatopy.analysis.cells import StudyResult, load_study, to_table
from somatopy.analysis.runs import Run, load_run

MakeRun = Callable[..., Run]

HEAD = """format = 2
name = "synthetic"
seed = 7
[body]
kind = "mujoco"
model = "nao"
motion = "kinematic"
[eye]
kind = "geometric"
[learner]
kind = "{learner}"
"""
SCALARS = {
    "hit": {"meaning": "whether the marker was detected", "unit": "", "role": "sighting"},
    "gaze_error_rad": {"meaning": "angle between the optical axis and the hand", "unit": "rad", "role": "body"},
    "arm_distance": {"meaning": "distance from arm input to winner", "unit": "1", "role": "probe"},
    "head_distance": {"meaning": "distance from head input to winner", "unit": "1", "role": "probe"},
}
PHASE = """[[phases]]
name = "phase {index}"
frames = {frames}
trend_breaks = {breaks}
interventions = {interventions}
"""


@pytest.fixture
def make_run(tmp_path: Path) -> MakeRun:
    """Build a run folder: `make(hits of phase 0, hits of phase 1, ...)`; see the keywords of `write_run`."""

    def make(*hits: Any, **settings: Any) -> Run:
        folder = tmp_path / settings.pop("folder", "run")
        write_run(folder, [np.asarray(phase, dtype=bool) for phase in hits], **settings)
        return load_run(folder)

    return make


def vector(
    sense: str, joints: Sequence[str], values: Any, role: str = "sensed", unit: str = "rad"
) -> dict[str, tuple[np.ndarray, dict[str, str]]]:
    """Columns of a sense's vector with their metadata, as the recorder writes them; `values`: (frames, joints)."""
    prefix = sense if role == "sensed" else f"{sense}_{role}"
    told = {"meaning": f"{role} posture", "unit": unit, "role": role, "sense": sense}
    return {f"{prefix}.{name}": (np.asarray(values)[:, k], told | {"label": name}) for k, name in enumerate(joints)}


@pytest.fixture
def vector_columns() -> Callable[..., dict[str, Any]]:
    """`vector`."""
    return vector


def _table(columns: dict[str, Any]) -> pa.Table:
    """Columns are arrays, or pairs of an array and its metadata."""
    arrays, fields = [], []
    for name, found in columns.items():
        values, told = found if isinstance(found, tuple) else (found, SCALARS.get(name))
        arrays.append(pa.array(values))
        fields.append(pa.field(name, arrays[-1].type, metadata=told))
    return pa.Table.from_arrays(arrays, schema=pa.schema(fields))


def write_run(
    folder: Path,
    hits: Sequence[np.ndarray],
    *,
    distances: dict[str, Any] | None = None,
    breaks: Sequence[int] = (7,),
    interventions: Sequence[Sequence[str]] | None = None,
    learner: str = "hebbian",
    part_frames: int = 4500,
    recorded: int | None = None,
) -> None:
    """Write a run with damage from its second phase on, or with interventions of these kinds in each phase.

    `distances`: further columns, by name; see `_table`. `recorded`: frames in finished parts (killed run).
    """
    frames = folder / "frames"
    frames.mkdir(parents=True)
    text = HEAD.format(learner=learner)
    for index, phase in enumerate(hits):
        kinds = interventions[index] if interventions is not None else ["offset"] if index else []
        done = ", ".join(f"{{kind = '{kind}'}}" for kind in kinds)
        cuts = list(breaks) if kinds else []
        text += PHASE.format(index=index, frames=len(phase), breaks=cuts, interventions=f"[{done}]")
    (folder / "experiment.toml").write_text(text, encoding="utf-8")
    seen = np.concatenate([*hits, np.empty(0, dtype=bool)])
    table = _table(
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


def edit(run: Run, *pairs: tuple[str, str]) -> Run:
    """Replace texts of a run's experiment.toml, and open it again."""
    file = run.path / "experiment.toml"
    text = file.read_text(encoding="utf-8")
    for old, new in pairs:
        assert old in text
        text = text.replace(old, new)
    file.write_text(text, encoding="utf-8")
    return load_run(run.path)


@pytest.fixture
def edited() -> Callable[..., Run]:
    """`edit`."""
    return edit


ARM_JOINTS = ("ShoulderPitch", "ShoulderRoll", "ElbowYaw", "ElbowRoll")
HEAD_JOINTS = ("HeadYaw", "HeadPitch")
ARM_LIMITS = np.array([[-2.0, 2.0], [-0.3, 1.3], [-2.0, 2.0], [-1.5, 0.0]])
HEAD_LIMITS = np.array([[-2.0, 2.0], [-0.6, 0.5]])
CEILING = 0.5


def write_rich_run(folder: Path, windows: tuple[int, int] = (5, 4), seed: int = 0, idle: bool = False) -> None:
    """A run with all that a run folder can hold: postures, maps, ceiling, controls, cost, versions.

    `idle`: before, between and after the two phases stand some of 0 frames, in which this and that is done.
    """
    phases: tuple[int, ...] = (0, windows[0], 0, windows[1], 0) if idle else windows
    done = (["offset"], [], ["my:Tremor", "afresh"], ["offset"], []) if idle else ([], ["offset"])
    rng = np.random.default_rng(seed)
    n = 4500 * sum(windows)
    arm = rng.uniform(*ARM_LIMITS.T, size=(n, 4))
    seen = rng.random(n) < np.where(arm[:, 0] > 0, 0.5, 0.1)
    columns: dict[str, Any] = {}
    for role, shift in (("sensed", 0.0), ("command", 0.5), ("percept", 1.0)):
        columns |= vector("arm", ARM_JOINTS, arm + shift, role)
    head = rng.uniform(*HEAD_LIMITS.T, size=(n, 2))
    columns |= vector("head", HEAD_JOINTS, head) | vector("head", HEAD_JOINTS, np.zeros((n, 2)), "command")
    columns |= {"time_s": np.arange(n) / 15, "gaze_error_rad": rng.uniform(0, 1.5, n)}
    columns |= {f"{side}_distance": rng.uniform(0, 0.03, n) for side in ("arm", "head")}
    borders = np.cumsum(phases)[:-1] * 4500
    more: Any = {"breaks": (1,), "interventions": done}
    write_run(folder, np.split(seen, borders), distances=columns, **more)
    with (folder / "experiment.toml").open("a", encoding="utf-8") as file:
        file.write('[versions]\nsomatopy = "1.2.3"\n')
    text = (folder / "experiment.toml").read_text(encoding="utf-8")
    (folder / "experiment.toml").write_text('cite = ["A <paper> & co."]\n' + text, encoding="utf-8")
    (folder / "cost.json").write_text(json.dumps({"wall_s": 12.5, "frames": n, "frames_per_s": n / 12.5}))
    write_ceiling(folder, phases)
    write_sight(folder, phases)
    for window in range(sum(windows)):
        write_snapshot(folder / "maps" / f"window-{window:05d}.npz", 4500 * (window + 1), rng)
    for name, share in (("random", 0.05), ("frozen", 0.4)):
        hits = rng.random(n) < share
        write_run(folder / "controls" / name, np.split(hits, borders), learner=name, **more)


def write_ceiling(folder: Path, windows: Sequence[int]) -> None:
    """ceiling.json with the same share in every window."""
    phases = [{"rate": CEILING if n else None, "per_window": [CEILING] * n} for n in windows]
    reactive = {"rate": 0.45, "ceiling_rate": CEILING, "frames": 900}
    table = {"eye": "geometric", "grid": [97, 29], "every": 10, "rate": CEILING, "phases": phases, "reactive": reactive}
    (folder / "ceiling.json").write_text(json.dumps(table))


#: Steps of a small grid of gazes, of which the last cannot be taken.
GAZE_STEPS = (5, 3)


def write_sight(folder: Path, windows: Sequence[int], told: bool = True) -> None:
    """belief.npz and sight.npz: eight postures at each window's end, and stretches of the first and the last phase."""
    rng, m = np.random.default_rng(5), GAZE_STEPS[0] * GAZE_STEPS[1] - 1
    axes = [np.linspace(low, high, n) for (low, high), n in zip(HEAD_LIMITS, GAZE_STEPS, strict=True)]
    heads = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 2)[:m]
    played = [k for k, n in enumerate(windows) if n]
    asked = sum(windows)
    np.savez(
        folder / "belief.npz",
        arms=rng.uniform(*ARM_LIMITS.T, (8, 4)),
        heads=heads,
        shape=GAZE_STEPS,
        cells=np.arange(m),
        limits=HEAD_LIMITS,
        frame=4500 * np.arange(1, asked + 1),
        phase=np.repeat(np.arange(len(windows)), windows),
        gaze=heads[rng.integers(m, size=(asked, 8))],
        belief=rng.integers(256, size=(asked, 8, m)).astype(np.uint8) if told else np.zeros((asked, 8, 0), np.uint8),
    )
    seen = np.zeros((len(windows), 8, m), bool)
    seen[played] = rng.random((len(played), 8, m)) < 0.3
    ends = np.cumsum([0, *windows]) * 4500
    starts = [start for k in (played[0], played[-1]) for start in (ends[k], ends[k + 1] - 450)]
    frame = np.concatenate([np.arange(start, start + 450) for start in starts])
    gazes = np.where(rng.random(len(frame)) < 0.6, rng.integers(1, 300, len(frame)), 0)
    stretch = np.repeat(np.arange(len(starts)), 450)
    np.savez(folder / "sight.npz", frame=frame, stretch=stretch, gazes=gazes, grid=2089, seen=seen)


@pytest.fixture(name="write_sight")
def _write_sight() -> Callable[..., None]:
    """`write_sight`."""
    return write_sight


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


WHOLE = {
    "frame": 1,
    "arm_codebook": np.zeros((6, 4)),
    "head_codebook": np.zeros((6, 2)),
    "arm_shape": (2, 3),
    "head_shape": (2, 3),
    "arm_limits": ARM_LIMITS,
    "head_limits": HEAD_LIMITS,
    "link_pre": [0],
    "link_post": [5],
    "link_weight": [1.0],
}
#: What a learner of one's own may keep, under names of its own or under the paper's.
OTHER_MAPS: dict[str, dict[str, Any]] = {
    "names of its own": {"frame": 1, "memory": np.zeros((3, 4)), "count": 3},
    "lattice of three axes": WHOLE | {"arm_shape": (1, 2, 3)},
    "lattice of one axis": WHOLE | {"head_shape": (6,)},
    "more units than the lattice has": WHOLE | {"arm_codebook": np.zeros((7, 4))},
    "more values than the arm has joints": WHOLE | {"arm_codebook": np.zeros((6, 5)), "arm_limits": np.ones((5, 2))},
    "limits of other joints": WHOLE | {"head_limits": ARM_LIMITS},
    "links from nowhere": WHOLE | {"link_pre": [6]},
    "links without weights": WHOLE | {"link_weight": [1.0, 2.0]},
}


@pytest.fixture(params=OTHER_MAPS)
def other_maps(rich_copy: Run, request: pytest.FixtureRequest) -> Run:
    """A run of a learner whose maps are not the paper's."""
    for path in rich_copy.snapshots:
        np.savez(path, **OTHER_MAPS[request.param])
    return rich_copy


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
def idle_run(tmp_path: Path) -> Run:
    """The same frames as `rich_run`, with phases of 0 frames around."""
    write_rich_run(tmp_path / "rich", idle=True)
    return load_run(tmp_path / "rich")


TWINLESS = (('kind = "mujoco"\n', 'kind = "my_lab.arms:RealArm"\n'), ('motion = "kinematic"\n', ""))


@pytest.fixture
def twinless_run(rich_copy: Run) -> Run:
    """A run of a body that is not somatopy's and has no model of itself, so that there is no ceiling."""
    for name in ("ceiling.json", "belief.npz", "sight.npz"):
        (rich_copy.path / name).unlink()
    return edit(rich_copy, *TWINLESS)


@pytest.fixture(scope="session")
def other_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of which `rich_copy` is a copy; not to be written to."""
    folder = tmp_path_factory.mktemp("runs") / "other"
    write_rich_run(folder, windows=(3, 3), seed=1)
    return folder


@pytest.fixture
def rich_copy(other_folder: Path, tmp_path: Path) -> Run:
    """Another, to be written to."""
    return load_run(shutil.copytree(other_folder, tmp_path / "copy"))


Values = Sequence[Any]


def cell_rows(condition: str, seed: int, rates: Values, damages: Sequence[str], **more: Sequence[Any]) -> list[Any]:
    """The rows of a cell, one a rate: phases of two windows, under a ceiling of .8; `more`: other columns, by phase."""
    return [
        {
            "key": f"{condition}/{seed}",
            "condition": condition,
            "seed": seed,
            "phase": phase,
            "phase_name": f"phase {phase}",
            "damage": damage,
            "learner": "hebbian",
            "eye": "geometric",
            "motion": "kinematic",
            "frames": 9000,
            "rate": rate,
            "ceiling": 0.8,
            "efficiency": None if rate is None else rate / 0.8,
            "hits_per_window": [] if rate is None else [round(4500 * rate), round(4500 * rate) + 9],
            "slopes": [9.0],
            "arm_distortion_end": 0.1,
            "head_distortion_end": 0.01,
            **{name: values[phase] for name, values in more.items()},
        }
        for phase, (rate, damage) in enumerate(zip(rates, damages, strict=True))
    ]


def write_study(folder: Path, rows: Sequence[Any], order: Sequence[str], failures: Sequence[Any] = ()) -> StudyResult:
    """A study folder of these rows; every condition has the seeds that occur anywhere."""
    folder.mkdir(parents=True, exist_ok=True)
    failed = [failure["seed"] for failure in failures]
    seeds = sorted({*(row["seed"] for row in rows), *failed})
    entry = {"seeds": seeds, "experiment": {"name": "paper", "learner": {"kind": "hebbian"}}}
    conditions = {name: entry | {"factors": {"arm": name}} for name in order}
    (folder / "study.toml").write_text(tomli_w.dumps({"name": "arms", "order": [*order], "conditions": conditions}))
    (folder / "failures.json").write_text(json.dumps([*failures]))
    pq.write_table(to_table(rows), folder / "cells.parquet")
    return load_study(folder)


@pytest.fixture
def make_study(tmp_path: Path) -> Callable[..., StudyResult]:
    """Build a study folder: `make({condition: {seed: rates of its phases}}, damages=, failures=, columns by phase)`."""

    def make(
        rates: dict[str, dict[int, Values]],
        damages: Sequence[str] = ("none",),
        failures: Sequence[Any] = (),
        order: Sequence[str] | None = None,
        **more: Sequence[Any],
    ) -> StudyResult:
        cells = [(name, seed, found) for name, seeds in rates.items() for seed, found in seeds.items()]
        rows = [row for name, seed, found in cells for row in cell_rows(name, seed, found, damages, **more)]
        return write_study(tmp_path / "study", rows, [*rates] if order is None else order, failures)

    return make


@pytest.fixture(scope="session")
def studies(tmp_path_factory: pytest.TempPathFactory) -> dict[str, StudyResult]:
    """A study of three conditions, and one of twenty with names that are long; five seeds, two phases."""
    found = {}
    for count in (3, 20):
        names = [f"learner {k}" if k % 3 else f"hebbian, elasticity {k / 10} on a map of 20 × 20" for k in range(count)]
        rng = np.random.default_rng(count)
        rows = [
            row
            for k, name in enumerate(names)
            for seed in range(5)
            for row in cell_rows(name, seed, (0.2 + 0.02 * k + 0.05 * rng.random(2)).tolist(), ("none", "offset"))
        ]
        found["many" if count > 3 else "few"] = write_study(tmp_path_factory.mktemp("study"), rows, names)
    return found
