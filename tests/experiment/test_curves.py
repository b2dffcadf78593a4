"""Curves of a run: means over stretches of frames, and what two other programs read of them, without a network."""

from __future__ import annotations

import json
import socket
import struct
import sys
import time
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from somatopy.experiment import Curves, Frame, TensorBoard, WandB

Points = list[tuple[int, dict[str, float]]]


class Kept(Curves):
    def __init__(self, every: int = 900) -> None:
        super().__init__(every)
        self.points: Points = []

    def write(self, frames: int, means: Mapping[str, float]) -> None:
        self.points.append((frames, dict(means)))


def frames(lengths: tuple[int, ...], seed: int = 0) -> Iterator[Frame]:
    """Frames of phases of these lengths: hits and misses, a distance with gaps, and a unit's number."""
    rng, number = np.random.default_rng(seed), 0
    for phase, length in enumerate(lengths):
        for k in range(length):
            seen: Any = object() if rng.random() < 0.4 else None
            probes = {"distance": rng.random() if rng.random() < 0.8 else float("nan"), "winner": int(rng.integers(9))}
            nothing: Any = None
            yield Frame(
                number, phase, k == 0, k == length - 1, nothing, seen, nothing, nothing, nothing, nothing, probes, {}
            )
            number += 1


def expected(lengths: tuple[int, ...], every: int) -> Points:
    """The same from the list of all frames at once."""
    points, begin = [], 0
    every_frame = list(frames(lengths))
    for phase, length in enumerate(lengths):
        for first in range(begin, begin + length, every):
            part = every_frame[first : min(first + every, begin + length)]
            distances = [frame.probes["distance"] for frame in part if not np.isnan(frame.probes["distance"])]
            hit_rate = float(np.mean([frame.sighting is not None for frame in part]))
            means = {"hit_rate": hit_rate, "phase": phase}
            if distances:
                means["distance"] = float(np.mean(distances))
            points.append((part[-1].number + 1, means))
        begin += length
    return points


def close(points: Points, others: Points) -> bool:
    return len(points) == len(others) and all(
        frames == there and means.keys() == those.keys() and all(np.isclose(means[k], those[k]) for k in means)
        for (frames, means), (there, those) in zip(points, others, strict=True)
    )


@pytest.mark.parametrize("lengths", [(25,), (30, 17), (9, 10, 11)])
@pytest.mark.parametrize("every", [7, 10, 100])
def test_points_are_means_over_stretches_that_end_with_their_phase(lengths: tuple[int, ...], every: int) -> None:
    """No stretch has frames of two phases; frames without a value do not count; numbers of units have no mean."""
    kept = Kept(every)
    for frame in frames(lengths):
        kept(frame)
    assert close(kept.points, expected(lengths, every))


def test_an_impossible_stretch_is_refused() -> None:
    with pytest.raises(ValueError, match="every = 0 must be at least 1"):
        Kept(0)


def test_tensorboard_reads_what_was_written(tmp_path: Path) -> None:
    """Its own reader finds every point of every curve."""
    from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

    with TensorBoard(tmp_path / "curves", every=10) as sink:
        for frame in frames((30, 17)):
            sink(frame)
    read = EventAccumulator(str(tmp_path / "curves")).Reload()
    curves = {tag: [(event.step, event.value) for event in read.Scalars(tag)] for tag in read.Tags()["scalars"]}
    assert set(curves) == {"hit_rate", "phase", "distance"}
    for tag, points in curves.items():
        wanted = [(step, means[tag]) for step, means in expected((30, 17), 10)]
        assert np.allclose(points, wanted, rtol=1e-6)


def records(data: bytes) -> Iterator[bytes]:
    """The records of a file of Weights & Biases: the log format of LevelDB, behind a header of 7 bytes."""
    at, record = 7, b""
    while at + 7 <= len(data):
        if (left := 32768 - at % 32768) < 7:
            at += left
            continue
        _, length, kind = struct.unpack_from("<IHB", data, at)
        record += data[at + 7 : at + 7 + length]
        at += 7 + length
        if kind in (1, 4):  # whole, or the last part
            yield record
            record = b""


def test_wandb_keeps_it_on_this_machine(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its file has every point, and nobody called the address of its server."""
    from wandb.proto.wandb_internal_pb2 import Record

    with socket.create_server(("127.0.0.1", 0)) as server:
        server.setblocking(False)
        monkeypatch.setenv("WANDB_BASE_URL", f"http://127.0.0.1:{server.getsockname()[1]}")
        monkeypatch.setenv("WANDB_SILENT", "true")
        with WandB(tmp_path, every=10) as sink:
            for frame in frames((30, 17)):
                sink(frame)
        with pytest.raises(BlockingIOError):
            server.accept()
    (file,) = tmp_path.rglob("*.wandb")
    for _ in range(100):  # another process writes it, and may be a moment late
        if file.stat().st_size > 100:
            break
        time.sleep(0.1)
    points = []
    for data in records(file.read_bytes()):
        record = Record()
        record.ParseFromString(data)
        if record.HasField("history"):
            items = {item.key or item.nested_key[0]: json.loads(item.value_json) for item in record.history.item}
            means = {name: value for name, value in items.items() if not name.startswith("_")}
            points.append((record.history.step.num, means))
    assert close(points, expected((30, 17), 10))


@pytest.mark.parametrize(("sink", "extra"), [(TensorBoard, "tensorboard"), (WandB, "wandb")])
def test_a_missing_extra_is_said_with_the_command(
    sink: Any, extra: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """And nothing is made."""
    for module in [name for name in sys.modules if name.startswith(f"{extra}.")]:
        monkeypatch.delitem(sys.modules, module)
    monkeypatch.setitem(sys.modules, extra, None)
    with pytest.raises(ImportError, match=rf'pip install "somatopy\[{extra}\]"'):
        sink(tmp_path / "curves")
    assert not (tmp_path / "curves").exists()


def test_another_mode_is_refused(tmp_path: Path) -> None:
    """Before anything is made, with the modes that there are."""
    with pytest.raises(ValueError, match=r"mode = 'disabled' must be \"offline\" or \"online\""):
        WandB(tmp_path / "curves", mode="disabled")
