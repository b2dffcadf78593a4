"""The text of a proposal: TOML that says what the proposal says, whatever the names are."""

from __future__ import annotations

import tomllib
from dataclasses import replace
from typing import Any

import pytest

from somatopy.bodies import Anatomy
from somatopy.bodies.anatomy_text import anatomy_text
from somatopy.bodies.proposal import Eye, Group, Neck, Proposal
from somatopy.bodies.survey import Chain

ARM = Group(
    ("robot0:pan joint", 'the "elbow"', "wrist/left"), (3.0, 3.0, 0.5), ((-1.5, 1.5), (-1.0, 0.25), (-0.2, 0.2))
)
PROPOSAL = Proposal(
    name="Käthe",
    model="models/käthe.xml",
    home="stand",
    arm=ARM,
    head=Group(("neck_pan", "neck_tilt"), (3.0, 3.0)),
    neck=Neck("world", (0.1, -0.2, 1e-5), (0.6, 0.8, 0.0), (0.0, 0.0, 1.0), ((-1.5, 1.5), (-0.2, 1.5))),
    eye=Eye("eye", 640, 480, 47.64, added=True),
    marker="hand",
    position=(0.0, 0.05, 0.0),
    axis=(0.0, 1.0, 0.0),
    floats=True,
    others=3,
    servos=ARM.joints,
    other_arms=(Chain(("a", "b"), "trunk", "r_hand", ("r_hand",), 0.5, 3.0),),
    other_cameras=("top",),
    ranges={"confined": ((-1.0, 1.0), (-0.5, 0.2), (-0.1, 0.1))},
    posture={"wrist/left": 0.05},
)
SERVOS = {name: {"kp": 20.0, "kv": 1.25, "force": 12.5} for name in ARM.joints}


def read(text: str) -> dict[str, Any]:
    return tomllib.loads(text)


def test_it_says_what_the_proposal_says() -> None:
    """Every value, names with blanks, quotes and umlauts included; and it is an anatomy."""
    table = read(anatomy_text(PROPOSAL, SERVOS))
    assert Anatomy.model_validate(table).add.neck is not None
    assert (table["name"], table["model"], table["home"]) == (PROPOSAL.name, PROPOSAL.model, PROPOSAL.home)
    assert tuple(table["arm"]["joints"]) == ARM.joints and table["arm"]["limits"] == [
        [-1.5, 1.5],
        [-1, 0.25],
        [-0.2, 0.2],
    ]
    assert table["marker"] == {"body": "hand", "position": [0, 0.05, 0], "axis": [0, 1, 0]}
    assert table["add"]["servos"] == SERVOS and table["add"]["fixed_base"] is True and table["add"]["freeze"] == "rest"
    assert table["add"]["neck"]["position"] == [0.1, -0.2, 1e-5] and table["add"]["camera"] == {"fovy": 47.64}
    assert table["posture"] == PROPOSAL.posture and table["ranges"]["confined"][1] == [-0.5, 0.2]


def test_what_need_not_be_added_is_not_said() -> None:
    """A model with all that it takes has no table [add]."""
    plain = replace(PROPOSAL, neck=None, eye=Eye("cam", 320, 240, 60.0), floats=False, others=0, posture={}, home=None)
    table = read(anatomy_text(plain))
    assert not {"add", "posture", "home"} & set(table) and table["camera"]["name"] == "cam"


@pytest.mark.parametrize("kept", ["r_hand", "top"])
def test_alternatives_are_comments(kept: str) -> None:
    """Other arms and cameras are there for who looks for them, and change nothing."""
    text, bare = (anatomy_text(p) for p in (PROPOSAL, replace(PROPOSAL, other_arms=(), other_cameras=())))
    assert any(line.startswith("#") and kept in line for line in text.splitlines())
    assert read(text) == read(bare)
