"""Angles to [0, 1] units and back, and the contract of learners."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from somatopy.learners import FixedGaze, HebbianLearner, Learner, RandomGaze, Scale

LIMITS = np.array([[-2.0857, 2.0857], [-0.3142, 1.3265]])
HEAD = [[-2.0, 2.0], [-0.6, 0.5]]


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


def test_all_learners_keep_the_contract() -> None:
    """The paper's learner and the controls are Learners."""
    rng = np.random.default_rng(0)
    learners = (HebbianLearner(LIMITS, HEAD, (320, 240), rng), RandomGaze(HEAD, rng), FixedGaze([0, 0]))
    assert all(isinstance(learner, Learner) for learner in learners)
