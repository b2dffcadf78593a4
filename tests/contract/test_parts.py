"""What a part can do is asked of its members, not of its class."""

from __future__ import annotations

import inspect
from types import SimpleNamespace
from typing import Any

import pytest

from somatopy import contract
from somatopy.bodies import MujocoBody
from somatopy.contract import (
    Babbler,
    Believing,
    Body,
    Eye,
    Intervention,
    Learner,
    Posable,
    Recorded,
    Resumable,
    Shuffles,
    Twin,
    missing_members,
)
from somatopy.interventions import NoIntervention
from somatopy.learners import HebbianLearner, NearestGaze

ASKED = (Babbler, Believing, Body, Eye, Intervention, Learner, Posable, Recorded, Resumable, Shuffles, Twin)


def thing(protocol: type, without: str = "") -> Any:
    """Something that has the members of a contract, but one, and nothing else."""
    names = [name for name in members(protocol) if name != without]
    return SimpleNamespace(**dict.fromkeys(names, lambda *_: None))


def members(protocol: type) -> list[str]:
    found = {name for base in protocol.__mro__ for name in {*vars(base), *getattr(base, "__annotations__", {})}}
    return sorted(name for name in found if not name.startswith("_"))


@pytest.mark.parametrize("protocol", ASKED)
def test_whoever_has_the_members_keeps_the_contract(protocol: type) -> None:
    """Nobody derives from it; with one member less, it is another thing."""
    assert isinstance(thing(protocol), protocol)
    for name in members(protocol):
        assert not isinstance(thing(protocol, without=name), protocol)


@pytest.mark.parametrize("protocol", ASKED)
def test_contracts_say_what_each_member_is_for(protocol: type) -> None:
    """Every method, and the contract itself."""
    assert protocol.__doc__
    for name in members(protocol):
        member = inspect.getattr_static(protocol, name, None)
        assert member is None or inspect.getdoc(member), f"{protocol.__name__}.{name} says nothing"


def test_a_device_is_not_its_model() -> None:
    """A body that is reset, stepped and closed is one: neither state nor twin nor picture is asked of it."""
    device = thing(Body)
    assert isinstance(device, Body)
    assert not any(isinstance(device, ability) for ability in (Resumable, Twin, Posable, Recorded))


def test_a_simulation_can_be_resumed_posed_and_asked() -> None:
    """The MuJoCo body has all abilities."""
    body = MujocoBody("nao", motion="kinematic")
    assert all(isinstance(body, ability) for ability in (Body, Resumable, Twin, Posable))
    body.close()


def test_links_can_be_shuffled_and_memories_cannot() -> None:
    """What an intervention asks before it shuffles."""
    assert issubclass(HebbianLearner, Shuffles) and not issubclass(NearestGaze, Shuffles)


def test_interventions_and_learners_are_recorded() -> None:
    """They have columns and probes, be it none."""
    assert isinstance(NoIntervention(), Recorded) and isinstance(thing(Learner), Recorded)


def test_members_of_a_contract_are_its_own() -> None:
    """What is missing from an empty thing is all that the contract names."""
    for protocol in (Babbler, Body, Eye, Intervention, Learner, Twin):
        assert missing_members(object(), protocol) == members(protocol)
    assert missing_members(object(), Posable) == members(Posable)


def test_all_contracts_are_public() -> None:
    """What a user implements can be imported from one place."""
    assert {protocol.__name__ for protocol in ASKED} <= set(contract.__all__)
