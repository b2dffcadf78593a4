"""Records from which gazes the hand could be seen: the file sight.npz of a run folder.

The ceiling says how often the hand can be seen at all. For stretches of consecutive frames, this file says from how
many gazes it can be seen. For the arm postures of belief.npz, it says from which gazes.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from somatopy.contract import Modelled
from somatopy.experiment.belief import BELIEF, coarse
from somatopy.experiment.ceiling import Vantages
from somatopy.files import write_whole
from somatopy.percept import Floats, Ints

__all__ = ["SIGHT", "STRETCH", "STRETCHES", "counted", "stretches", "write_sight"]

#: The file's name.
SIGHT = "sight.npz"
#: Stretches of consecutive frames in a phase, and frames in each.
STRETCHES, STRETCH = 10, 300


def write_sight(folder: Path, bodies: Sequence[Modelled], arms_by_phase: Sequence[Floats]) -> None:
    """Write what could be seen in a run.

    The file holds these arrays. `frame` has numbers of frames of the run, shape (n,). They come from the first and the
    last phase that have frames. `stretch` says to which stretch of consecutive frames each belongs, shape (n,). `gazes`
    says from how many head postures of the ceiling's grid the hand can be seen in it, shape (n,), and `grid` is the
    number of head postures in that grid. If the run has a belief.npz, `seen` says for each phase whether each of its
    gazes sees the hand at each of its arm postures, shape (phases, k, m).

    Args:
        folder: the run folder.
        bodies: the robot in each phase, as `ceiling` takes it.
        arms_by_phase: for each phase the sensed arm posture in each frame, shape (frames, n_arm), rad.
    """
    starts = np.cumsum([0, *map(len, arms_by_phase)])
    played = [k for k, arms in enumerate(arms_by_phase) if len(arms)]
    frames, gazes, sizes = [np.empty(0, np.int64)], [np.empty(0, np.int64)], [0]
    made: dict[int, Vantages] = {}
    for k in dict.fromkeys(played[:1] + played[-1:]):
        vantages = made.setdefault(id(bodies[k]), Vantages.of(bodies[k]))
        for part in stretches(len(arms_by_phase[k])):
            frames.append(starts[k] + part)
            gazes.append(counted(vantages, arms_by_phase[k][part]))
            sizes.append(len(part))
    found: dict[str, NDArray[Any]] = {
        "frame": np.concatenate(frames),
        "stretch": np.repeat(np.arange(len(sizes)), sizes),
        "gazes": np.concatenate(gazes),
        "grid": np.array(max((len(vantages.heads) for vantages in made.values()), default=0)),
    }
    if (folder / BELIEF).exists():
        with np.load(folder / BELIEF, allow_pickle=False) as asked:
            found["seen"] = _seen(bodies, asked["arms"])
    write_whole(folder / SIGHT, lambda file: np.savez_compressed(file, allow_pickle=False, **found))


def stretches(frames: int) -> list[Ints]:
    """Ten stretches of 20 seconds in a phase, evenly spread. A phase that is not longer is one stretch.

    Example:
        >>> [(int(part[0]), int(part[-1])) for part in stretches(10_000)][:2], len(stretches(10_000))
        ([(0, 299), (1077, 1376)], 10)
        >>> [len(part) for part in stretches(3000)]
        [3000]
    """
    if frames <= STRETCHES * STRETCH:
        return [np.arange(frames)]
    return [np.arange(start, start + STRETCH) for start in np.linspace(0, frames - STRETCH, STRETCHES).astype(int)]


def counted(vantages: Vantages, arms: Floats) -> Ints:
    """Number of head postures that see the hand, for each arm posture, shape (n,).

    Args:
        vantages: the head postures.
        arms: arm postures, shape (n, n_arm), rad.
    """
    return np.array([vantages.seeing(arm).sum() for arm in arms], np.int64)


def _seen(bodies: Sequence[Modelled], arms: Floats) -> NDArray[np.bool_]:
    """Whether each gaze sees the hand at each arm posture with the body of each phase, shape (phases, k, m)."""
    made = {id(body): [coarse(body).seeing(arm) for arm in arms] for body in {id(b): b for b in bodies}.values()}
    return np.array([made[id(body)] for body in bodies], np.bool_)
