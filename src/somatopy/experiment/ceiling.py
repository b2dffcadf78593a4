"""What was possible: the share of frames in which any head posture sees the hand, and the bound without look-ahead.

A hit rate says nothing without its ceiling: it depends on marker, camera, occlusion and babbling range. Both bounds
come from the geometric eye and are labelled so.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter

from somatopy.bodies import MujocoBody
from somatopy.eyes import GeometricEye
from somatopy.percept import Floats, Ints

__all__ = ["EVERY", "GRID", "Vantages", "reachable", "reactive_hits"]

#: Head postures tried along each head joint; docs/ceiling.md shows that more change little.
GRID = (97, 29)
#: The ceiling looks at every tenth frame.
EVERY = 10

Bools = NDArray[np.bool_]


@dataclass(frozen=True)
class Vantages:
    """All head postures of a grid inside the limits, coupled ones included, and what the eye would see from each.

    Attributes:
        heads: the postures, shape (m, n_head), rad.
        shape: steps of the grid along each head joint.
        cells: where each posture stands in the grid, shape (m,).
        cameras: the camera's pose at each, shape (m, 12).
        moved: poses there of the occluders that move with the head, shape (m, k, 12).
        rows: which occluders those are, shape (k,).
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
        legal = np.flatnonzero([body.allows(head) for head in every])
        views = [body.view(body.arm.lower, head) for head in every[legal]]
        poses = np.stack([view.occluders for view in views])
        rows = np.flatnonzero((poses != poses[0]).any(axis=(0, 2)))
        return cls(
            body=body,
            eye=GeometricEye(body.camera, body.marker, body.occluders),
            heads=every[legal],
            shape=shape,
            cells=legal,
            cameras=np.stack([view.camera for view in views]),
            moved=np.ascontiguousarray(poses[:, rows]),
            rows=rows,
        )

    def seeing(self, arm: Floats, first: int = -1) -> Bools:
        """Which of the head postures see the hand at this arm posture, (m,); see `GeometricEye.look_from_each`."""
        view = self.body.view(arm, self.heads[0])
        return self.eye.look_from_each(self.cameras, self.moved, self.rows, view, first)

    def robustness(self, seen: Bools) -> Floats:
        """How many of its neighbours within two steps see the hand too, for those that see it, else -1; shape (m,)."""
        grid = np.zeros(self.shape)
        grid.flat[self.cells] = seen
        return np.where(seen, uniform_filter(grid, size=5, mode="constant").flat[self.cells], -1.0)


def reachable(vantages: Vantages, arms: Floats) -> Bools:
    """Whether the hand can be seen at all: the ceiling is the mean.

    Args:
        vantages: the head postures to try.
        arms: arm postures, shape (n, n_arm), rad.

    Returns:
        Shape (n,).
    """
    first, found = 0, np.empty(len(arms), np.bool_)
    for k, arm in enumerate(arms):
        seen = vantages.seeing(arm, first)
        found[k] = seen.any()
        if found[k]:
            first = int(seen.argmax())
    return found


def reactive_hits(vantages: Vantages, stretches: Iterator[Floats], stride: Floats) -> Iterator[Bools]:
    """What a gaze with perfect knowledge but no look-ahead hits: in each frame it heads for the most robust view.

    Args:
        vantages: the head postures to choose from.
        stretches: consecutive arm postures, each of shape (n, n_arm), rad.
        stride: how far each head joint gets in a frame, shape (n_head,), rad.

    Yields:
        For each stretch whether the hand was seen, shape (n,).
    """
    for arms in stretches:
        seen = vantages.seeing(arms[0])
        head = vantages.heads[int(vantages.robustness(seen).argmax())]
        hits = np.zeros(len(arms), np.bool_)
        for k, arm in enumerate(arms):
            view = vantages.body.view(arm, head)
            hits[k] = vantages.eye.find(view) is not None
            seen = vantages.seeing(arm)
            if seen.any():
                value = vantages.robustness(seen)
                near = np.abs(vantages.heads - head).max(axis=1)
                target = vantages.heads[np.lexsort((near, -value))[0]]
                head = head + np.clip(target - head, -stride, stride)
        yield hits


def best_fixed_head(body: MujocoBody, arms: Floats) -> Floats:
    """The head posture that sees the hand at most of these arm postures, (n, n_arm), rad."""
    vantages = Vantages.of(body)
    counts = sum((vantages.seeing(arm).astype(int) for arm in arms), np.zeros(len(vantages.heads), int))
    return vantages.heads[int(counts.argmax())]


def ceiling(body: MujocoBody, arms_by_phase: list[Floats], window: int = 4500) -> dict[str, object]:
    """The ceiling of a trajectory, as plain data."""
    vantages = Vantages.of(body)
    found = [reachable(vantages, arms[::EVERY]) for arms in arms_by_phase]
    step = window // EVERY
    return {
        "eye": "geometric",
        "grid": list(GRID),
        "every": EVERY,
        "rate": float(np.concatenate(found).mean()) if sum(map(len, found)) else None,
        "phases": [
            {
                "rate": float(f.mean()) if len(f) else None,
                "per_window": [float(f[k * step : (k + 1) * step].mean()) for k in range(len(a) // window)],
            }
            for f, a in zip(found, arms_by_phase, strict=True)
        ],
        "reactive": {"rate": None, "ceiling_rate": None, "frames": 0},
    }
