"""The ceiling, the share of frames in which some head posture sees the hand, and the reactive bound.

A hit rate depends on marker, camera, occlusion and babbling range, so it says little without its ceiling. The reactive
bound is the hit rate of a gaze that knows where the hand is, but not where it will go. Both are computed with the
geometric eye, and say so.
"""

from __future__ import annotations

import hashlib
import inspect
import json
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from itertools import groupby, pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_cdt

from somatopy.clock import FRAMES_PER_MINUTE, FRAMES_PER_SECOND, TEN_SECONDS, WINDOW
from somatopy.contract import Modelled
from somatopy.eyes import GeometricEye, frustum, geometric, rays
from somatopy.files import cache_folder, write_whole
from somatopy.percept import Floats, Ints, Reading

__all__ = ["EVERY", "GRIDS", "Vantages", "best_fixed_head", "ceiling", "reachable", "reactive_hits"]

#: Head postures tried along each head joint, by their number; docs/ceiling.md shows that more change little.
GRIDS = {1: (97,), 2: (97, 29), 3: (25, 15, 9)}
#: The ceiling looks at every tenth frame.
EVERY = 10

_STRETCHES, _STRETCH = 10, FRAMES_PER_MINUTE  # the reactive bound: ten stretches of one minute
_REST, _LONGEST = 1e-4, 3000  # rad in a frame that count as rest; frames after which nobody waits for it any more
_ENOUGH = 3000  # arm postures by which the best fixed head posture is chosen

#: Of a grid with so many axes, the cells that touch one.
_TOUCHING = {axes: np.ones((3,) * axes, np.bool_) for axes in GRIDS}

Bools = NDArray[np.bool_]


def ceiling(
    bodies: Sequence[Modelled],
    arms_by_phase: Sequence[Floats],
    window: int = WINDOW,
    every: int = EVERY,
    grid: tuple[int, ...] | None = None,
) -> dict[str, Any]:
    """The ceiling and the reactive bound for the arm postures of a run. Results are kept in the user's cache folder.

    The cache has an entry for each phase, so that runs with a common phase share it, and one for the reactive bound of
    the whole run.

    The reactive bound is computed on ten stretches of 900 frames, spread evenly from the start of the run to its end.
    For a run that is no longer than these together, it is computed on the whole run.

    Args:
        bodies: the robot in each phase. It differs from the one before only if a damage changes what it can see.
        arms_by_phase: for each phase the sensed arm posture in each frame, shape (frames, n_arm), rad.
        window: frames in a window.
        every: the ceiling looks at one frame out of so many.
        grid: number of head postures along each head joint; the one of `GRIDS` if None.

    Returns:
        Plain data, by key. "eye", "grid" and "every" say how it was computed. "rate" is the share of frames in which
        the hand can be seen. "phases" has for each phase its "rate", and the rates of its full windows, "per_window",
        and of its full stretches of 150 frames, "per_ten_seconds". "reactive" has the "rate" of the reactive gaze, the
        "ceiling_rate" of the same frames, and "frames", their number. A rate is None where there are no frames.
    """
    arms_by_phase, grid = [np.ascontiguousarray(arms, float) for arms in arms_by_phase], grid or _grid(bodies[0])
    made: dict[int, Vantages] = {}

    def vantages(body: Modelled) -> Vantages:
        if id(body) not in made:
            made[id(body)] = Vantages.of(body, grid)
        return made[id(body)]

    phases, found = [], []
    for body, arms in zip(bodies, arms_by_phase, strict=True):
        seen = _reachable(body, arms[::every], grid, vantages)
        stretches = {"per_window": window, "per_ten_seconds": TEN_SECONDS}
        rates = {name: _rates(seen, every, width, len(arms)) for name, width in stretches.items()}
        phases.append({"rate": _rate(seen), **rates})
        found.append(seen)
    return {
        "eye": "geometric",
        "grid": list(grid),
        "every": every,
        "rate": _rate(*found),
        "phases": phases,
        "reactive": _reactive(bodies, arms_by_phase, grid, vantages),
    }


def best_fixed_head(body: Modelled, arms: Floats, grid: tuple[int, ...] | None = None) -> Floats:
    """The head posture from which the hand is seen in most arm postures. Of several, it is the most robust one.

    Args:
        body: the robot.
        arms: arm postures, shape (n, n_arm), rad. If there are more than 3,000, only every k-th is used.
        grid: number of head postures along each head joint. With None it is that of `GRIDS`.

    Returns:
        Shape (n_head,), rad.

    Raises:
        ValueError: there are no arm postures.
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
    """A grid of head postures inside all limits, with what the geometric eye would see from each.

    Where the limits of one joint depend on another joint, the outermost postures are exactly on the limit.

    Attributes:
        body: the robot.
        eye: the geometric eye behind its camera.
        heads: the postures, shape (m, n_head), rad.
        shape: steps of the grid along each head joint.
        cells: the index of each posture in the flattened grid, shape (m,).
        framed: the same index in a grid that has one more cell at each end of each axis, shape (m,).
        cameras: pose of the camera at each posture, shape (m, 12).
        moved: poses of the occluders that move with the head, at each posture, shape (m, k, 12).
        rows: indices of those occluders, shape (k,).

    Example:
        >>> from somatopy.bodies import MujocoBody
        >>> vantages = Vantages.of(MujocoBody("nao", motion="kinematic"), shape=(25, 9))
        >>> arm = np.array([0.4, 0.0, -1.0, -0.9])
        >>> head = vantages.heads[vantages.robustness(vantages.seeing(arm)).argmax()]
        >>> vantages.eye.find(vantages.body.view(arm, head)) is not None
        True
    """

    body: Modelled
    eye: GeometricEye
    heads: Floats
    shape: tuple[int, ...]
    cells: Ints
    framed: Ints
    cameras: Floats
    moved: Floats
    rows: Ints

    @classmethod
    def of(cls, body: Modelled, shape: tuple[int, ...] | None = None) -> Vantages:
        """The head postures of a body, with `shape` steps along each head joint. With None it is that of `GRIDS`."""
        shape = shape or _grid(body)
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
            framed=np.flatnonzero(np.pad(np.bincount(cells, minlength=len(every)).reshape(shape), 1)),
            cameras=np.stack([view.camera for view in views]),
            moved=np.ascontiguousarray(poses[:, rows]),
            rows=rows,
        )

    def seeing(self, arm: Floats, first: int = -1) -> Bools:
        """Whether each head posture sees the hand at an arm posture, shape (m,); see `GeometricEye.look_from_each`."""
        view = self.body.view(arm, self.heads[0])
        return self.eye.look_from_each(self.cameras, self.moved, self.rows, view, first)

    def robustness(self, seen: Bools) -> Ints:
        """Distance of each head posture from the nearest one that does not see the hand, in grid steps, shape (m,).

        It is 0 for postures that do not see the hand. Postures beyond the limits count as postures that do not.
        """
        grid = np.zeros([n + 2 for n in self.shape], np.int32)
        grid.ravel()[self.framed] = seen
        return np.asarray(distance_transform_cdt(grid, metric=_TOUCHING[grid.ndim]).ravel()[self.framed], np.int64)


def reachable(vantages: Vantages, arms: Floats) -> Bools:
    """Whether the hand can be seen from any head posture, for each arm posture. The mean is the ceiling.

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


def reactive_hits(vantages: Vantages, arms: Floats) -> tuple[Bools, Bools]:
    """The hits of a gaze that knows perfectly where the hand is, but not where it will go.

    In each frame it aims at the most robust of the head postures that see the hand where it is now. Of several it takes
    the nearest one. The head moves as the body's does: at its speed, within all limits and with the lag of its servos.

    Args:
        vantages: the head postures to choose from.
        arms: the arm posture in consecutive frames, shape (n, n_arm), rad.

    Returns:
        Whether the hand was seen, and whether it could be seen from any head posture, each of shape (n,).
    """
    body = vantages.body
    alone = body.another()
    try:
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
                reading = _settled(alone, reading, target)
            hits[k] = vantages.eye.find(body.view(arm, reading.head)) is not None
            reading = alone.step(reading.arm_command, target)
    finally:
        alone.close()
    return hits, possible


def _settled(body: Any, reading: Reading, target: Floats) -> Reading:
    """What the body senses once its head has come to rest at a target: a second without any movement."""
    still = 0
    for _ in range(_LONGEST):
        before, reading = reading, body.step(reading.arm_command, target)
        still = still + 1 if np.abs(reading.head - before.head).max() < _REST else 0
        if still == FRAMES_PER_SECOND:
            break
    return reading


_VantagesOf = Callable[[Modelled], Vantages]


def _reachable(body: Modelled, arms: Floats, grid: tuple[int, ...], vantages: _VantagesOf) -> Bools:
    """What `reachable` says of a phase, looked up if it is kept."""

    def compute() -> dict[str, Any]:
        return {"seen": "".join("01"[seen] for seen in reachable(vantages(body), arms).tolist())}

    kept = _kept(_fingerprint([body], [arms], ("reachable", grid)), compute)
    return np.asarray(np.frombuffer(kept["seen"].encode(), np.uint8) == ord("1"))


def _reactive(
    bodies: Sequence[Modelled], arms_by_phase: list[Floats], grid: tuple[int, ...], vantages: _VantagesOf
) -> dict[str, Any]:
    """Rate of the reactive gaze over a run's stretches, looked up if it is kept."""

    def compute() -> dict[str, Any]:
        by_phase = [vantages(body) for body in bodies]
        pairs = [reactive_hits(*stretch) for stretch in _stretches(by_phase, arms_by_phase)]
        hits, possible = ([pair[k] for pair in pairs] for k in (0, 1))
        return {"rate": _rate(*hits), "ceiling_rate": _rate(*possible), "frames": sum(map(len, hits))}

    return _kept(_fingerprint(bodies, arms_by_phase, ("reactive", grid)), compute)


def _stretches(by_phase: Sequence[Vantages], arms_by_phase: list[Floats]) -> Iterator[tuple[Vantages, Floats]]:
    """The stretches of the reactive bound. The arm moves on from phase to phase: only another body ends a stretch."""
    owners = np.repeat(np.arange(len(by_phase)), [len(arms) for arms in arms_by_phase]).tolist()
    arms = np.concatenate(arms_by_phase) if len(owners) else np.empty((0, 0))
    starts = [0]
    length = len(arms)
    if len(arms) > _STRETCHES * _STRETCH:
        starts, length = np.linspace(0, len(arms) - _STRETCH, _STRETCHES).astype(int).tolist(), _STRETCH
    for start in starts:
        frames = range(start, min(start + length, len(arms)))
        for _, group in groupby(frames, lambda frame: id(by_phase[owners[frame]])):
            same = list(group)
            yield by_phase[owners[same[0]]], arms[same[0] : same[-1] + 1]


def _grid(body: Modelled) -> tuple[int, ...]:
    joints = len(body.head)
    if joints not in GRIDS:
        raise ValueError(f"A ceiling is computed for heads of {', '.join(map(str, GRIDS))} joints, not of {joints}.")
    return GRIDS[joints]


def _rates(seen: Bools, every: int, width: int, frames: int) -> list[float | None]:
    """The rates of consecutive stretches of `width` frames, where every `every`-th frame was looked at."""
    starts = -(-np.arange(frames // width + 1) * width // every)
    return [_rate(seen[start:stop]) for start, stop in pairwise(starts.tolist())]


def _rate(*parts: Bools) -> float | None:
    count = sum(map(len, parts))
    return float(sum(part.sum() for part in parts) / count) if count else None


# -- the cache -------------------------------------------------------------------------------------------------------


def _fingerprint(bodies: Sequence[Modelled], arms_by_phase: list[Floats], settings: tuple[object, ...]) -> str:
    """A hash of all that the result depends on: the code, the bodies, the settings and the trajectory."""
    digest = hashlib.sha256(repr(settings).encode())
    for file in (__file__, *(module.__file__ for module in (geometric, rays, frustum)), *_sources(bodies)):
        digest.update(Path(str(file)).read_bytes())
    for body in bodies:
        digest.update(repr((body.camera, body.marker)).encode() + body.fingerprint())
    for arms in arms_by_phase:
        digest.update(repr(arms.shape).encode() + arms.tobytes())
    return digest.hexdigest()


def _sources(bodies: Sequence[Modelled]) -> list[Path]:
    """The files that say how these bodies move and where their parts are."""
    found: set[Path] = set()
    for body in bodies:
        with suppress(OSError, TypeError):  # TypeError: a class without a file, as of an interactive session
            file = Path(inspect.getfile(type(body)))
            ours = type(body).__module__.startswith("somatopy.")
            found.update(file.parent.glob("*.py") if ours else [file])
    return sorted(found)


def _kept(key: str, compute: Callable[[], dict[str, Any]]) -> dict[str, Any]:
    """What stands under a key; computed and written there if nothing readable does."""
    folder = cache_folder("ceiling")
    with suppress(OSError, ValueError):
        kept = json.loads((folder / f"{key}.json").read_text(encoding="utf-8")) if folder else None
        if isinstance(kept, dict):
            return kept
    result = compute()
    _keep(key, result)
    return result


def _keep(key: str, result: dict[str, Any]) -> None:
    """Write the result; without a folder to write to it is computed anew each time."""
    folder = cache_folder("ceiling")
    with suppress(OSError):
        if folder:
            folder.mkdir(parents=True, exist_ok=True)
            write_whole(folder / f"{key}.json", json.dumps(result))
