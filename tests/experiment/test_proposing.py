"""Proposals are tried: a head that never sees the hand gives way to a neck, and the range is where the hand is seen."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from somatopy.bodies import MODELS, MujocoBody
from somatopy.experiment.ceiling import Vantages, reachable
from somatopy.experiment.proposing import proposed

ARM = """<mujoco><compiler angle="radian"/><worldbody><body name="upper_arm"><geom size=".02"/>
  <joint name="lift" axis="0 1 0" range="0 .0004"/><body name="hand" pos=".2 0 0"><geom size=".02"/>
  <joint name="turn" axis="0 0 1" range="-1 1"/></body></body></worldbody></mujoco>"""
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


def test_a_joint_that_hardly_moves_has_a_range_inside_its_limits(tmp_path: Path) -> None:
    """Rounding leaves it room; other joints have three digits."""
    (tmp_path / "arm.xml").write_text(ARM)
    anatomy = proposed(tmp_path / "arm.xml").anatomy
    (low, high), turn = anatomy.ranges["confined"]
    assert 0 <= low < high <= 0.0004 and low <= anatomy.posture["lift"] <= high
    assert list(turn) == np.round(turn, 3).tolist()
