"""What a run writes while it runs: a write that fails, at whatever file, leaves no gap once the run goes on."""

from __future__ import annotations

from collections.abc import Callable
from errno import ENOSPC
from pathlib import Path
from typing import Any

import pytest

from somatopy.api import resume, run
from somatopy.experiment import Description, belief, checkpoint, recorder, run_writer
from somatopy.experiment.checkpoint import read_checkpoint
from somatopy.files import write_whole

Short = Callable[..., Description]
QUIET: dict[str, Any] = {"progress": False, "ceiling": False}

#: A file, and which of its writes fails: in the middle of taking a frame in, before the phase's own, and behind it.
FAILING = [("part-00001.parquet", 1), ("window-00001.npz", 1), ("phase-0.npz", 1), ("checkpoint.npz", 4)]


def contents(folder: Path) -> dict[str, Any]:
    """All that does not depend on the clock; of checkpoints, how far they are."""
    files = [*folder.glob("frames/*"), *folder.glob("maps/*"), folder / "belief.npz", folder / "summary.json"]
    ends = {path.name: read_checkpoint(path)["session"]["done"] for path in folder.glob("*.npz") if is_state(path)}
    return {str(path.relative_to(folder)): path.read_bytes() for path in files} | ends


def is_state(path: Path) -> bool:
    return path.name.startswith(("phase-", "checkpoint"))


def test_a_disk_that_is_full_at_any_file_leaves_no_gap(
    short: Short, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Gone on with, once there is room, the run has all that it would have had."""
    for module in (run_writer, recorder):
        monkeypatch.setattr(module, "PART_FRAMES", 50)
    expected = contents(run(short(), tmp_path / "whole", **QUIET).path)
    for number, (name, which) in enumerate(FAILING):
        folder, seen = tmp_path / str(number), list[str]()

        def full(path: Path, content: Any, name: str = name, which: int = which, seen: list[str] = seen) -> None:
            seen.append(path.name)
            if path.name == name and seen.count(name) == which:
                raise OSError(ENOSPC, "No space left on device", str(path))
            write_whole(path, content)

        with monkeypatch.context() as patched:
            for module in (recorder, run_writer, checkpoint, belief):
                patched.setattr(module, "write_whole", full)
            with pytest.raises(OSError, match="No space left") as caught:
                run(short(), folder, **QUIET)
        assert "somatopy resume" in " ".join(caught.value.__notes__), name
        assert contents(resume(folder, **QUIET).path) == expected, name


def test_where_a_phase_ends_its_checkpoint_comes_first(
    short: Short, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A process that is killed between the two writes has lost nothing: whoever goes on comes by that end again."""
    names: list[str] = []

    def noted(path: Path, content: Any) -> None:
        names.append(path.name)
        write_whole(path, content)

    for module in (run_writer, checkpoint):
        monkeypatch.setattr(module, "write_whole", noted)
    run(short(), tmp_path / "run", maps=False, **QUIET)
    states = [name for name in names if is_state(Path(name))]
    assert states == ["checkpoint.npz", "phase-0.npz", "checkpoint.npz", "phase-1.npz", "checkpoint.npz"]
