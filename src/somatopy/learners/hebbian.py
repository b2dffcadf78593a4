"""The paper's learner: two self-organising maps joined by Hebbian links (Schillaci, Hafner and Lara 2014)."""

from __future__ import annotations

from collections.abc import Iterable
from math import hypot
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from sklearn.base import clone

from somatopy.learners.base import Plastic, Scale
from somatopy.links import HebbianLinks, PositiveHebb, Rule, activation
from somatopy.maps import DSOM
from somatopy.percept import Floats, Percept, Sighting

__all__ = ["HebbianLearner", "centring"]


def centring(sighting: Sighting | None, image_size: tuple[int, int]) -> float:
    """f_c of equation 3: 1 with the hand at the image centre, 0 at a corner and beyond, linear; 0 on a miss.

    Args:
        sighting: the marker as seen, or None.
        image_size: width and height, px.
    """
    if sighting is None:
        return 0.0
    width, height = image_size
    u, v = sighting.pixel
    distance = hypot(u - 0.5 * (width - 1), v - 0.5 * (height - 1))
    return max(0.0, 1.0 - distance / hypot(0.5 * width, 0.5 * height))


class HebbianLearner(Plastic):
    r"""Arm map and head map, and links between them that grow while the hand is seen.

    In each frame, with x the arm posture and y the sensed head posture in [0, 1] units:

    1. both maps learn: arm map <- x, head map <- y (equations 1 and 2);
    2. winners: i in the arm map for x, j in the head map for y;
    3. the link grows if the hand is seen: :math:`\Delta w_{ij} = \eta A_i(x) A_j(y) f_c` (equations 3 and 4);
    4. gaze: the head node with the strongest link from i, equal ones drawn at random.

    The efference copy is not used.

    Args:
        arm_limits: low and high of each arm joint, shape (n_arm, 2), rad.
        head_limits: the same for the head, shape (n_head, 2).
        image_size: width and height of the camera's picture, px.
        rng: the learner's random numbers: start codes, and the choice among equal links.
        arm_map: parameters of the map of arm postures, for [0, 1] units; a 30x30 DSOM by default. It is cloned and
            starts with codes drawn from `rng`.
        head_map: the same for the map of head postures.
        rule: how a link changes; the paper's positive rule by default.

    Example:
        >>> arm_limits, head_limits = [[-2, 2], [-0.3, 1.3]], [[-2, 2], [-0.6, 0.5]]
        >>> learner = HebbianLearner(arm_limits, head_limits, (320, 240), np.random.default_rng(0))
        >>> arm, head = np.array([0.5, 0.5]), np.array([0.3, 0.1])
        >>> percept = Percept(0.0, arm, head, arm, head, Sighting(pixel=(159.5, 119.5), tag=0, area=900.0))
        >>> learner.observe(percept)
        >>> bool(np.abs(learner.predict(arm) - head).max() < 0.1)
        True
    """

    PARTS = frozenset({"arm_map", "head_map", "links"})

    def __init__(
        self,
        arm_limits: ArrayLike,
        head_limits: ArrayLike,
        image_size: tuple[int, int],
        rng: np.random.Generator,
        *,
        arm_map: DSOM | None = None,
        head_map: DSOM | None = None,
        rule: Rule | None = None,
        plastic: Iterable[str] = PARTS,
    ) -> None:
        self._arm_scale, self._head_scale = Scale(arm_limits), Scale(head_limits)
        self._image_size = image_size
        arm_rng, head_rng, self._rng = rng.spawn(3)
        self.arm_map = _fresh(arm_map, arm_rng, len(self._arm_scale.low))
        self.head_map = _fresh(head_map, head_rng, len(self._head_scale.low))
        self.links = HebbianLinks(len(self.arm_map.codebook_), len(self.head_map.codebook_), rule or PositiveHebb())
        self.plastic = plastic
        self._probes = {"arm_winner": -1, "head_winner": -1, "arm_distance": np.nan, "head_distance": np.nan}

    def observe(self, percept: Percept) -> None:
        """Maps learn, winners are found, the link between them learns (steps 5 to 7 of the frame).

        Raises:
            ValueError: a posture of the wrong length or not finite; nothing has been learned then.
        """
        x, y = self._arm_scale.to_unit(percept.arm), self._head_scale.to_unit(percept.head)
        if not np.isfinite(y).all():
            raise ValueError(f"The head posture {percept.head} is not finite; nothing has been learned.")
        if "arm_map" in self.plastic:
            self.arm_map.learn_one(x)
        if "head_map" in self.plastic:
            self.head_map.learn_one(y)
        i, arm_distance = self.arm_map.winner(x)
        j, head_distance = self.head_map.winner(y)
        if "links" in self.plastic:
            strength = activation(arm_distance) * activation(head_distance)
            self.links.update(i, j, strength, centring(percept.sighting, self._image_size))
        self._probes = {
            "arm_winner": i,
            "head_winner": j,
            "arm_distance": arm_distance,
            "head_distance": head_distance,
        }

    def gaze(self, percept: Percept) -> Floats:
        """The weights of the head node most strongly linked to the arm's winner (step 8)."""
        return self._look(percept.arm, self._rng.random())

    def predict(self, arm: ArrayLike) -> Floats:
        """The same without learning or chance: the first of equal links."""
        return self._look(arm, 0.0)

    def _look(self, arm: ArrayLike, u: float) -> Floats:
        i, _ = self.arm_map.winner(self._arm_scale.to_unit(arm))
        return self._head_scale.to_angle(self.head_map.code(self.links.strongest(i, u)))

    def probes(self) -> dict[str, float]:
        """Winners, and their distances to the inputs after the update, [0, 1] units (the paper's distortion)."""
        return dict(self._probes)

    def maps(self) -> dict[str, Any]:
        """Codebooks in [0, 1] units, lattice shapes, joint limits (rad), and the links that are not 0."""
        pre, post, weight = self.links.used()
        return {
            "arm_codebook": self.arm_map.codebook_,
            "head_codebook": self.head_map.codebook_,
            "arm_shape": np.array(self.arm_map.shape),
            "head_shape": np.array(self.head_map.shape),
            "arm_limits": self._arm_scale.limits,
            "head_limits": self._head_scale.limits,
            "link_pre": pre,
            "link_post": post,
            "link_weight": weight,
        }

    def shuffle_links(self, rng: np.random.Generator) -> None:
        """Give each arm node the links of another, drawn at random: what is still hit then is hit by chance."""
        state = self.links.state()
        moved = np.argsort(rng.permutation(self.links.n_pre))[state["link_pre"]]
        order = np.argsort(moved, kind="stable")
        rows = {name: state[name][order] for name in ("link_post", "link_weight")}
        self.links.restore(state | {"link_pre": moved[order].astype(np.int32), **rows})

    def state(self) -> dict[str, Any]:
        """Both maps, links and generator."""
        return {
            "arm_map": self.arm_map.state(),
            "head_map": self.head_map.state(),
            "links": self.links.state(),
            "rng": self._rng.bit_generator.state,
            "probes": dict(self._probes),
        }

    def restore(self, state: dict[str, Any]) -> None:
        """Continue bit for bit from `state`."""
        self.arm_map.restore(state["arm_map"])
        self.head_map.restore(state["head_map"])
        self.links.restore(state["links"])
        self._rng.bit_generator.state = state["rng"]
        self._probes = dict(state["probes"])


def _fresh(parameters: DSOM | None, rng: np.random.Generator, dims: int) -> DSOM:
    """A map of the same parameters with start codes of its own."""
    own: DSOM = clone(parameters) if parameters is not None else DSOM()
    own.set_params(random_state=rng)
    return own.initialise(dims)
