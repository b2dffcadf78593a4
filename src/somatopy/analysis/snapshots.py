"""Maps and links as they stood at the end of a window: maps/window-*.npz."""

from __future__ import annotations

import os
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from somatopy.analysis.runs import Run, RunFolderError
from somatopy.percept import Floats

__all__ = ["OtherArrays", "Snapshot", "load_snapshot", "paper_snapshot"]

Indices = NDArray[np.int64]


class OtherArrays(RunFolderError):
    """A snapshot of a learner whose arrays are its own: not two sheets of units with links between them."""


@dataclass(frozen=True)
class Snapshot:
    """Both maps and the links between them.

    Attributes:
        frame: frames learned so far.
        arm_codebook: shape (units, n_arm), in [0, 1] of the joint limits; damage may carry units outside.
        head_codebook: shape (units, n_head), likewise.
        arm_shape: the arm map's lattice, (rows, columns).
        head_shape: the head map's.
        arm_limits: shape (n_arm, 2), rad.
        head_limits: shape (n_head, 2), rad.
        link_pre: arm unit of each link that is not 0, shape (links,).
        link_post: head unit of each.
        link_weight: weight of each.

    Example:
        >>> unit, limits = np.zeros((2, 1)), np.array([[-1.0, 1.0]])
        >>> maps = Snapshot(9, unit, unit, (2, 1), (2, 1), limits, limits, *np.array([[0, 1, 1], [1, 0, 1], [4, 2, 3]]))
        >>> maps.gaze_links()
        (array([0, 1]), array([1, 1]), array([4, 3]))
        >>> maps.arm_postures().ravel()
        array([-1., -1.])
    """

    frame: int
    arm_codebook: Floats
    head_codebook: Floats
    arm_shape: tuple[int, int]
    head_shape: tuple[int, int]
    arm_limits: Floats
    head_limits: Floats
    link_pre: Indices
    link_post: Indices
    link_weight: Floats

    def arm_postures(self) -> Floats:
        """The arm units as postures, shape (units, n_arm), rad."""
        return _postures(self.arm_codebook, self.arm_limits)

    def head_postures(self) -> Floats:
        """The head units as postures, shape (units, n_head), rad."""
        return _postures(self.head_codebook, self.head_limits)

    def gaze_links(self) -> tuple[Indices, Indices, Floats]:
        """The strongest link of every arm unit that has one, the strongest first: those that move the head.

        Returns:
            Arm units, head units, weights.
        """
        order = np.lexsort((self.link_post, self.link_pre, -self.link_weight))
        units, first = np.unique(self.link_pre[order], return_index=True)
        found = order[np.sort(first)]
        assert len(found) == len(units)
        return self.link_pre[found], self.link_post[found], self.link_weight[found]


def load_snapshot(path: str | os.PathLike[str]) -> Snapshot:
    """Read a maps/window-*.npz.

    Raises:
        OtherArrays: it does not hold both maps and the links between them.
        RunFolderError: the file is damaged.
    """
    try:
        with np.load(Path(path), allow_pickle=False) as arrays:
            found = {field.name: arrays[field.name] for field in fields(Snapshot)}
    except KeyError as error:
        raise OtherArrays(f"{path} lacks an array: {error}. Is it a snapshot of maps and links?") from error
    except Exception as error:  # a damaged archive raises errors of a dozen kinds
        why = "it holds no plain arrays" if isinstance(error, ValueError) else error
        raise RunFolderError(f"{path} is damaged ({why}). Delete it, or run the experiment again.") from error
    if why := _no_sheets(found):
        raise OtherArrays(f"{path} does not hold two sheets of units and the links between them: {why}.")
    found["frame"] = int(found["frame"])
    for name in ("arm_shape", "head_shape"):
        found[name] = tuple(int(n) for n in found[name])
    return Snapshot(**found)


def paper_snapshot(run: Run, path: Path) -> Snapshot | None:
    """A snapshot of a run, or None where its arrays are not the paper's maps over the run's arm and head.

    Raises:
        RunFolderError: the file is damaged.
    """
    try:
        maps = load_snapshot(path)
    except OtherArrays:
        return None
    fits = [len(run.joints(side)) == len(limits) for side, limits in _limits(maps)]
    return maps if all(fits) else None


def _limits(maps: Snapshot) -> tuple[tuple[str, Floats], ...]:
    return ("arm", maps.arm_limits), ("head", maps.head_limits)


def _no_sheets(found: dict[str, NDArray[Any]]) -> str:
    """What keeps arrays with the names of the paper's from being what these are; "" if nothing does."""
    if words := [name for name, array in found.items() if array.dtype.kind not in "biuf"]:
        return f"{words[0]} holds no numbers"
    if found["frame"].ndim:
        return "frame is no number"
    for side, links in (("arm", "link_pre"), ("head", "link_post")):
        codebook, shape, limits = (found[f"{side}_{name}"] for name in ("codebook", "shape", "limits"))
        if shape.shape != (2,) or codebook.ndim != 2 or len(codebook) != shape.prod():
            return f"{side}_codebook has shape {codebook.shape}, {side}_shape says {shape.tolist()}"
        if limits.shape != (codebook.shape[1], 2):
            return f"{side}_limits has shape {limits.shape}, the units have {codebook.shape[1]} values"
        named = np.isin(found[links], np.arange(len(codebook)))
        if named.shape != found["link_weight"].shape or not named.all():
            return f"{links} names units that are not there"
    return ""


def _postures(codebook: Floats, limits: Floats) -> Floats:
    postures: Floats = limits[:, 0] + codebook * (limits[:, 1] - limits[:, 0])
    return postures
