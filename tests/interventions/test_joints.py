"""What damages of the arm share: joints by name or number, units, and directions drawn at random."""

from __future__ import annotations

import numpy as np
import pytest
from tests.interventions.damages import ARM

from somatopy.interventions.joints import drawn, numbered, scale


def test_a_joint_is_named_or_numbered() -> None:
    """Both mean the same; what is neither is refused with all valid ones."""
    assert numbered(ARM, ["yaw", 0, "lift", 1]) == [2, 0, 3, 1]
    for wrong in ("elbow", 4, -1):
        message = rf"no joint {wrong!r}; name one of its joints or its number: pitch \(0\), roll \(1\), yaw \(2\), "
        with pytest.raises(ValueError, match=message):
            numbered(ARM, [0, wrong])


def test_directions_are_drawn_evenly_and_have_the_norm() -> None:
    """In units of 1 rad and of a slide's range, over 400 draws: mean 0, equal shares of the squared length."""
    shifts = np.array([drawn(ARM, 0.8, 0, draw) for draw in range(400)]) / scale(ARM)
    assert scale(ARM).tolist() == [1, 1, 1, 0.1]
    assert np.allclose(np.linalg.norm(shifts, axis=1), 0.8)
    assert np.abs(shifts.mean(axis=0)).max() < 4 * 0.4 / 20
    assert np.allclose((shifts**2).mean(axis=0), 0.64 / 4, atol=0.04)


def test_a_direction_depends_on_seed_and_draw_alone() -> None:
    """The same again, another one with another seed or draw, and of any norm the same direction."""
    shift = drawn(ARM, 0.3, 7, 2)
    assert np.array_equal(shift, drawn(ARM, 0.3, 7, 2))
    assert np.allclose(drawn(ARM, 1.7, 7, 2) / 1.7, shift / 0.3)
    for seed, draw in ((8, 2), (7, 3), (2, 7)):
        assert not np.allclose(drawn(ARM, 0.3, seed, draw), shift)
