"""What could be seen and what was believed: sight.npz and belief.npz of a run folder, read with care."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from somatopy.analysis.bounds import why_no_ceiling
from somatopy.analysis.runs import Run, RunFolderError
from somatopy.percept import Floats, Ints

__all__ = ["AGES", "GAZES", "Beliefs", "Sight", "ages", "beliefs_of", "sight_of", "why_no_sight"]

#: Least of each class of misses: gazes from which the hand can be seen, and frames since it could not be seen.
GAZES, AGES = (0, 1, 5, 15, 50, 150), (0, 2, 4, 8, 16)
BELIEF, SIGHT = "belief.npz", "sight.npz"
#: Beliefs are kept in 255ths and rounded down: more than this is more than one half.
HALF = 127

Bools = NDArray[np.bool_]


@dataclass(frozen=True)
class Beliefs:
    """What a learner believed at arm postures that it never met, and what is true there.

    Attributes:
        arms: the arm postures, shape (k, n_arm), rad.
        heads: the gazes of a grid that the head can take, shape (m, n_head), rad.
        shape: steps of the grid along each head joint.
        cells: where each gaze stands in the grid, shape (m,).
        limits: low and high of each head joint, shape (n_head, 2), rad.
        frame: frames done when the learner was asked, shape (t,).
        phase: the phase of the last of them, shape (t,).
        gaze: where it would have looked, shape (t, k, n_head), rad.
        belief: in 255ths, shape (t, k, m), or (t, k, 0) of a learner that does not say.
        seen: whether each gaze sees the hand in each phase, shape (phases, k, m).
    """

    arms: Floats
    heads: Floats
    shape: tuple[int, ...]
    cells: Ints
    limits: Floats
    frame: Ints
    phase: Ints
    gaze: Floats
    belief: NDArray[np.uint8]
    seen: Bools

    @property
    def told(self) -> bool:
        """Whether the learner says what it believes."""
        return bool(self.belief.shape[2])

    def agreement(self) -> tuple[Floats, Floats]:
        """Shares of gazes of which it believes what is true, over all postures, each of shape (t,).

        Returns:
            Of the gazes that see the hand those of which it believes so, and of the others likewise. The mean of the
            two is the balanced accuracy. NaN where there are no such gazes.

        Example:
            >>> seen, belief = np.array([[[True, True, False]]]), np.array([[[255, 0, 0]]], np.uint8)
            >>> none = np.empty((1, 1))
            >>> Beliefs(none, none, (3,), none, none, none, np.array([0]), none, belief, seen).agreement()
            (array([0.5]), array([1.]))
        """
        truth, believed = self.seen[self.phase], self.belief > HALF
        return _share(truth & believed, truth), _share(~truth & ~believed, ~truth)


@dataclass(frozen=True)
class Sight:
    """From how many gazes the hand could be seen, in stretches of consecutive frames, and whether it was missed.

    Attributes:
        frame: numbers of the frames, shape (n,).
        stretch: to which stretch each belongs, shape (n,).
        gazes: from how many head postures of the grid the hand can be seen, shape (n,).
        grid: how many head postures the grid has.
        phase: the phase of each frame, shape (n,).
        missed: whether the hand was not seen, shape (n,).
    """

    frame: Ints
    stretch: Ints
    gazes: Ints
    grid: int
    phase: Ints
    missed: Bools

    def by_gazes(self, phase: int) -> Floats:
        """Misses in the classes of `GAZES`, as shares of the frames in which the hand can be seen, shape (6,)."""
        there = self.phase == phase
        kind = np.searchsorted(GAZES, self.gazes[there & self.missed], side="right") - 1
        visible = max(int((there & (self.gazes > 0)).sum()), 1)
        return np.asarray(np.bincount(kind, minlength=len(GAZES)) / visible)

    def by_age(self, phase: int) -> tuple[Floats, Ints]:
        """Share of frames that are missed in the classes of `AGES`, NaN without any; how many frames; both (5,)."""
        age = ages(self.gazes > 0, self.stretch)
        there = (self.phase == phase) & (age >= 0)
        kind = np.searchsorted(AGES, age, side="right") - 1
        frames, misses = (np.bincount(kind[where], minlength=len(AGES)) for where in (there, there & self.missed))
        return np.where(frames > 0, misses / np.maximum(frames, 1), np.nan), frames


def ages(visible: Bools, stretch: Ints) -> Ints:
    """For how many frames the hand has been visible, 0 in the first of them; -1 where it is not, or nobody knows.

    How long it has been visible when a stretch begins is not known: the first frames do not count, until it has not
    been visible once, or for the oldest class.

    Args:
        visible: whether the hand can be seen, shape (n,).
        stretch: to which stretch of consecutive frames each belongs, rising, shape (n,).

    Example:
        >>> ages(np.array([1, 0, 1, 1, 0, 1], bool), np.array([0, 0, 0, 0, 0, 1]))
        array([-1, -1,  0,  1, -1, -1])
    """
    at = np.arange(len(visible))
    begins = np.searchsorted(stretch, stretch)
    hidden = np.maximum.accumulate(np.where(visible, -1, at))
    known = hidden >= begins
    age = np.where(known, at - hidden - 1, at - begins)
    return np.where(visible & (known | (age >= AGES[-1])), age, -1)


def beliefs_of(run: Run) -> Beliefs | None:
    """What the learner believed; None where it was not asked, or where the truth is not known (yet).

    Raises:
        RunFolderError: a file is damaged, or the files do not belong together.
    """
    asked, sight = _arrays(run, BELIEF), _arrays(run, SIGHT)
    if asked is None or sight is None or "seen" not in sight:
        return None
    try:
        found = {field.name: asked[field.name] for field in fields(Beliefs) if field.name != "seen"}
        shape = tuple(int(n) for n in found.pop("shape"))
        beliefs = Beliefs(**found, shape=shape, seen=sight["seen"])
        postures, gazes = len(beliefs.arms), len(beliefs.heads)
        fits = beliefs.seen.shape[1:] == (postures, gazes) and beliefs.belief.shape[2] in (0, gazes)
        if not fits or (beliefs.phase >= len(beliefs.seen)).any():
            raise ValueError(f"what it holds does not fit {SIGHT}")
    except (KeyError, ValueError) as error:
        raise _unusable(run.path / BELIEF, error) from error
    return beliefs


def sight_of(run: Run) -> Sight | None:
    """From how many gazes the hand could be seen, with what was missed; None where nobody looked.

    Raises:
        RunFolderError: the file is damaged, or is of another run.
    """
    found = _arrays(run, SIGHT)
    if found is None:
        return None
    try:
        frame, hit, phase = found["frame"], run.values("hit").astype(bool), run.values("phase")
        if frame.size and frame.max() >= len(hit):
            raise ValueError(f"it tells of frame {frame.max()}, and the run has {len(hit)}")
        return Sight(frame, found["stretch"], found["gazes"], int(found["grid"]), phase[frame], ~hit[frame])
    except (KeyError, ValueError) as error:
        raise _unusable(run.path / SIGHT, error) from error


def why_no_sight(run: Run, summary: Mapping[str, Any]) -> str:
    """One sentence that says why nothing is told of what the learner knows and could see; "" where it is told.

    Args:
        run: an open run folder.
        summary: its summary.
    """
    if (run.path / SIGHT).is_file():
        return ""
    if reason := why_no_ceiling(run, summary).partition(", because ")[2]:
        return f"What the learner knows, and what it misses, is not shown, because {reason}"
    return (
        f"What the learner knows, and what it misses, is not shown, because {SIGHT} is missing; a run with maps has it."
    )


def _share(some: Bools, all_of_them: Bools) -> Floats:
    some_of, count = some.sum(axis=(1, 2)), all_of_them.sum(axis=(1, 2))
    return np.where(count > 0, some_of / np.maximum(count, 1), np.nan)


def _arrays(run: Run, name: str) -> dict[str, NDArray[Any]] | None:
    path = run.path / name
    if not path.is_file():
        return None
    try:
        with np.load(path, allow_pickle=False) as file:
            return dict(file)
    except Exception as error:  # a damaged archive raises errors of a dozen kinds
        why = "it holds no plain arrays" if isinstance(error, ValueError) else error
        raise RunFolderError(f"{path} is damaged ({why}). Delete it, or run the experiment again.") from error


def _unusable(path: Path, error: Exception) -> RunFolderError:
    what = f"lacks {error}" if isinstance(error, KeyError) else f"cannot be used ({error})"
    return RunFolderError(f"{path} {what}. Delete it, or run the experiment again.")
