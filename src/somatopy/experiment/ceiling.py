"""What was possible: the share of frames in which any head posture sees the hand, and the bound without look-ahead.

A hit rate says nothing without its ceiling: it depends on marker, camera, occlusion and babbling range. Both bounds
come from the geometric eye and are labelled so.
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_cdt

from somatopy.bodies import MujocoBody, occluders
from somatopy.eyes import GeometricEye, frustum, geometric, rays
from somatopy.percept import Floats, Ints

__all__ = ["EVERY", "GRID", "Vantages", "best_fixed_head", "ceiling", "reachable", "reactive_hits"]

#: Head postures tried along each head joint; docs/ceiling.md shows that more change little.
GRID = (97, 29)
#: The ceiling looks at every tenth frame.
EVERY = 10

_STRETCHES, _STRETCH = 10, 900  # the reactive bound: ten stretches of one minute
_ENOUGH = 3000  # arm postures by which the best fixed head posture is chosen

Bools = NDArray[np.bool_]


def ceiling(
    body: MujocoBody,
    arms_by_phase: Sequence[Floats],
    window: int = 4500,
    every: int = EVERY,
    grid: tuple[int, ...] = GRID,
    head_speed: float | None = None,
) -> dict[str, Any]:
    """Ceiling and reactive bound of a run's arm postures; kept in the user's cache folder and looked up there.

    The reactive bound is that of ten stretches of 900 frames, the first at the start of the run, the last at its end,
    the others evenly between; of the whole run where it is no longer than that.

    Args:
        body: the robot.
        arms_by_phase: for each phase the sensed arm posture in each frame, shape (frames, n_arm), rad.
        window: frames in a window.
        every: frames from one that the ceiling looks at to the next.
        grid: head postures tried along each head joint.
        head_speed: speed of the head's set-points, rad/s, as the body was given it; the velocity limits where None.

    Returns:
        Plain data: "eye", "grid", "every"; "rate", the share of frames in which the hand can be seen; "phases", for
        each its "rate" and "per_window", the rates of its full windows; "reactive" with "rate", what the reactive gaze
        hits, "ceiling_rate", what can be seen in the same frames, and "frames", how many they are. A rate is None
        where there are no frames.
    """
    arms_by_phase = [np.ascontiguousarray(arms, float) for arms in arms_by_phase]
    key = _fingerprint(body, arms_by_phase, (window, every, grid, head_speed))
    kept = _recall(key)
    if kept is None:
        kept = _compute(body, arms_by_phase, window, every, grid, head_speed)
        _keep(key, kept)
    return kept


def best_fixed_head(body: MujocoBody, arms: Floats, grid: tuple[int, ...] = GRID) -> Floats:
    """The head posture from which the hand is seen in most arm postures; among equals the one most robustly so.

    Args:
        body: the robot.
        arms: arm postures, shape (n, n_arm), rad; of more than 3,000 only every k-th counts.
        grid: head postures tried along each head joint.

    Returns:
        Shape (n_head,), rad.

    Raises:
        ValueError: no arm postures.
    """
    if not len(arms):
        raise ValueError("The best fixed head posture needs at least one arm posture; there are none.")
    vantages = Vantages.of(body, grid)
    counts = np.zeros(len(vantages.heads), np.int64)
    for arm in arms[:: -(-len(arms) // _ENOUGH)]:
        counts += vantages.seeing(arm)
    return np.array(vantages.heads[vantages.robustness(counts == counts.max()).argmax()])


@dataclass(frozen=True)
class Vantages:
    """All head postures of a grid inside the limits, coupled ones included, and what the eye would see from each.

    Where joints limit each other the grid ends on the limit itself, not at the last of its steps inside.

    Attributes:
        body: the robot.
        eye: the geometric eye behind its camera.
        heads: the postures, shape (m, n_head), rad.
        shape: steps of the grid along each head joint.
        cells: where each posture stands in the grid, shape (m,).
        cameras: the camera's pose at each, shape (m, 12).
        moved: poses there of the occluders that move with the head, shape (m, k, 12).
        rows: which occluders those are, shape (k,).

    Example:
        >>> vantages = Vantages.of(MujocoBody("nao", motion="kinematic"), shape=(25, 9))
        >>> arm = np.array([0.4, 0.0, -1.0, -0.9])
        >>> head = vantages.heads[vantages.robustness(vantages.seeing(arm)).argmax()]
        >>> vantages.eye.find(vantages.body.view(arm, head)) is not None
        True
    """

    body: MujocoBody
    eye: GeometricEye
    heads: Floats
    shape: tuple[int, ...]
    cells: Ints
    cameras: Floats
    moved: Floats
    rows: Ints

    @classmethod
    def of(cls, body: MujocoBody, shape: tuple[int, ...] = GRID) -> Vantages:
        """The head postures of a body, as many steps along each head joint as `shape` says."""
        axes = [np.linspace(a, b, n) for a, b, n in zip(body.head.lower, body.head.upper, shape, strict=True)]
        every = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, len(axes))
        heads = np.stack([body.legal(head) for head in every])
        step = (body.head.upper - body.head.lower) / np.maximum(np.array(shape) - 1, 1)
        cells = np.flatnonzero((np.abs(heads - every) < step).all(axis=1))
        views = [body.view(body.arm.lower, head) for head in heads[cells]]
        poses = np.stack([view.occluders for view in views])
        rows = np.flatnonzero((poses != poses[0]).any(axis=(0, 2)))
        return cls(
            body=body,
            eye=GeometricEye(body.camera, body.marker, body.occluders),
            heads=heads[cells],
            shape=shape,
            cells=cells,
            cameras=np.stack([view.camera for view in views]),
            moved=np.ascontiguousarray(poses[:, rows]),
            rows=rows,
        )

    def seeing(self, arm: Floats, first: int = -1) -> Bools:
        """Which of the head postures see the hand at this arm posture, (m,); see `GeometricEye.look_from_each`."""
        view = self.body.view(arm, self.heads[0])
        return self.eye.look_from_each(self.cameras, self.moved, self.rows, view, first)

    def robustness(self, seen: Bools) -> Ints:
        """How many steps of the grid each head posture is from the nearest that does not see, shape (m,).

        Zero for those that do not see themselves; what lies beyond the limits does not see.
        """
        grid = np.zeros(self.shape, np.int64)
        grid.flat[self.cells] = seen
        distance = distance_transform_cdt(np.pad(grid, 1), metric="chessboard")
        return np.asarray(distance[(slice(1, -1),) * grid.ndim].flat[self.cells], np.int64)


def reachable(vantages: Vantages, arms: Floats) -> Bools:
    """Whether the hand can be seen at all: the ceiling is the mean.

    Args:
        vantages: the head postures to try.
        arms: arm postures, shape (n, n_arm), rad.

    Returns:
        Shape (n,).
    """
    first, found = 0, np.zeros(len(arms), np.bool_)
    for k, arm in enumerate(arms):
        seen = vantages.seeing(arm, first)
        found[k] = seen.any()
        if found[k]:
            first = int(seen.argmax())
    return found


def reactive_hits(vantages: Vantages, arms: Floats, head_speed: float | None = None) -> tuple[Bools, Bools]:
    """What a gaze with perfect knowledge but no look-ahead hits.

    In each frame it heads for the most robust head posture that sees the hand where it is now, the nearest of equal
    ones. Its head moves as the body's does: at its speed, within all limits and with the lag of its servos.

    Args:
        vantages: the head postures to choose from.
        arms: the arm posture in consecutive frames, shape (n, n_arm), rad.
        head_speed: as in `ceiling`.

    Returns:
        Whether the hand was seen, and whether it could be seen from any head posture, each of shape (n,).
    """
    body = vantages.body
    alone = MujocoBody(body.anatomy, body.motion, head_speed=head_speed)
    reading = alone.reset()
    hits, possible = np.zeros(len(arms), np.bool_), np.zeros(len(arms), np.bool_)
    for k, arm in enumerate(arms):
        seen, target = vantages.seeing(arm), reading.head_command
        possible[k] = seen.any()
        if possible[k]:
            value = vantages.robustness(seen)
            best = vantages.heads[value == value.max()]
            target = best[(np.abs(best - reading.head) / body.head.velocity).max(axis=1).argmin()]
        if k == 0:
            for _ in range(_frames_across(alone, head_speed)):
                reading = alone.step(reading.arm_command, target)
        hits[k] = vantages.eye.find(body.view(arm, reading.head)) is not None
        reading = alone.step(reading.arm_command, target)
    alone.close()
    return hits, possible


def _frames_across(body: MujocoBody, head_speed: float | None) -> int:
    """Frames in which the head gets from anywhere to anywhere and comes to rest."""
    speed = np.minimum(body.head.velocity, head_speed or np.inf)
    return 15 + int(15 * ((body.head.upper - body.head.lower) / speed).sum())


def _compute(
    body: MujocoBody, arms_by_phase: list[Floats], window: int, every: int, grid: tuple[int, ...], speed: float | None
) -> dict[str, Any]:
    vantages = Vantages.of(body, grid)
    found = [reachable(vantages, arms[::every]) for arms in arms_by_phase]
    phases = []
    for seen, arms in zip(found, arms_by_phase, strict=True):
        at = np.arange(0, len(arms), every) // window
        windows = [_rate(seen[at == k]) for k in range(len(arms) // window)]
        phases.append({"rate": _rate(seen), "per_window": windows})
    reactive = [reactive_hits(vantages, arms, speed) for arms in _stretches(arms_by_phase)]
    hits, possible = ([pair[k] for pair in reactive] for k in (0, 1))
    return {
        "eye": "geometric",
        "grid": list(grid),
        "every": every,
        "rate": _rate(*found),
        "phases": phases,
        "reactive": {"rate": _rate(*hits), "ceiling_rate": _rate(*possible), "frames": sum(map(len, hits))},
    }


def _stretches(arms_by_phase: list[Floats]) -> list[Floats]:
    """The stretches of the reactive bound; the arm moves on from phase to phase, so phases do not end them."""
    arms = np.concatenate(arms_by_phase) if arms_by_phase else np.empty((0, 0))
    if len(arms) <= _STRETCHES * _STRETCH:
        return [arms] if len(arms) else []
    starts = np.linspace(0, len(arms) - _STRETCH, _STRETCHES).astype(int)
    return [arms[k : k + _STRETCH] for k in starts]


def _rate(*parts: Bools) -> float | None:
    count = sum(map(len, parts))
    return float(sum(part.sum() for part in parts) / count) if count else None


# -- the cache -------------------------------------------------------------------------------------------------------


def _fingerprint(body: MujocoBody, arms_by_phase: list[Floats], settings: tuple[object, ...]) -> str:
    """A hash of all that the result depends on: the code, the model, the settings and the trajectory."""
    model = np.empty(mujoco.mj_sizeModel(body.model), np.uint8)
    mujoco.mj_saveModel(body.model, None, model)
    digest = hashlib.sha256(model.tobytes())
    for file in (__file__, *(module.__file__ for module in (geometric, rays, frustum, occluders))):
        digest.update(Path(str(file)).read_bytes())
    digest.update(repr((body.anatomy, body.motion, body.camera, body.marker, settings)).encode())
    for arms in arms_by_phase:
        digest.update(repr(arms.shape).encode() + arms.tobytes())
    return digest.hexdigest()


def _cache_file(key: str) -> Path:
    root = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(root) / "somatopy" / "ceiling" / f"{key}.json"


def _recall(key: str) -> dict[str, Any] | None:
    try:
        kept = json.loads(_cache_file(key).read_text(encoding="utf-8"))
    except (OSError, ValueError, RuntimeError):  # RuntimeError: there is no home folder
        return None
    return kept if isinstance(kept, dict) else None


def _keep(key: str, result: dict[str, Any]) -> None:
    """Write the result, whole or not at all; without a folder to write to it is computed anew each time."""
    try:
        file = _cache_file(key)
        file.parent.mkdir(parents=True, exist_ok=True)
        part = file.with_suffix(f".{os.getpid()}")
        part.write_text(json.dumps(result), encoding="utf-8")
        part.replace(file)
    except (OSError, RuntimeError):
        return
