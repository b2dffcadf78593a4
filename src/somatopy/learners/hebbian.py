"""The paper's learner: two self-organising maps joined by Hebbian links (Schillaci, Hafner and Lara 2014)."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from math import hypot, isfinite
from typing import Annotated, Any, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike
from sklearn.base import clone
from typing_extensions import Doc

from somatopy.learners.at_once import learn_both, posture_of_strongest
from somatopy.learners.base import Plastic, Scale
from somatopy.links import HebbianLinks, PositiveHebb, Rule, activation
from somatopy.maps import DSOM, Lattice, Map
from somatopy.percept import Column, Floats, Percept, Robot, Sighting, Space
from somatopy.registry import MAPS, RULES, BuildContext, Positive, Settings

__all__ = ["Hebbian", "HebbianLearner", "centring"]

Units = Literal["unit", "radian"]
Centring = Literal["linear", "none"]
Ties = Literal["redrawn", "held", "first"]

_MAPS = frozenset({"arm_map", "head_map"})
_DOUBLE = np.dtype(np.float64)
MOST_UNITS = 10_000_000


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
        robot: names and limits of arm and head joints, and the size of the camera's picture.
        rng: the learner's random numbers: start codes, and the choice among equal links.
        arm_map: parameters of the map of arm postures, which may be any on a lattice; a 30x30 DSOM by default. It is
            cloned. Its start codes are drawn from `rng`, uniform in each joint's range, unless its `init` gives them.
        head_map: the same for the map of head postures.
        rule: how a link changes; the paper's positive rule by default.
        activation_slope: of equation 4, A(d) = 1 / (1 + slope tanh d): 1 in the paper, 2 in the first author's library
            of 2016.
        units: what the maps are given: "unit", each joint's range as [0, 1], or "radian".
        centring: f_c on a hit: "linear" as in equation 3, or "none", 1 wherever the hand is in the picture.
        ties: which of equal links counts: one drawn at random, "redrawn" in each frame or "held" as long as the arm's
            winner is the same, or always the "first".
        plastic: the parts that learn; all of them by default.

    Raises:
        ValueError: a map is not on a lattice, or its parameters are not valid; an unknown choice; a slope that is not
            a finite number over 0.

    Example:
        >>> from somatopy.percept import Camera
        >>> arm = Space(("shoulder", "elbow"), [-2, -0.3], [2, 1.3])
        >>> head = Space(("yaw", "pitch"), [-2, -0.6], [2, 0.5])
        >>> robot = Robot({"arm": arm, "head": head}, ("head",), Camera("eye", 320, 240, fovy=0.83))
        >>> learner = HebbianLearner(robot, np.random.default_rng(0))
        >>> x, y = np.array([0.5, 0.5]), np.array([0.3, 0.1])
        >>> learner.observe(Percept(0.0, x, y, x, y, Sighting(pixel=(159.5, 119.5), tag=0, area=900.0)))
        >>> bool(np.abs(learner.predict(x) - y).max() < 0.1)
        True
    """

    parts = frozenset({"arm_map", "head_map", "links"})

    def __init__(
        self,
        robot: Robot,
        rng: np.random.Generator,
        *,
        arm_map: Map | None = None,
        head_map: Map | None = None,
        rule: Rule | None = None,
        activation_slope: float = 1.0,
        units: Units = "unit",
        centring: Centring = "linear",
        ties: Ties = "redrawn",
        plastic: Iterable[str] | None = None,
    ) -> None:
        _check_choices(units=(units, Units), centring=(centring, Centring), ties=(ties, Ties))
        if not (activation_slope > 0 and isfinite(activation_slope)):
            raise ValueError(f"activation_slope must be a finite number over 0; got {activation_slope!r}")
        self._arm_scale, self._head_scale = (_scale(space, units) for space in (robot.arm, robot.head))
        self._arm_space, self._head_space = robot.arm, robot.head
        self._image_size = robot.camera.width, robot.camera.height
        self._slope, self._centred, self._ties = activation_slope, centring == "linear", ties
        arm_rng, head_rng, self._rng = rng.spawn(3)
        self.arm_map = _fresh("arm_map", arm_map, arm_rng, robot.arm, self._arm_scale)
        self.head_map = _fresh("head_map", head_map, head_rng, robot.head, self._head_scale)
        self.links = HebbianLinks(len(self.arm_map.codebook_), len(self.head_map.codebook_), rule or PositiveHebb())
        self.plastic = self.parts if plastic is None else frozenset(plastic)
        self.columns = _columns("1" if units == "unit" else "rad")
        self._observed: Percept | None = None
        self._probes: dict[str, Any] = {
            "arm_winner": -1,
            "head_winner": -1,
            "arm_distance": np.nan,
            "head_distance": np.nan,
        }
        self._chance, self._chosen_for = 0.0, -1
        scales = self._arm_scale, self._head_scale
        self._low, self._span = (np.concatenate([getattr(s, name) for s in scales]) for name in ("low", "span"))
        self._postures, self._shapes = np.empty_like(self._low), tuple(s.low.shape for s in scales)

    def observe(self, percept: Percept) -> None:
        """Maps learn, winners are found, the link between them learns (steps 5 to 7 of the frame).

        Raises:
            ValueError: a posture of the wrong length or not finite; nothing has been learned then.
        """
        found = self._learn_at_once(percept) or self._learn_one_by_one(percept)
        i, arm_distance, j, head_distance = found
        target = self._target(percept.sighting)
        if "links" in self.plastic and (target != 0.0 or type(self.links.rule) is not PositiveHebb):
            strength = activation(arm_distance, self._slope) * activation(head_distance, self._slope)
            self.links.update(i, j, strength, target)
        self._observed = percept
        self._probes = {
            "arm_winner": i,
            "head_winner": j,
            "arm_distance": arm_distance,
            "head_distance": head_distance,
        }

    def _learn_one_by_one(self, percept: Percept) -> tuple[int, float, int, float]:
        """Winner and distance in the arm map, then in the head map, after those that may have learned."""
        x, y = self._arm_scale.to_unit(percept.arm), self._head_scale.to_unit(percept.head)
        if not all(map(isfinite, y.tolist())):
            raise ValueError(f"The head posture {percept.head} is not finite; nothing has been learned.")
        return *_found(self.arm_map, x, "arm_map" in self.plastic), *_found(
            self.head_map, y, "head_map" in self.plastic
        )

    def _learn_at_once(self, percept: Percept) -> tuple[int, float, int, float] | None:
        """The same by one kernel; None, and nothing has changed, where maps or postures are none that it takes."""
        arm_map, head_map, arm, head = self.arm_map, self.head_map, percept.arm, percept.head
        if not (type(arm_map) is type(head_map) is DSOM and arm_map is not head_map and self.plastic >= _MAPS):
            return None
        if not (type(arm) is type(head) is np.ndarray and (arm.shape, head.shape) == self._shapes):
            return None
        if not arm.dtype is head.dtype is _DOUBLE:
            return None
        first, second = arm_map.for_kernel(), head_map.for_kernel()
        if first is None or second is None:
            return None
        joints = len(arm)
        self._postures[:joints], self._postures[joints:] = arm, head
        found = learn_both(self._postures, self._low, self._span, joints, first, second)
        return found if found[0] >= 0 else None

    def _target(self, sighting: Sighting | None) -> float:
        """f_c of equation 3."""
        return centring(sighting, self._image_size) if self._centred else float(sighting is not None)

    def gaze(self, percept: Percept) -> Floats:
        """The weights of the head node most strongly linked to the arm's winner (step 8)."""
        if percept is self._observed:
            i = self._probes["arm_winner"]
        else:
            i, _ = self.arm_map.winner(self._arm_scale.to_unit(percept.arm))
        if self._ties == "redrawn" or (self._ties == "held" and i != self._chosen_for):
            self._chance, self._chosen_for = self._rng.random(), i
        return self._posture(i, self._chance)

    def predict(self, arm: ArrayLike) -> Floats:
        """The same without learning or chance: the first of equal links."""
        i, _ = self.arm_map.winner(self._arm_scale.to_unit(arm))
        return self._posture(i, 0.0)

    def belief(self, arms: ArrayLike, gazes: ArrayLike) -> Floats:
        """Links from the arm's winner to the head units nearest to gazes, as shares of its strongest link.

        Args:
            arms: sensed arm postures, shape (k, n_arm), rad.
            gazes: head postures, shape (n, n_head), rad.

        Returns:
            Shape (k, n), 0 to 1; 0 for a winner without links above 0.
        """
        nearest = self.head_map.predict(self._head_scale.to_unit(gazes))
        winners = self.arm_map.predict(self._arm_scale.to_unit(arms))
        rows = np.array([np.maximum(self.links.row(i), 0.0) for i in winners.tolist()])
        most = rows.max(axis=1, keepdims=True)
        return np.asarray((rows / np.where(most > 0.0, most, 1.0))[:, nearest])

    def _posture(self, i: int, u: float) -> Floats:
        links, head, scale = self.links.whole, self.head_map, self._head_scale
        if links is not None and type(head) is DSOM and head.sheet.codes.dtype is _DOUBLE:
            return posture_of_strongest(links, i, u, head.sheet.codes, head.sheet.columns, scale.low, scale.span)
        return self._head_scale.to_angle(self.head_map.code(self.links.strongest(i, u)))

    def probes(self) -> dict[str, float]:
        """Winners, and their distances to the inputs after the update (the paper's distortion)."""
        return self._probes

    def maps(self) -> dict[str, Any]:
        """Codebooks in [0, 1] units, lattice shapes, joint limits (rad), and the links that are not 0."""
        pre, post, weight = self.links.used()
        return {
            "arm_codebook": _in_range(self.arm_map.codebook_, self._arm_scale, self._arm_space),
            "head_codebook": _in_range(self.head_map.codebook_, self._head_scale, self._head_space),
            "arm_shape": np.array(self.arm_map.topology_.shape),
            "head_shape": np.array(self.head_map.topology_.shape),
            "arm_limits": self._arm_space.limits,
            "head_limits": self._head_space.limits,
            "link_pre": pre,
            "link_post": post,
            "link_weight": weight,
        }

    def shuffle(self, rng: np.random.Generator) -> None:
        """Give each arm node the links of another, drawn at random: what is still hit then is hit by chance."""
        state = self.links.state()
        moved = np.argsort(rng.permutation(self.links.n_pre))[state["link_pre"]]
        order = np.argsort(moved, kind="stable")
        rows = {name: state[name][order] for name in ("link_post", "link_weight")}
        self.links.restore(state | {"link_pre": moved[order].astype(np.int32), **rows})

    def state(self) -> dict[str, Any]:
        """Both maps, links, generator, and the choice among equal links."""
        return {
            "arm_map": self.arm_map.state(),
            "head_map": self.head_map.state(),
            "links": self.links.state(),
            "rng": self._rng.bit_generator.state,
            "probes": dict(self._probes),
            "chance": self._chance,
            "chosen_for": self._chosen_for,
        }

    def restore(self, state: dict[str, Any]) -> None:
        """Continue bit for bit from `state`."""
        self.arm_map.restore(state["arm_map"])
        self.head_map.restore(state["head_map"])
        self.links.restore(state["links"])
        self._rng.bit_generator.state = state["rng"]
        self._probes, self._observed = dict(state["probes"]), None
        self._chance, self._chosen_for = float(state["chance"]), int(state["chosen_for"])


def _check_choices(**choices: tuple[str, Any]) -> None:
    """Refuse a value that is none of its type's, which is a Literal."""
    for name, (value, valid) in choices.items():
        if value not in get_args(valid):
            raise ValueError(f"{name} must be one of {', '.join(get_args(valid))}; got {value!r}")


def _found(chart: Map, x: Floats, plastic: bool) -> tuple[int, float]:
    """The winner for an input and its distance, after the map has learned it, if it may."""
    return chart.learn_and_find(x) if plastic else chart.winner(x)


def _scale(space: Space, units: Units) -> Scale:
    """From angles to what the maps are given."""
    return Scale(space.limits if units == "unit" else [[0.0, 1.0]] * len(space))


def _in_range(codebook: Floats, scale: Scale, space: Space) -> Floats:
    """Codes in [0, 1] units of the joints' range, whatever the maps are given."""
    own = Scale(space.limits)
    known = np.array_equal(own.low, scale.low) and np.array_equal(own.span, scale.span)
    return codebook if known else own.to_unit(scale.to_angle(codebook))


def _columns(unit: str) -> tuple[Column, ...]:
    said = "[0, 1] units" if unit == "1" else unit
    return (
        Column("arm_winner", "int", "winner in the arm map after the update"),
        Column("head_winner", "int", "winner in the head map after the update"),
        Column("arm_distance", "float", f"distance from arm input to winner after the update, {said}", unit),
        Column("head_distance", "float", f"distance from head input to winner after the update, {said}", unit),
    )


def _lattice(name: str, chart: Map) -> Lattice:
    """The lattice of a map's parameters, if it has one."""
    lattice = getattr(chart, "topology_", None)
    if not isinstance(lattice, Lattice):
        kind = type(chart).__name__
        raise ValueError(f"{name} must be a map on a lattice, such as dsom or som; {kind} is none")
    if lattice.units > MOST_UNITS:
        raise ValueError(f"{name} has at most {MOST_UNITS:.0e} units, not {lattice.units:.1e}. Make it smaller")
    return lattice


def _fresh(name: str, parameters: Map | None, rng: np.random.Generator, space: Space, scale: Scale) -> Any:
    """A map of the same parameters with start codes of its own, uniform in the joints' range."""
    own: Any = clone(parameters) if parameters is not None else DSOM()
    try:
        _lattice(name, own)
        own.set_params(random_state=rng, bounds=scale.to_unit(space.limits.T).T)
        return own.initialise(len(space))
    except ValueError as error:
        said = str(error)
        raise ValueError(said if said.startswith(name) else f"{name}: {said}") from error


def _paper_map() -> Settings:
    """The map that arm and head have if nothing is said: the paper's 30x30 units, learning rate and elasticity .1."""
    return MAPS.settings("dsom")(shape=(30, 30), learning_rate=0.1, elasticity=0.1)  # type: ignore[call-arg]


def _paper_rule() -> Settings:
    return RULES.settings("positive")()


@dataclass(frozen=True)
class Hebbian(Settings):
    """The paper's learner: arm map, head map, positive Hebbian links."""

    arm_map: Annotated[Settings, MAPS] = field(default_factory=_paper_map)
    head_map: Annotated[Settings, MAPS] = field(default_factory=_paper_map)
    rule: Annotated[Settings, RULES] = field(default_factory=_paper_rule)
    link_rate: Annotated[Positive, Doc("eta of equation 3, the rule's learning rate.")] = 0.01
    activation_slope: Annotated[
        Positive, Doc("Slope of equation 4: 1 in the paper, 2 in the first author's library of 2016.")
    ] = 1.0
    units: Annotated[Units, Doc("What maps are given: joint ranges as [0, 1], or radians.")] = "unit"
    centring: Annotated[Centring, Doc("f_c on a hit: linear as in equation 3, or none, which is 1.")] = "linear"
    ties: Annotated[
        Ties, Doc("Which of equal links counts: one drawn in each frame, drawn and held, or the first.")
    ] = "redrawn"
    arm_codes: Annotated[
        Literal["uniform", "sampled"],
        Doc("Start codes of the arm map: uniform in the joint ranges, or from 30 minutes of babbling."),
    ] = "uniform"

    def build(self, context: BuildContext) -> HebbianLearner:
        """The learner.

        Raises:
            ValueError: a map's parameters are not valid, or it is not on a lattice.
        """
        arm_map = self.arm_map.build(context)
        if self.arm_codes == "sampled":
            codes = context.babbled(_lattice("arm_map", arm_map).units)
            arm_map.set_params(init=_scale(context.robot.arm, self.units).to_unit(codes))
        return HebbianLearner(
            context.robot,
            context.rng,
            arm_map=arm_map,
            head_map=self.head_map.build(context),
            rule=self.rule.build(context.told(learning_rate=self.link_rate)),
            activation_slope=self.activation_slope,
            units=self.units,
            centring=self.centring,
            ties=self.ties,
        )
