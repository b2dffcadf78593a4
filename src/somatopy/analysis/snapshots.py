"""Maps and links as they stood at the end of a window: maps/window-*.npz."""

from __future__ import annotations

import os
from dataclasses import dataclass, fields
from pathlib import Path
from zipfile import BadZipFile

import numpy as np
from numpy.typing import NDArray

from somatopy.analysis.runs import RunFolderError
from somatopy.percept import Floats

__all__ = ["Snapshot", "load_snapshot"]

Indices = NDArray[np.int64]


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
        RunFolderError: the file is damaged, or lacks an array.
    """
    try:
        with np.load(Path(path), allow_pickle=False) as arrays:
            found = {field.name: arrays[field.name] for field in fields(Snapshot)}
    except KeyError as error:
        raise RunFolderError(f"{path} lacks an array: {error}. Is it a snapshot of maps and links?") from error
    except (OSError, EOFError, ValueError, BadZipFile) as error:
        raise RunFolderError(f"{path} is damaged ({error}). Delete it, or run the experiment again.") from error
    found["frame"] = int(found["frame"])
    for name in ("arm_shape", "head_shape"):
        found[name] = tuple(int(n) for n in found[name])
    return Snapshot(**found)


def _postures(codebook: Floats, limits: Floats) -> Floats:
    postures: Floats = limits[:, 0] + codebook * (limits[:, 1] - limits[:, 0])
    return postures
