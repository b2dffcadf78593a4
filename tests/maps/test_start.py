"""Start codes, and parameters that fade."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from somatopy.maps.start import (
    Fading,
    check_number,
    check_units,
    faded,
    fading,
    fading_rule,
    remembered,
    start_codes,
)


def drawn(init: Any = "uniform", bounds: Any = (0, 1), units: int = 500, dims: int = 2) -> Any:
    return start_codes(init, bounds, units, dims, np.random.default_rng(0))


@pytest.mark.parametrize("bounds", [(-3.0, 5.0), [[-2.0, -1.0], [0.0, 10.0]], np.array([[0, 1], [5, 6]])])
def test_drawn_codes_fill_their_bounds(bounds: Any) -> None:
    """Each dimension is drawn from its own range, evenly: all within it, and in each tenth of it about a tenth."""
    codes = drawn(bounds=bounds)
    low, high = np.broadcast_to(np.asarray(bounds, float), (2, 2)).T
    tenths = np.floor((codes - low) / (high - low) * 10)
    assert codes.shape == (500, 2)
    assert ((tenths >= 0) & (tenths < 10)).all()
    counts = np.array([[(tenths[:, k] == tenth).sum() for tenth in range(10)] for k in range(2)])
    assert (counts > 20).all()  # 50 expected, 6.7 their standard deviation


def test_drawn_codes_follow_the_generator() -> None:
    """One state of it, one codebook."""
    np.testing.assert_array_equal(drawn(), drawn())
    assert not np.array_equal(drawn(), start_codes("uniform", (0, 1), 500, 2, np.random.default_rng(1)))


def test_given_codes_are_copied() -> None:
    """Writing to what start_codes gives leaves the array of the user alone."""
    given_codes = np.zeros((500, 2))
    drawn(given_codes)[:] = 1.0
    assert not given_codes.any()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"init": "pca"}, r"init must be 'uniform' or an array \(units, dims\); got 'pca'"),
        ({"init": np.zeros((499, 2))}, r"init must have shape \(units, dims\), \(500, 2\) here; got \(499, 2\)"),
        ({"init": np.zeros(1000)}, r"got \(1000,\)"),
        ({"init": np.full((500, 2), np.nan)}, "init must be finite"),
        ({"bounds": (1, 0)}, r"bounds must be finite \(low, high\) with low < high.*got \(1, 0\)"),
        ({"bounds": (1, 1)}, "low < high"),
        ({"bounds": (0, np.inf)}, "bounds must be finite"),
        ({"bounds": [[0, 1]] * 3}, r"shape \(2, 2\)"),
        ({"bounds": 1.0}, "bounds must be finite"),
        ({"bounds": "wide"}, "bounds must be finite.*got 'wide'"),
        ({"bounds": [[0, 1], [2]]}, r"bounds must be finite.*got \[\[0, 1\], \[2\]\]"),
        ({"init": [[0.0, 1.0], [2.0]]}, r"init must have shape \(units, dims\), \(500, 2\) here"),
        ({"init": None}, r"init must have shape \(units, dims\)"),
    ],
)
def test_codes_and_bounds_that_do_not_fit_are_refused_by_name(arguments: dict[str, Any], message: str) -> None:
    """The message has what is valid, and what was given."""
    with pytest.raises(ValueError, match=message):
        drawn(**arguments)


@pytest.mark.parametrize(
    ("value", "pair"), [(0.5, (0.5, 0.5)), ((0.5, 0.1), (0.5, 0.1)), ([1, 2], (1.0, 2.0)), (np.float32(2), (2, 2))]
)
def test_what_fades_is_a_number_or_a_pair(value: Any, pair: tuple[float, float]) -> None:
    """One number is a pair of equal ones."""
    assert fading("width", value) == pair


@pytest.mark.parametrize("value", [0, -1.0, np.nan, np.inf, (1.0,), (1.0, 0.0), (1, 2, 3), "wide", None, (1, "a"), {}])
def test_what_cannot_fade_is_refused_by_name(value: Any) -> None:
    """The message has the name and what is valid."""
    with pytest.raises(ValueError, match=r"width must be a finite number over 0, or a pair \(first, last\) of such"):
        fading("width", value)


def test_what_fades_has_its_limit() -> None:
    """Learning rates are at most 1, both of them."""
    assert fading("learning_rate", (1, 0.5), most=1) == (1.0, 0.5)
    for value in (1.5, (0.5, 1.5)):
        with pytest.raises(ValueError, match=r"learning_rate must be a finite number over 0 and at most 1, or a pair"):
            fading("learning_rate", value, most=1)


@given(st.floats(1e-3, 1e3), st.floats(1e-3, 1e3), st.floats(1, 1e6), st.floats(0, 2e6), st.floats(0, 2e6))
def test_fading_goes_one_way_between_its_ends(first: float, last: float, horizon: float, a: float, b: float) -> None:
    """At 0 it is the first value, from the horizon on the last, and it never turns."""
    assert faded(first, last, 0.0, horizon) == pytest.approx(first)
    assert faded(first, last, horizon, horizon) == faded(first, last, 2 * horizon, horizon) == pytest.approx(last)
    early, late = sorted((a, b))
    towards = np.sign(last - first)
    assert towards * (faded(first, last, late, horizon) - faded(first, last, early, horizon)) >= -1e-9 * max(
        first, last
    )


def test_half_way_fading_is_at_the_geometric_mean() -> None:
    """From 4 to 1 it is 2."""
    assert faded(4.0, 1.0, 50.0, 100.0) == pytest.approx(2.0)


def test_a_schedule_has_both_pairs_and_the_horizon() -> None:
    """In the order in which the kernels read them."""
    assert fading_rule((0.5, 0.1), 3, 100) == Fading(0.5, 0.1, 3.0, 3.0, 100.0)
    for arguments, name in (((2.0, 3, 100), "learning_rate"), ((0.5, 0, 100), "width"), ((0.5, 3, 0), "horizon")):
        with pytest.raises(ValueError, match=f"{name} must be a finite number over 0"):
            fading_rule(*arguments)


def test_what_is_remembered_is_told_apart_by_value_and_type() -> None:
    """Equal values of one type are asked once, 1 and True are two, and what can change in place is asked each time."""
    asked: list[object] = []

    @remembered
    def kind(value: object) -> str:
        asked.append(value)
        return f"{type(value).__name__} {value}"

    values: list[object] = [1, 1, True, 1.0, (1, 2), (1, 2)]
    expected = ["int 1", "int 1", "bool True", "float 1.0", *["tuple (1, 2)"] * 2]
    assert [kind(value) for value in values] == expected
    assert len(asked) == 4
    changing = [1, 2]
    assert kind(changing) == "list [1, 2]"
    changing[0] = 7
    assert kind(changing) == "list [7, 2]"


def test_a_refusal_is_not_remembered() -> None:
    """What raised an error raises it again."""
    for _ in range(2):
        with pytest.raises(ValueError, match="horizon must be a finite number over 0; got -1"):
            fading_rule(0.5, 3, -1)


@pytest.mark.parametrize("value", [0, -1, np.nan, np.inf, "1", None, [1], np.ones(2), 1j, 2])
def test_numbers_out_of_range_are_refused_by_name(value: Any) -> None:
    """The message has the name, the range and the value."""
    with pytest.raises(ValueError, match=r"rate must be a finite number over 0 and at most 1; got "):
        check_number("rate", value, most=1)


@pytest.mark.parametrize("value", [0, 1, -1, 2.0, "2", None, True, np.inf])
def test_what_is_no_number_of_units_is_refused_by_name(value: Any) -> None:
    """The message has the name, the least and the value."""
    with pytest.raises(ValueError, match=r"units must be a whole number, at least 2; got "):
        check_units("units", value, least=2)


def test_good_numbers_pass() -> None:
    """NumPy's too."""
    check_number("rate", np.float32(0.5), most=1)
    check_units("units", np.int32(2), least=2)
