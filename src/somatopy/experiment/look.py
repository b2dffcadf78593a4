"""Finds out before an experiment whether, how often and from where a robot can see its hand, with the geometric eye."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from itertools import product

import numpy as np

from somatopy.contract import Modelled, Twin
from somatopy.experiment.ceiling import Vantages
from somatopy.experiment.context import Context, stream
from somatopy.experiment.description import DescriptionError
from somatopy.eyes import FiducialEye, GeometricEye
from somatopy.eyes.geometric import MIN_HEIGHT
from somatopy.percept import Floats, Ints, Shapes, View
from somatopy.registry import HANDED_OVER

__all__ = ["Outlook", "confined", "outlook", "require_sight", "why_unseen"]

#: Head postures tried along each joint at the first glance, by their number.
_COARSE = {1: 17, 2: 7, 3: 5}
_GLANCES = 100  # arm postures of the first glance
_DRAWN, _TRIED = 240, 48  # arm postures from which a confined range grows, and in each range that is tried
_SHARES = (1.0, 0.7, 0.5, 0.35, 0.25, 0.15)  # of the joints' limits, widths of ranges tried
_WIDEST = 2.0  # rad
_OFTEN = 0.8  # share of a range's postures in which the hand shall be visible
_SLACK = 1e-3  # of a joint's range, that a confined one keeps from its limits


@dataclass(frozen=True)
class Outlook:
    """What can be seen at some arm postures.

    Attributes:
        rate: share of the arm postures at which some head posture sees the hand.
        fixed_rate: share of the arm postures at which the best single head posture sees it.
        fixed_head: this best head posture, shape (n_head,), rad.
        seen: number of head postures that see the hand, for each arm posture, shape (n,).
        heads: the head posture that sees the hand most robustly, for each arm posture, shape (n, n_head), rad. It is
            arbitrary where no head posture sees the hand.
    """

    rate: float
    fixed_rate: float
    fixed_head: Floats
    seen: Ints
    heads: Floats


def outlook(vantages: Vantages, arms: Floats) -> Outlook:
    """Find out what can be seen at some arm postures, shape (n, n_arm), rad.

    Example:
        >>> from somatopy.bodies import MujocoBody
        >>> vantages = Vantages.of(MujocoBody("nao", motion="kinematic"), shape=(25, 9))
        >>> found = outlook(vantages, np.array([[0.4, 0.0, -1.0, -0.9], [2.0, 0.0, -1.0, -0.1]]))
        >>> found.rate, found.fixed_rate
        (0.5, 0.5)
    """
    each = np.array([vantages.seeing(arm) for arm in arms])
    counts = each.sum(axis=0)
    best = int(vantages.robustness(counts == counts.max()).argmax())
    places = [int(vantages.robustness(seen).argmax()) for seen in each]
    return Outlook(
        rate=float(each.any(axis=1).mean()),
        fixed_rate=float(each[:, best].mean()),
        fixed_head=np.array(vantages.heads[best]),
        seen=each.sum(axis=1),
        heads=vantages.heads[places],
    )


def require_sight(context: Context, eye: object) -> None:
    """Refuse an experiment in which the hand can never be seen while the arm babbles.

    This is checked only for bodies with a model of themselves, and only for eyes that look for the cube of tags. The
    arm postures come from a random stream of their own.

    Raises:
        DescriptionError: the hand cannot be seen.
    """
    body = context.body
    if not (isinstance(body, Twin) and isinstance(eye, GeometricEye | FiducialEye)):
        return
    low, high = _bounds(context).T
    arms = stream(context.description.seed, "look").uniform(low, high, (2 * _GLANCES, len(low)))
    if _glimpsed(body, arms[:_GLANCES]) or _found(body, arms):
        return
    babbling = context.description.babbling
    if not babbling.kind.startswith(HANDED_OVER) and _found(body, context.babbled(_GLANCES)):
        return  # a babbler that was handed over as it is must not be asked: it would move on
    robot = getattr(context.description.body, "model", "MODEL")
    raise DescriptionError(
        f"body: the hand is never seen: no head posture shows it at any of {2 * _GLANCES} arm postures of the "
        f"babbling. Choose another babbling.range, or let `somatopy check-body {robot}` say what is wrong."
    )


def _bounds(context: Context) -> Floats:
    """Where the arm babbles, shape (n_arm, 2), rad; its limits where a babbler of one's own says something else."""
    with suppress(ValueError, TypeError):
        bounds = context.bounds()
        if bounds.shape == (len(context.arm), 2):
            return bounds
    return context.arm.space.limits


def _glimpsed(body: Modelled, arms: Floats) -> bool:
    eye = GeometricEye(body.camera, body.marker, body.occluders)
    heads = list(_coarse(body))
    return any(eye.find(body.view(arm, head)) is not None for arm in arms for head in heads)


def _coarse(body: Modelled) -> Iterator[Floats]:
    """A few head postures all over the limits, those in their middle first."""
    count, joints = _COARSE.get(len(body.head), 3), zip(body.head.lower, body.head.upper, strict=True)
    shares = sorted(np.linspace(0.0, 1.0, count), key=lambda share: abs(share - 0.5))
    for posture in product(*([low + share * (high - low) for share in shares] for low, high in joints)):
        yield body.legal(np.array(posture))


def _found(body: Modelled, arms: Floats) -> bool:
    """The same with the whole grid of head postures."""
    vantages = Vantages.of(body)
    return any(vantages.seeing(arm, 0).any() for arm in arms)


# -- a range in which the hand is seen more often ----------------------------------------------------------------------


def confined(vantages: Vantages) -> Floats | None:
    """A babbling range in which the hand can mostly be seen, shape (n_arm, 2), rad. None if it can never be seen.

    It surrounds the arm posture around which the hand can be seen most often. It is as wide as possible, while the hand
    can be seen in four of five of its postures.
    """
    arm = vantages.body.arm
    rng, span = np.random.default_rng(0), arm.upper - arm.lower
    drawn = rng.uniform(arm.lower, arm.upper, (_DRAWN, len(arm)))
    seen = np.array([vantages.seeing(posture).any() for posture in drawn])
    if not seen.any():
        return None
    centre, box = _densest(drawn, seen, span), np.column_stack([arm.lower, arm.upper])
    for share in _SHARES:
        half = 0.5 * np.minimum(share * span, _WIDEST)
        low, high = (
            np.maximum(centre - half, arm.lower + _SLACK * span),
            np.minimum(centre + half, arm.upper - _SLACK * span),
        )
        box = np.column_stack([low, high])
        tried = rng.uniform(low, high, (_TRIED, len(arm)))
        if np.mean([vantages.seeing(posture).any() for posture in tried]) >= _OFTEN:
            break
    return box


def _densest(drawn: Floats, seen: Floats, span: Floats) -> Floats:
    """Of the postures that are seen, the one whose nearest neighbours are seen most often."""
    scaled = drawn / span
    apart = ((scaled[:, None] - scaled[None]) ** 2).sum(axis=2)
    near = np.argsort(apart, axis=1)[:, :16]
    return np.asarray(drawn[np.where(seen, seen[near].mean(axis=1), -1.0).argmax()])


# -- why not -----------------------------------------------------------------------------------------------------------


def why_unseen(body: Modelled, arms: Floats) -> str:
    """Why no head posture sees the hand: "hidden", "aside", "small" or "turned".

    Args:
        body: the robot.
        arms: arm postures in which no head posture sees the hand, shape (n, n_arm), rad.
    """
    views = [body.view(arm, head) for arm in arms for head in _coarse(body)]
    bare = GeometricEye(body.camera, body.marker, Shapes(np.empty(0, np.int64), np.empty((0, 4))))
    if any(bare.find(View(view.camera, view.marker, np.empty((0, 12)))) is not None for view in views):
        return "hidden"
    framed = [view for view in views if view.gaze_error < _half_view(body)]
    if not framed:
        return "aside"
    nearest = min(float(np.linalg.norm(view.marker[:3] - view.camera[:3])) for view in framed)
    return "small" if body.camera.focal * body.marker.tag_size / nearest < 1.5 * MIN_HEIGHT else "turned"


def _half_view(body: Modelled) -> float:
    """Half the angle from one corner of the picture to the opposite one, rad."""
    return float(np.arctan(0.5 * np.hypot(body.camera.width, body.camera.height) / body.camera.focal))
