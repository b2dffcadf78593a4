"""Maps and links at window ends."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from somatopy.analysis.runs import RunFolderError
from somatopy.analysis.snapshots import Snapshot, load_snapshot, paper_snapshot

TABLES = arrays(np.float64, (6, 5), elements=st.sampled_from([0.0, 0.0, 0.25, 0.5, 1.0]))


def snapshot(table: np.ndarray) -> Snapshot:
    pre, post = np.nonzero(table)
    limits = np.array([[-1.0, 3.0]])
    units = np.zeros((6, 1)), np.zeros((5, 1))
    return Snapshot(1, *units, (2, 3), (1, 5), limits, limits, pre, post, table[pre, post])


@given(TABLES)
def test_gaze_links_are_the_rows_maxima(table: np.ndarray) -> None:
    """One link for every arm unit that has any: its largest, the first of equal ones; strongest first."""
    pre, post, weight = snapshot(table).gaze_links()
    linked = np.flatnonzero(table.any(axis=1))
    assert sorted(pre.tolist()) == linked.tolist()
    assert weight.tolist() == sorted(table[linked].max(axis=1).tolist(), reverse=True)
    assert all(post[k] == table[unit].argmax() and weight[k] == table[unit].max() for k, unit in enumerate(pre))


def test_postures_run_from_limit_to_limit(rich_run: Any) -> None:
    """0 is a joint's lower limit, 1 its upper; outside of [0, 1] they lie beyond."""
    maps = load_snapshot(rich_run.snapshots[0])
    low, high = maps.arm_limits.T
    assert ((maps.arm_postures() - low) / (high - low)) == pytest.approx(maps.arm_codebook)
    assert maps.head_postures().shape == (12, 2)


def test_snapshots_come_in_order(rich_run: Any, make_run: Any) -> None:
    """One a window, each with its frame; a run without maps has none."""
    frames = [load_snapshot(path).frame for path in rich_run.snapshots]
    assert frames == [4500 * k for k in range(1, 10)]
    assert make_run([True]).snapshots == ()


def test_maps_that_are_not_the_papers_are_none(rich_run: Any, other_maps: Any) -> None:
    """Arrays of a learner's own are told apart from the paper's, whatever they are called."""
    assert all(paper_snapshot(other_maps, path) is None for path in other_maps.snapshots)
    whole = paper_snapshot(rich_run, rich_run.snapshots[0])
    assert whole is not None and whole.frame == 4500


def test_damaged_maps_are_an_error(rich_copy: Any) -> None:
    """They are not taken for a learner's own."""
    rich_copy.snapshots[0].write_bytes(b"PK half")
    with pytest.raises(RunFolderError, match=r"window-00000\.npz is damaged"):
        paper_snapshot(rich_copy, rich_copy.snapshots[0])


def test_damaged_files_are_named(tmp_path: Path, rich_run: Any) -> None:
    """Cut short, empty, or without an array: the file and what to do."""
    whole = rich_run.snapshots[0].read_bytes()
    for content in (whole[: len(whole) // 2], b"", b"text"):
        (tmp_path / "window-00000.npz").write_bytes(content)
        with pytest.raises(RunFolderError, match=r"window-00000\.npz is damaged .*Delete it"):
            load_snapshot(tmp_path / "window-00000.npz")
    np.savez(tmp_path / "other.npz", frame=1)
    with pytest.raises(RunFolderError, match=r"other\.npz lacks an array: .*arm_codebook"):
        load_snapshot(tmp_path / "other.npz")
