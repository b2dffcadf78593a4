"""A frame of the paper's learner in two compiled calls where its maps are two DSOMs: the same bits in half the time.

No equation stands here: maps learn by `learn_dsom`, and the strongest link is found by `strongest_link`. What is spared
is the way from Python to each of these and back.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from somatopy._jit import jit
from somatopy.links.table import strongest_link
from somatopy.maps.dsom import learn_dsom
from somatopy.maps.kernels import all_usable
from somatopy.percept import Floats

__all__ = ["learn_both", "posture_of_strongest"]


@jit
def learn_both(
    postures: Floats, low: Floats, span: Floats, joints: int, arm: tuple[Any, ...], head: tuple[Any, ...]
) -> tuple[int, float, int, float]:
    """Let the arm map learn the arm's posture and the head map the head's, and find the winners afterwards.

    Args:
        postures: of the arm, then of the head, shape (n,), rad.
        low: what is 0 to the maps, shape (n,), rad.
        span: from there to what is 1, shape (n,), rad.
        joints: how many of these are the arm's.
        arm: what `DSOM.for_kernel` gives of the arm map.
        head: the same of the head map.

    Returns:
        Winner in the arm map and its distance, winner in the head map and its distance; -1, and nothing has changed,
        if a posture is not usable.
    """
    units = (postures - low) / span
    x, y = units[:joints].reshape((1, joints)), units[joints:].reshape((1, units.size - joints))
    if not (all_usable(x, arm[2]) and all_usable(y, False)):
        return -1, 0.0, -1, 0.0
    _, i, arm_distance = learn_dsom(arm[0], arm[1], arm[2], arm[3], arm[4], x, arm[5], True)
    _, j, head_distance = learn_dsom(head[0], head[1], head[2], head[3], head[4], y, head[5], True)
    return i, arm_distance, j, head_distance


@jit
def posture_of_strongest(
    links: Floats, i: int, u: float, codes: NDArray[Any], columns: int, low: Floats, span: Floats
) -> Floats:
    """The posture, shape (n,), rad, of the head node with the greatest link from arm node i; see `strongest_link`.

    Args:
        links: all links, shape (n_pre, n_post).
        i: the arm node.
        u: chooses among equal ones, in [0, 1).
        codes: the head map's, laid out for kernels.
        columns: its units in a row.
        low: as in `learn_both`, of the head alone.
        span: see there.
    """
    j = strongest_link(links, i, u)
    posture = np.empty(low.size)
    for k in range(low.size):
        posture[k] = low[k] + codes[k, j // columns, j % columns] * span[k]
    return posture
