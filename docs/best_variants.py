"""The best learner with a part left out, a rate changed, or its senses late: what docs/best.md compares it with.

somatopy run best --eye geometric --motion kinematic --learner docs.best_variants:Varied --learner.fields 0

`best` has no such options. A variant lets it live one frame, and then changes what it holds: a rate is halved by taking
back half of what the frame has changed, and a part that says 0 for ever is left out. Then it chooses its gaze.
"""

from __future__ import annotations

from collections import deque
from typing import Annotated, Any

import numpy as np
from annotated_types import Ge
from typing_extensions import Doc

from somatopy.learners import BestLearner
from somatopy.learners.best.directions import NEAREST, active, direction, dual_of, powers
from somatopy.learners.best.forgetting import voices
from somatopy.learners.best.frame import choose
from somatopy.learners.best.memory import CALM, HITS, KEPT_UNITS, LASTING, SURPRISE, UNITS, Memory
from somatopy.learners.best.schema import PULL, is_lost, trust_of
from somatopy.learners.best.visibility import KEPT, in_reach, learn_visibility
from somatopy.percept import Floats, Percept, Robot, Sighting

Factor = Annotated[float, Ge(0)]
#: What a miss teaches, and what is stretched with the sheet.
TAUGHT = ("sheet", "common", "fields", "recent")


class Varied(BestLearner):
    """`BestLearner` with some of its rates multiplied by a factor; 0 leaves a part out, 1 changes nothing.

    In the few frames in which the sheet is stretched because the pixel gain has become known, it and the fields learn
    at their usual rates.

    Args:
        robot: limits of arm and head joints, and the size of the camera's picture.
        rng: random numbers for gazes before the first hit.
    """

    def __init__(
        self,
        robot: Robot,
        rng: np.random.Generator,
        plane: Annotated[Factor, Doc("Of the polynomial B of the directions.")] = 1.0,
        turns: Annotated[Factor, Doc("Of the units' directions b.")] = 1.0,
        drift: Annotated[Factor, Doc("Of the drift eps of the directions.")] = 1.0,
        sheet: Annotated[Factor, Doc("Of the sheet f that all postures share.")] = 1.0,
        common: Annotated[Factor, Doc("Of the polynomial F of visibility.")] = 1.0,
        fields: Annotated[Factor, Doc("Of the units' fields w.")] = 1.0,
        strokes: Annotated[Factor, Doc("Of the strokes in the working memory E.")] = 1.0,
        misses: Annotated[Factor, Doc("Of all that a miss teaches f, F, w and E.")] = 1.0,
        step: Annotated[Factor, Doc("Of the schema's step by the error of the direction.")] = 1.0,
        pull: Annotated[Factor, Doc("Of the schema's pull to the mean posture.")] = 1.0,
        ahead: Annotated[Factor, Doc("Frames by which it chooses its gaze ahead of what it senses.")] = 1.0,
        late: Annotated[int, Ge(0), Doc("Frames by which all that it senses reaches it late.")] = 0,
        centring: Annotated[bool, Doc("Whether it looks at the hand's direction, and learns no visibility.")] = False,
        alike: Annotated[bool, Doc("Whether the monomials of B and F learn without the metric M.")] = False,
        unmoved: Annotated[bool, Doc("Whether the pixel gain is learned as if no arm moved the hand.")] = False,
        coarse: Annotated[bool, Doc("Whether the map measures distances by the limits of the joints.")] = False,
        restless: Annotated[bool, Doc("Whether directions go on learning as fast as at first.")] = False,
        steadfast: Annotated[bool, Doc("Whether it goes on trusting the schema in a surprise that lasts.")] = False,
        fickle: Annotated[bool, Doc("Whether it keeps nothing of what it knew before a surprise.")] = False,
        ajar: Annotated[bool, Doc("Whether misses beyond the sheet teach visibility, too.")] = False,
    ) -> None:
        super().__init__(robot, rng)
        learns = 0.0 if centring else 1.0
        self._factors = {
            "plane": plane,
            "turns": turns,
            "drift": drift,
            "sheet": sheet * learns,
            "common": common * learns,
            "fields": fields * learns,
            "recent": strokes * learns,
        }
        self._misses, self._schema, self._ahead, self._ajar = misses, (step, pull), ahead, ajar
        self._alike, self._steadfast, self._fickle = alike, steadfast, fickle
        self._unmoved, self._coarse, self._restless = unmoved, coarse, restless
        changed = {name for name, factor in self._factors.items() if factor != 1.0 or misses != 1.0}
        self._kept = sorted(changed | {"numbers", "shift", "home", "drift", "reach", "gain", "metric"})
        self._bowl = bowl(self._memory) if centring else None
        self._late: deque[tuple[Percept, Floats]] = deque(maxlen=late + 1)

    def observe(self, percept: Percept) -> None:
        """Live the frame as `BestLearner` does, change what it did, and choose the gaze anew."""
        self._late.append((percept, self._memory.asked.copy()))
        if len(self._late) < (self._late.maxlen or 1):
            return
        percept, self._memory.asked[:] = self._late[0]
        before = self._memory._replace(**{name: getattr(self._memory, name).copy() for name in self._kept})
        super().observe(percept)
        self._change(before, percept)
        memory, speed = self._memory, self._memory.speed.copy()
        if memory.numbers[HITS] > 0.0:
            memory.speed[:] = self._ahead * speed
            choose(memory, "memory" in self.plastic)
            memory.speed[:] = speed

    def _change(self, before: Memory, percept: Percept) -> None:
        """Multiply what the frame has changed by the factors."""
        memory, missed = self._memory, percept.sighting is None
        if self._ajar and missed:
            self._learn_beyond(before, percept)
        for name, factor in self._factors.items():
            old, now = getattr(before, name), getattr(memory, name)
            teaches = self._misses if missed and name in TAUGHT else 1.0
            if factor == 0.0:
                now[:] = 0.0
            elif factor * teaches != 1.0 and not self._untouched(name, before, missed):
                base = KEPT * old if name == "recent" else old
                now[:] = base + factor * teaches * (now - base)
        if self._alike:
            memory.metric[:] = before.metric
        if self._unmoved:
            memory.doubt[2:], memory.doubt[:, 2:] = 0.0, 0.0
        if self._coarse:
            memory.extent[:] = 1.0
        if self._restless:
            memory.numbers[CALM] = 0.0
        if self._steadfast:
            memory.numbers[LASTING] = 0.0
        if self._fickle:
            memory.numbers[KEPT_UNITS] = 0.0
        if self._bowl is not None:
            memory.sheet[:] = self._bowl
        if self._schema != (1.0, 1.0) and "schema" in self.plastic:
            self._change_shift(before)

    def _untouched(self, name: str, before: Memory, missed: bool) -> bool:
        """Whether an array changed by anything but its rate: the drift fades on a miss, and sheets may be stretched."""
        if name == "drift":
            return missed
        return name in TAUGHT and bool((self._memory.reach != before.reach).any())

    def _change_shift(self, before: Memory) -> None:
        memory, (step, pull) = self._memory, self._schema
        wrong = 1.0 if is_lost(memory.numbers) else before.numbers[SURPRISE]
        pulled = PULL * wrong * (before.home - memory.felt[0])
        stepped = memory.shift - before.shift - pulled
        memory.shift[:] = before.shift + pull * pulled + step * stepped

    def _learn_beyond(self, before: Memory, percept: Percept) -> None:
        """What `live` leaves out: a miss at an offset so far beyond the sheet that it says nothing of it."""
        memory, x = self._memory, self._memory.felt[0]
        index, share = np.empty(NEAREST, np.int64), np.empty(NEAREST)
        count = int(memory.numbers[UNITS])
        if not (count and memory.numbers[HITS]):
            return
        found = active(memory.units, memory.extent, count, x, index, share)
        phi, expected = np.empty(memory.plane.shape[1]), np.empty(memory.head.size)
        powers(x, phi)
        dual = np.empty(phi.size)
        dual_of(memory, phi, dual)
        voice = voices(memory, index, share, found)
        direction(memory.plane, memory.turns, phi, index, voice, found, expected)
        offset = percept.head - expected - before.drift
        if not in_reach(memory, offset):
            flags = "visibility" in self.plastic, "memory" in self.plastic
            trust = trust_of(before.numbers)
            learn_visibility(memory, offset, False, trust, *flags, phi, dual, index, share, voice, found)

    def gaze(self, percept: Percept) -> Floats:
        """The gaze that `observe` chose; a random head posture before the first hit."""
        if self._memory.numbers[HITS]:
            return self._memory.asked.copy()
        return super().gaze(percept)

    def state(self) -> dict[str, Any]:
        """All that it holds, what is under way to it, and the generator."""
        waiting = [said(percept) | {"asked": asked.copy()} for percept, asked in self._late]
        return super().state() | {"late": {str(k): row for k, row in enumerate(waiting)}}

    def restore(self, state: dict[str, Any]) -> None:
        """Continue bit for bit from `state`."""
        super().restore(state)
        self._late.clear()
        self._late.extend((heard(row), np.array(row["asked"])) for row in state["late"].values())


def bowl(memory: Memory) -> Floats:
    """A sheet whose best cell is the middle, and whose better one of any two is the nearer one."""
    axes = np.meshgrid(*(np.linspace(-1.0, 1.0, int(cells)) for cells in memory.shape), indexing="ij")
    return np.asarray(-sum(axis**2 for axis in axes)).ravel()


def said(percept: Percept) -> dict[str, Any]:
    """What the learner takes from a percept, as plain data."""
    vectors = {name: np.array(percept[name]) for name in ("arm", "head", "arm_command", "head_command")}
    pixel = percept.sighting.pixel if percept.sighting else (np.nan, np.nan)
    return vectors | {"pixel": np.array(pixel)}


def heard(row: dict[str, Any]) -> Percept:
    """The same as a percept."""
    vectors = {name: np.array(row[name]) for name in ("arm", "head", "arm_command", "head_command")}
    u, v = (float(value) for value in row["pixel"])
    return Percept(0.0, **vectors, sighting=None if np.isnan(u) else Sighting((u, v), 0, 0.0))
