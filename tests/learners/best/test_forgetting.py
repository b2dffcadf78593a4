"""A surprise that lasts: the schema has the first seconds, then what was learned fades and is learned anew."""

from __future__ import annotations

import numpy as np
import pytest
from tests.learners.best.world import World, live, robot

from somatopy import Session
from somatopy.experiment.changes import changed
from somatopy.experiment.presets import PRESETS
from somatopy.learners import BestLearner
from somatopy.learners.best.forgetting import forget, voices
from somatopy.learners.best.memory import FORGOTTEN, LASTING, METRIC_MOST, SURPRISE, Memory, fresh, packed
from somatopy.learners.best.schema import surprise, trust_of


def surprised(kappa: float, lasting: float) -> Memory:
    """A memory of 40 units that have something to say, this much surprised, for so long."""
    memory, rng = fresh(robot(4)), np.random.default_rng(0)
    memory.numbers[[0, SURPRISE, LASTING]] = 40, kappa, lasting
    for name in ("turns", "fields", "common"):
        getattr(memory, name)[:40] = rng.normal(size=getattr(memory, name)[:40].shape)
    memory.metric[:] = np.diag(rng.uniform(0, METRIC_MOST, len(memory.metric)))
    return memory


def test_units_fade_when_they_are_active_as_if_all_had_faded_in_every_frame() -> None:
    """What each of them says after 200 frames, whenever it was active, is e^-r of what it said, r the sum of rates.

    A rate is .01 kappa lambda^2.
    """
    memory, rng = surprised(0.8, 0.5), np.random.default_rng(1)
    before = memory._replace(**{name: getattr(memory, name).copy() for name in ("turns", "fields", "common", "metric")})
    for _ in range(200):
        forget(memory, rng.choice(30, size=16, replace=False), 16)
    kept = np.exp(-200 * 0.01 * 0.8 * 0.5**2)
    voice = np.array([voices(memory, np.array([unit]), np.ones(1), 1)[0] for unit in range(40)])
    assert len(set(voice[:30])) > 2  # some were just active, and ten never were
    np.testing.assert_allclose(voice[30:], kept)
    np.testing.assert_allclose(voice[:, None] * memory.turns[:40], kept * before.turns[:40], rtol=1e-12)
    np.testing.assert_allclose(voice[:, None] * memory.fields[:40], kept * before.fields[:40], rtol=1e-12)
    np.testing.assert_allclose(memory.common, kept * before.common, rtol=1e-12)
    first = METRIC_MOST * np.eye(len(memory.metric))
    np.testing.assert_allclose(memory.metric, first + kept * (before.metric - first), rtol=1e-12)
    np.testing.assert_array_equal(memory.plane, before.plane)


@pytest.mark.parametrize(("kappa", "lasting"), [(0.0, 0.9), (0.9, 0.0)])
def test_neither_calm_nor_a_new_surprise_forgets(kappa: float, lasting: float) -> None:
    """Not a bit changes."""
    memory = surprised(kappa, lasting)
    before = packed(memory)
    for _ in range(50):
        forget(memory, np.arange(16), 16)
    for old, now in zip(before, packed(memory), strict=True):
        np.testing.assert_array_equal(old, now)


def test_the_schema_has_the_first_seconds_of_a_surprise_and_what_it_leaves_is_learned() -> None:
    """Once errors have grown from .02 to .5 rad, directions learn little at first, and fast again later."""
    numbers = fresh(robot(4)).numbers
    for _ in range(20_000):
        surprise(numbers, np.array([0.02, 0.0]))
    assert trust_of(numbers) == 1.0
    trust = np.empty(500)
    for k in range(500):
        surprise(numbers, np.array([0.5, 0.0]))
        trust[k] = trust_of(numbers)
    assert trust[20:40].max() < 0.2 and trust[-1] > 0.7
    assert numbers[SURPRISE] > 0.9  # and so it is not because the surprise would be over


def test_a_frozen_learner_forgets_nothing() -> None:
    """However long it is surprised; and a learner that has forgotten says as much after it is frozen as before."""
    learner, world = BestLearner(robot(), np.random.default_rng(0)), World(robot())
    live(learner, world, 1500)
    held = learner._memory
    arm = world.arm
    held.numbers[[SURPRISE, LASTING]] = 1.0, 1.0
    learner.plastic = frozenset()
    said = learner.predict(arm)
    before = {name: array.copy() for name, array in held._asdict().items()}
    live(learner, world, 30)
    np.testing.assert_array_equal(learner.predict(arm), said)
    for name in ("turns", "fields", "common", "metric", "faded"):
        np.testing.assert_array_equal(getattr(held, name), before[name])
    held.numbers[[SURPRISE, LASTING]] = 1.0, 1.0
    learner.plastic = frozenset(learner.parts)
    live(learner, world, 30)
    learner.plastic = frozenset()
    said, stale = learner.predict(arm), held.faded[: int(held.numbers[0])] < held.numbers[FORGOTTEN]
    assert stale.any()
    np.testing.assert_allclose(learner.maps()["fields"][~stale], held.fields[: len(stale)][~stale])
    found, kept = learner.maps()["fields"][stale], held.fields[: len(stale)][stale]
    assert (np.abs(found) < np.abs(kept)).sum() == np.count_nonzero(kept)
    live(learner, world, 30)
    np.testing.assert_array_equal(learner.predict(arm), said)


def test_joints_that_have_changed_places_are_soon_understood() -> None:
    """A NAO whose arm joints are permuted after twenty minutes sees its hand sooner than one that never forgets.

    Both have lived the same life before. From half a minute to two and a half after the damage, the one that forgets
    has a tenth more hits at least, over two seeds.
    """
    description = changed(
        PRESETS["paper-wide"](),
        {"learner": "best", "eye": "geometric", "motion": "kinematic", "damage": "permuted"}
        | {"minutes": 20, "damage_minutes": 2.5},
    )

    def hits(session: Session, forgets: bool) -> int:
        seen = []
        for frame in session:
            seen.append(frame.sighting is not None)
            if not forgets:
                session.learner._memory.numbers[LASTING] = 0.0
        return sum(seen[450:])

    total = {True: 0, False: 0}
    for seed in (300, 301):
        with Session(description.replaced(seed=seed)) as session:
            while session.done < description.phases[0].frames:
                next(session)
            grown = session.state()
            for forgets in total:
                session.restore(grown)
                total[forgets] += hits(session, forgets)
    assert total[True] > 1.1 * total[False]
