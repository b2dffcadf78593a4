"""Angles to [0, 1] units and back, parts that learn or not, and the contract of learners."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from somatopy.learners import FixedGaze, HebbianLearner, Learner, NearestGaze, Plastic, RandomGaze, Scale
from somatopy.percept import Camera, Robot, Space

LIMITS = np.array([[-2.0857, 2.0857], [-0.3142, 1.3265]])
ROBOT = Robot(
    {"arm": Space(("shoulder", "elbow"), *LIMITS.T), "head": Space(("yaw", "pitch"), [-2.0, -0.6], [2.0, 0.5])},
    ("head",),
    Camera("eye", 320, 240, fovy=0.83),
)


def test_limits_become_0_and_1() -> None:
    """Low is 0, high is 1, the middle 0.5."""
    scale = Scale(LIMITS)
    assert scale.to_unit(LIMITS[:, 0]).tolist() == [0, 0]
    assert scale.to_unit(LIMITS[:, 1]).tolist() == [1, 1]
    assert scale.to_unit(LIMITS.mean(axis=1)) == pytest.approx([0.5, 0.5])


@given(arrays(float, 2, elements=st.floats(-10, 10)))
def test_there_and_back(angles: np.ndarray) -> None:
    """to_angle undoes to_unit, outside the limits too: nothing is clipped."""
    scale = Scale(LIMITS)
    assert scale.to_angle(scale.to_unit(angles)) == pytest.approx(angles, abs=1e-12)


def test_later_changes_of_the_limits_do_not_reach_it() -> None:
    """The limits are copied."""
    limits = LIMITS.copy()
    scale = Scale(limits)
    limits[:] = 7
    assert scale.to_unit(LIMITS[:, 1]).tolist() == [1, 1]


@pytest.mark.parametrize("limits", [[[1, 0]], [[0, 0]], [[np.nan, 1]], [0, 1], [[0, 1, 2]]])
def test_wrong_limits_are_refused(limits: object) -> None:
    """Low not below high, or another shape than (n, 2): the message shows them."""
    with pytest.raises(ValueError, match=r"shape \(n, 2\) with low below high, not \["):
        Scale(limits)  # type: ignore[arg-type]


@pytest.mark.parametrize("shape", [(), (1,), (len(LIMITS) + 1,), (3, 1)])
def test_postures_of_other_lengths_are_refused(shape: tuple[int, ...]) -> None:
    """One angle is not taken for that of every joint."""
    with pytest.raises(ValueError, match=f"of {len(LIMITS)} joints is needed"):
        Scale(LIMITS).to_unit(np.zeros(shape))


def test_all_learners_keep_the_contract() -> None:
    """The paper's learner and the controls are Learners."""
    rng = np.random.default_rng(0)
    learners = (HebbianLearner(ROBOT, rng), RandomGaze(ROBOT, rng), NearestGaze(ROBOT, rng), FixedGaze([0, 0]))
    assert all(isinstance(learner, Learner) for learner in learners)


RISING = arrays(float, (3, 2), elements=st.floats(-10, 10)).map(lambda limits: np.sort(limits, axis=1))


@given(RISING.filter(lambda limits: (limits[:, 0] < limits[:, 1]).all()))
def test_limits_are_given_back(limits: np.ndarray) -> None:
    """What the scale was made from can be asked for again, in the same order and unit."""
    assert Scale(limits).limits == pytest.approx(limits, abs=1e-12)


class Sorting(Plastic):
    """A learner of two parts."""

    parts = frozenset({"sieve", "bin"})


def test_all_parts_learn_at_first() -> None:
    """Before anybody says otherwise, what can learn does; a learner without parts has none that learns."""
    assert Sorting().plastic == {"sieve", "bin"}
    assert Plastic().plastic == Plastic().parts == frozenset()


def test_what_is_plastic_is_said_of_one_learner() -> None:
    """Another of its class, and its class, are not touched; any iterable will do, and what was given is copied."""
    one, other, given = Sorting(), Sorting(), {"bin"}
    one.plastic = given  # type: ignore[assignment]
    given.clear()
    assert one.plastic == frozenset({"bin"}) and isinstance(one.plastic, frozenset)
    assert other.plastic == Sorting().plastic == Sorting.parts == {"sieve", "bin"}
    one.plastic = ()  # type: ignore[assignment]
    assert one.plastic == frozenset()


def test_a_part_that_does_not_exist_is_refused_with_those_that_do() -> None:
    """The name and the valid ones are in the message, and what was plastic stays."""
    learner = Sorting()
    learner.plastic = frozenset({"bin"})
    with pytest.raises(ValueError, match=r"no part 'links' that learns; its parts: bin, sieve\."):
        learner.plastic = frozenset({"sieve", "links"})
    assert learner.plastic == {"bin"}
    with pytest.raises(ValueError, match=r"no part 'links' that learns; its parts: none\."):
        Plastic().plastic = frozenset({"links"})


def test_a_simple_learner_has_nothing_to_record() -> None:
    """No columns, so no probes, and no maps; two learners share no dictionary."""
    learner = Sorting()
    assert (tuple(learner.columns), learner.probes(), learner.maps()) == ((), {}, {})
    learner.maps()["mine"] = 1
    assert Sorting().maps() == learner.maps() == {}
