"""The laws of maps, tried on any implementation."""

from __future__ import annotations

import warnings

from sklearn import config_context
from sklearn.exceptions import ConvergenceWarning

from somatopy.contract import law
from somatopy.maps.base import Map
from somatopy.maps.check import keeping, learning, looking
from somatopy.maps.check.trials import Make, Maps, state_of

__all__ = ["check_map"]

_PARAMETERS = ("dtype", "missing", "random_state")
_LAWS = (
    learning.runs,
    looking.shows_nothing_before_it_starts,
    keeping.draws_from_its_seed,
    learning.owns_its_inputs,
    learning.learns_in_any_pieces,
    learning.returns_the_winner_before_the_update,
    looking.agrees_on_the_nearest,
    learning.finds_what_it_has_learned,
    looking.takes_the_first_of_equals,
    looking.ranks_as_it_chooses,
    looking.joins_what_is_there,
    looking.looks_without_changing,
    learning.refuses_before_anything_changes,
    keeping.starts_anew,
    keeping.refuses_states_that_do_not_fit,
    keeping.goes_on_from_files_and_copies,
    keeping.goes_on_from_states,
    learning.learns_around_gaps,
    learning.returns_the_winner_of_gaps_too,
    learning.moves_only_what_was_observed,
    learning.learns_tables,
    learning.computes_as_precisely_as_asked,
    learning.keeps_its_precision,
    keeping.stays_small,
)


def check_map(make: Make) -> None:
    """Check that a map keeps its contract, scikit-learn's for estimators and transformers included.

    It is tried with both values of `missing` and in both precisions, on inputs between 0 and 1. A small map is checked
    as well as a large one, and faster: in about a second. A map that grows has the parameter `max_units`.

    Args:
        make: a fresh map that has learned nothing. A class that needs no arguments will do.

    Raises:
        ContractError: it breaks a law; the message says which, what was seen and how to fix it.

    Example:
        >>> from somatopy.maps import DSOM
        >>> check_map(lambda: DSOM(shape=(4, 3)))
    """
    with config_context(transform_output="default"), warnings.catch_warnings():
        warnings.simplefilter("ignore", ConvergenceWarning)  # few inputs are learned, again and again
        _is_a_map(make)
        maps = Maps(make)
        for keeps in _LAWS:
            keeps(maps)
        _is_an_estimator(make)


def _is_a_map(make: Make) -> None:
    with law(
        "it has all members and parameters of Map", "derive it from somatopy.maps.Map; its docstring says"
    ) as holds:
        first, second = make(), make()
        lacks = [name for name in vars(Map) if not name.startswith("_") and not hasattr(type(first), name)]
        lacks += [name for name in _PARAMETERS if not lacks and name not in first.get_params()]
        holds(not lacks, "{} lacks {}", type(first).__name__, ", ".join(lacks))
    with law("make() gives a fresh map each time", "start nothing in __init__, and make a new one in make") as holds:
        holds(first is not second and state_of(first) is None, "the same map twice, or one that has learned")


def _is_an_estimator(make: Make) -> None:
    from sklearn.utils.estimator_checks import check_estimator

    with law("it is an estimator and a transformer of scikit-learn", "see what its check_estimator says"):
        check_estimator(make(), on_skip=None)
