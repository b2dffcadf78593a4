"""Proposals are tried: a head that never sees the hand gives way to a neck, and the range is where the hand is seen."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from somatopy.bodies import MODELS, MujocoBody
from somatopy.experiment.ceiling import Vantages, reachable
from somatopy.experiment.proposing import proposed

NAO = MODELS["nao"].with_name("nao.xml")


def test_a_head_that_never_sees_gives_way_to_a_neck(tmp_path: Path) -> None:
    """NAO's cameras, their fields of view so narrow that no tag fits into a picture."""
    text = NAO.read_text().replace('fovy="47.64"', 'fovy=".5"')
    (tmp_path / "nao.xml").write_text(text)
    blind, seeing = proposed(tmp_path / "nao.xml"), proposed(NAO)
    assert seeing.proposal.neck is None and seeing.anatomy.head.joints == ("HeadYaw", "HeadPitch")
    assert blind.proposal.neck is not None and blind.anatomy.head.joints == ("neck_pan", "neck_tilt")
    for found in (blind, seeing):
        body = MujocoBody(found.anatomy, motion="kinematic")
        arms = np.random.default_rng(3).uniform(*body.ranges["confined"].T, (60, len(body.arm)))
        assert reachable(Vantages.of(body, (25, 9)), arms).mean() > 0.6
        body.close()
