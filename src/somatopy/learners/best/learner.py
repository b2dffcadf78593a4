"""The best learner: from where the hand can be seen, learned without any model of the robot."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from somatopy.learners.base import Plastic
from somatopy.learners.best.frame import PARTS, believe, choose, expect, live_and_choose
from somatopy.learners.best.memory import FORGOTTEN, HITS, SURPRISE, UNITS, Memory, fresh, opened, packed
from somatopy.percept import Column, Floats, Percept, Robot

__all__ = ["BestLearner"]

#: What a percept tells of postures, in the order in which `live` takes it.
SENSES = ("arm", "arm_command", "head", "head_command")


class BestLearner(Plastic):
    """Learns which gazes see the hand at a posture of the arm, and looks from where it is most surely seen.

    It knows no model of the robot. What it learns, frame by frame and from what it meets alone:

    - *calibration*: sensed head angle against command, where the body cuts commands, the arm's speed, and what a
      movement in the picture, or of the arm, is worth in head angles;
    - *directions*: the head posture that would centre the hand at a felt posture of the arm, as a polynomial and a map
      of units that grows;
    - *visibility*: from which offsets around that direction the hand is seen, as one logistic layer;
    - *memory*: what was seen and missed in the last seconds, on the same offsets;
    - *schema*: how the felt posture is to be understood, once errors grow or the hand is lost.

    While all parts learn, what they knew before a surprise is kept, and comes back when it explains again what is seen.

    docs/best.md derives each.

    Args:
        robot: limits of arm and head joints, and the size of the camera's picture.
        rng: random numbers for gazes before the first hit.

    Example:
        >>> from somatopy.percept import Camera, Sighting, Space
        >>> arm, head = Space(("shoulder",), [-2], [2]), Space(("yaw", "pitch"), [-2, -0.6], [2, 0.5])
        >>> learner = BestLearner(Robot({"arm": arm, "head": head}, ("head",), Camera("eye", 320, 240, fovy=0.83)),
        ...                       np.random.default_rng(0))
        >>> x, y = np.array([0.5]), np.array([0.3, 0.1])
        >>> for _ in range(20):
        ...     learner.observe(Percept(0.0, x, y, x, y, Sighting(pixel=(159.5, 119.5), tag=0, area=900.0)))
        >>> bool(np.abs(learner.predict(x) - y).max() < 0.1)
        True
    """

    parts = frozenset(PARTS)
    columns = (
        Column("units", "int", "units of the map of arm postures"),
        Column("surprise", "float", "kappa_e: how much worse directions are than they used to be, 0 to 1"),
        Column("direction_error", "float", "where the hand was seen less where it was expected, rad", "rad"),
    )

    def __init__(self, robot: Robot, rng: np.random.Generator) -> None:
        self._rng = rng
        self._hold(fresh(robot))
        width, height = robot.camera.width, robot.camera.height
        self._half, self._aspect = 0.5 * width, height / width
        self._middle = 0.5 * (width - 1), 0.5 * (height - 1)
        n, m = len(robot.arm), len(robot.head)
        self._told = np.empty(2 * n + 2 * m + 2)
        ends = np.cumsum([0, n, n, m, m]).tolist()
        self._places = [(sense, slice(*ends[k : k + 2])) for k, sense in enumerate(SENSES)]
        self._flagged: frozenset[str] | None = None
        self._learns = np.ones(len(PARTS), np.bool_)
        self._observed: Percept | None = None
        self._error = np.nan

    def _hold(self, memory: Memory) -> None:
        """Have this memory, by its names and as kernels take it."""
        self._packed = packed(memory)
        self._memory = opened(*self._packed)

    def __setstate__(self, state: dict[str, Any]) -> None:
        """A copied or unpickled learner's names are views of its own arrays again."""
        self.__dict__.update(state)
        self._memory = opened(*self._packed)

    def observe(self, percept: Percept) -> None:
        """All parts that may learn do, and the next gaze is chosen.

        Raises:
            ValueError: a posture of the wrong length or not finite; nothing has been learned then.
        """
        told = self._told
        for sense, place in self._places:
            vector = np.asarray(getattr(percept, sense))
            if vector.shape != (place.stop - place.start,):
                raise ValueError(
                    f"The percept's {sense} has shape {vector.shape} instead of {(place.stop - place.start,)}; "
                    "nothing has been learned."
                )
            told[place] = vector
        if percept.sighting is None:
            told[-2:] = np.nan
        else:
            (u, v), (middle_u, middle_v) = percept.sighting.pixel, self._middle
            told[-2], told[-1] = (u - middle_u) / self._half, (v - middle_v) / self._half
        error = live_and_choose(*self._packed, told, self._aspect, self._flags())
        if error < 0:
            raise ValueError(f"A posture of {percept} is not finite; nothing has been learned.")
        self._observed, self._error = percept, error

    def _flags(self) -> NDArray[np.bool_]:
        """Which parts learn, in the order of `PARTS`."""
        plastic = self.plastic
        if plastic is not self._flagged:
            self._flagged, self._learns = plastic, np.array([part in plastic for part in PARTS])
        return self._learns

    def gaze(self, percept: Percept) -> Floats:
        """From where the hand is most surely seen; a random head posture before the first hit."""
        memory = self._memory
        if not memory.numbers[HITS]:
            memory.asked[:] = self._rng.uniform(memory.limits[:, 0], memory.limits[:, 1])
        elif percept is not self._observed:
            choose(memory, bool(self._flags()[PARTS.index("memory")]))
        return memory.asked.copy()

    def predict(self, arm: ArrayLike) -> Floats:
        """The same at rest in an arm posture, without working memory; the middle of the range before the first hit.

        Args:
            arm: sensed arm posture, shape (n_arm,), rad.
        """
        if not self._memory.numbers[HITS]:
            return np.asarray(self._memory.limits.mean(axis=1))
        posture = np.ascontiguousarray(arm, np.float64)
        if posture.shape != self._memory.low.shape:
            raise ValueError(f"A posture of shape {self._memory.low.shape} is needed, not {posture.shape}.")
        return expect(self._memory, posture, "memory" in self.plastic)

    def belief(self, arms: ArrayLike, gazes: ArrayLike) -> Floats:
        """The chance sigma(z) of each gaze to see the hand at rest in an arm posture, without working memory.

        Args:
            arms: sensed arm postures, shape (k, n_arm), rad.
            gazes: head postures as commands, shape (n, n_head), rad.

        Returns:
            Shape (k, n); 0 for gazes beyond the sheet, which are never chosen, and everywhere before the first hit.
        """
        given, looks = np.ascontiguousarray(arms, np.float64), np.ascontiguousarray(gazes, np.float64)
        found = np.zeros((len(given), len(looks)))
        if self._memory.numbers[HITS]:
            for arm, chances in zip(given, found, strict=True):
                believe(self._memory, arm, looks, "memory" in self.plastic, chances)
        return found

    def probes(self) -> dict[str, float]:
        """Units of the map, surprise, and the error of this frame's direction."""
        numbers = self._memory.numbers
        return {
            "units": int(numbers[UNITS]),
            "surprise": float(numbers[SURPRISE]),
            "direction_error": float(self._error),
        }

    def maps(self) -> dict[str, Any]:
        """The units in use with what they say, the polynomial, the sheet, the pixel gain and the schema."""
        count, memory = int(self._memory.numbers[UNITS]), self._memory
        kept = np.exp(memory.faded[:count, None] - memory.numbers[FORGOTTEN])
        own = {"units": memory.units[:count].copy()}
        own |= {name: getattr(memory, name)[:count] * kept for name in ("turns", "fields")}
        rest = ("plane", "metric", "common", "sheet", "recent", "shape", "reach", "gain", "shift", "bias")
        return own | {name: getattr(memory, name).copy() for name in rest}

    def state(self) -> dict[str, Any]:
        """All that it holds, and the generator."""
        held = {name: array.copy() for name, array in self._memory._asdict().items()}
        return {"memory": held, "rng": self._rng.bit_generator.state, "error": self._error}

    def restore(self, state: dict[str, Any]) -> None:
        """Continue bit for bit from `state`."""
        self._hold(Memory(**{name: np.asarray(array) for name, array in state["memory"].items()}))
        self._rng.bit_generator.state = state["rng"]
        self._observed, self._error = None, float(state["error"])
