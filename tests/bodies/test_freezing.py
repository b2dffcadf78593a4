"""Joints that go away: what is left moves and weighs as before, and nothing refers to what is gone."""

from __future__ import annotations

from collections.abc import Collection

import mujoco
import numpy as np
import pytest

from somatopy.bodies.freezing import freeze
from somatopy.bodies.parts import name_all

# Degrees, Euler angles, frames around bodies and joints, references, several joints in a body, a free base, a ball.
ODD = """
<mujoco>
  <compiler angle="degree" eulerseq="zyx"/>
  <default><joint damping="1" limited="true" range="-90 90"/><geom type="capsule" size=".03 .1" mass=".3"/></default>
  <worldbody>
    <geom type="plane" size="5 5 .1"/>
    <frame pos=".2 .1 0" euler="20 30 40">
      <body name="base" pos="0 0 1" euler="10 0 0">
        <joint name="root" type="free" limited="false"/>
        <geom name="base"/>
        <frame pos="0 .05 .1" axisangle="1 2 3 40">
          <body name="upper" pos=".1 0 .2" xyaxes="0 1 0 1 0 .3">
            <joint name="a" axis="1 0 0" pos="0 .02 .01" ref="15"/>
            <frame pos=".01 0 .03" euler="0 70 0"><joint name="b" axis="0 1 0" pos=".02 0 0"/></frame>
            <joint name="c" type="slide" axis="0 .6 .8" range="-.2 .2" ref=".05"/>
            <joint name="d" axis="0 0 1" pos="0 0 .1" springref="5" stiffness="2"/>
            <geom name="upper"/>
            <body name="lower" pos="0 0 .3">
              <joint name="e" type="ball" limited="false" pos=".01 .02 .03"/>
              <geom name="lower"/>
              <body name="tip" pos="0 .1 .2" euler="5 6 7">
                <joint name="f" axis="1 1 0"/><geom name="tip"/><site name="tip" pos="0 0 .1"/>
              </body>
            </body>
          </body>
        </frame>
      </body>
    </frame>
  </worldbody>
</mujoco>
"""


def frozen(
    spec: mujoco.MjSpec, joints: Collection[str], posture: np.ndarray | None = None, driven: Collection[str] = ()
) -> tuple[mujoco.MjModel, mujoco.MjData, mujoco.MjModel]:
    """The model before, a posture of it, and the model in which these joints have gone away in that posture."""
    name_all(spec)
    before = spec.compile()
    data = mujoco.MjData(before)
    if posture is not None:
        mujoco.mj_integratePos(before, data.qpos, posture, 1.0)
    mujoco.mj_kinematics(before, data)
    freeze(spec, before, data, joints, driven)
    return before, data, spec.compile()


@pytest.mark.parametrize(
    "joints", ["root", "b", "ac", "bd", "e", ("root", "a", "d", "e"), ("root", "b", "c", "e"), "abcdef"]
)
def test_what_is_left_moves_and_weighs_as_before(joints: str | tuple[str, ...]) -> None:
    """In any posture of the joints that stay, bodies, inertia and load are those of the whole model."""
    rng, names = np.random.default_rng(len(joints)), {joints} if joints == "root" else set(joints)
    spec = mujoco.MjSpec.from_string(ODD)
    before, data, after = frozen(spec, names, rng.normal(0, 0.5, 14))
    assert {after.joint(k).name for k in range(after.njnt)} == {"root", *"abcdef"} - names
    second = mujoco.MjData(after)
    for _ in range(3):
        for joint in (before.joint(k) for k in range(before.njnt)):
            if joint.name not in names and joint.type[0] in (2, 3):
                data.joint(joint.name).qpos = rng.uniform(-1, 1)
        for k in range(after.njnt):
            second.joint(after.joint(k).name).qpos = data.joint(after.joint(k).name).qpos
        mujoco.mj_forward(before, data)
        mujoco.mj_forward(after, second)
        assert np.allclose(second.xpos, data.xpos, atol=1e-9) and np.allclose(second.xmat, data.xmat, atol=1e-9)
        kept = [d for d in range(before.nv) if before.joint(before.dof_jntid[d]).name not in names]
        assert np.allclose(mass(after, second), mass(before, data)[np.ix_(kept, kept)], atol=1e-9)
        assert np.allclose(second.qfrc_bias, data.qfrc_bias[kept], atol=1e-9)
        assert np.allclose(second.qfrc_passive, data.qfrc_passive[kept], atol=1e-9)


def mass(model: mujoco.MjModel, data: mujoco.MjData) -> np.ndarray:
    full = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, full)
    return full


LINKED = """
<mujoco>
  <worldbody>
    <body name="one"><joint name="p"/><geom size=".1"/>
      <body name="two" pos="0 0 .5"><joint name="q"/><geom size=".1"/><joint name="r" axis="1 0 0"/></body>
    </body>
    <body name="three" pos="1 0 0"><joint name="s"/><geom size=".1"/><joint name="t" axis="1 0 0"/></body>
  </worldbody>
  <tendon>
    <fixed name="pq"><joint joint="p" coef="1"/><joint joint="q" coef="1"/></fixed>
    <fixed><joint joint="q" coef="1"/></fixed>
    <fixed name="st"><joint joint="s" coef="1"/><joint joint="t" coef="1"/></fixed>
  </tendon>
  <equality>
    <joint name="ps" joint1="p" joint2="s"/><joint name="st" joint1="s" joint2="t"/><joint name="p" joint1="p"/>
    <tendon name="ties" tendon1="pq" tendon2="st"/>
  </equality>
  <actuator>
    <motor name="p" joint="p"/><motor joint="q"/><motor name="s" joint="s"/>
    <motor name="pq" tendon="pq"/><motor name="st" tendon="st"/>
  </actuator>
  <sensor>
    <jointpos name="p" joint="p"/><jointvel name="s" joint="s"/><tendonpos name="pq" tendon="pq"/>
    <actuatorfrc name="motor of p" actuator="p"/><actuatorfrc name="motor of s" actuator="s"/>
    <framepos name="two" objtype="body" objname="two"/>
  </sensor>
  <custom>
    <tuple name="with"><element objtype="joint" objname="p"/></tuple>
    <tuple name="without"><element objtype="joint" objname="s"/></tuple>
  </custom>
</mujoco>
"""


def test_all_that_refers_to_them_goes_and_nothing_else() -> None:
    """Tendons, their motors, sensors of any of these, equalities and tuples."""
    spec = mujoco.MjSpec.from_string(LINKED)
    frozen(spec, ["p", "q"])
    left = {
        kind: [thing.name for thing in getattr(spec, kind)]
        for kind in ("joints", "tendons", "equalities", "actuators", "sensors", "tuples")
    }
    assert left == {
        "joints": ["r", "s", "t"],
        "tendons": ["st"],
        "equalities": ["ps", "st"],
        "actuators": ["s", "st"],
        "sensors": ["s", "motor of s", "two"],
        "tuples": ["without"],
    }


def test_joint_tied_to_one_that_goes_is_held_unless_it_is_driven() -> None:
    """A finger that mimics a frozen one stays where that one holds it; an arm's joint obeys its servo alone."""
    spec = mujoco.MjSpec.from_string(LINKED)
    _, start, after = frozen(spec, ["p", "q", "t"], np.full(5, 0.4))
    data = mujoco.MjData(after)
    data.joint("s").qpos = start.joint("s").qpos
    data.joint("s").qvel = 1.0
    mujoco.mj_step(after, data, 500)
    assert abs(data.joint("s").qpos[0] - 0.4) < 1e-3
    spec = mujoco.MjSpec.from_string(LINKED)
    assert frozen(spec, ["p", "q", "t"], driven=["s"])[2].neq == 0


LOOP = """
<mujoco>
  <option gravity="0 0 0"/>
  <worldbody>
    <body name="left"><joint name="a" axis="0 1 0"/><geom type="capsule" fromto="0 0 0 0 0 1" size=".02"/>
      <body name="top" pos="0 0 1"><joint name="b" axis="0 1 0"/>
        <geom type="capsule" fromto="0 0 0 1 0 0" size=".02"/>
        <body name="pin" pos=".5 0 0"><joint name="e" axis="0 1 0"/><geom size=".02"/></body></body></body>
    <body name="right" pos="1 0 0"><joint name="c" axis="0 1 0"/>
      <geom type="capsule" fromto="0 0 0 0 0 1" size=".02"/><body name="cap" pos="0 0 1"><joint name="d"
      axis="0 1 0"/><geom size=".03"/></body></body>
  </worldbody>
  <contact><exclude body1="top" body2="right"/><exclude body1="top" body2="cap"/></contact>
  <equality>%s</equality>
</mujoco>
"""


@pytest.mark.parametrize(
    "tie",
    ['<connect body1="top" body2="right" anchor="1 0 0"/>', '<weld body1="cap" body2="top"/>'],
    ids=["connect", "weld"],
)
def test_loop_stays_closed_in_the_posture_where_joints_froze(tie: str) -> None:
    """A parallelogram that leans is closed, and stays so, when a joint in it goes."""
    spec = mujoco.MjSpec.from_string(LOOP % tie)
    lean = np.array([0.3, -0.3, 0.0, 0.3, -0.3])
    _, start, after = frozen(spec, ["b"], lean)
    assert after.neq == 1
    data = mujoco.MjData(after)
    for k in range(after.njnt):
        data.joint(k).qpos = start.joint(after.joint(k).name).qpos
    mujoco.mj_forward(after, data)
    assert np.abs(data.efc_pos[: data.ne]).max() < 1e-9
    spec = mujoco.MjSpec.from_string(LOOP % tie)
    assert frozen(spec, "abcde", lean)[2].neq == 0, "what holds fixed bodies together is of no use"


def test_fixed_neighbours_do_not_begin_to_collide() -> None:
    """MuJoCo lets a body pass through the one it hangs on, unless that one stands in the room."""
    spec = mujoco.MjSpec.from_string(
        '<mujoco><worldbody><geom type="plane" size="1 1 1"/><body name="trunk" pos="0 0 .3"><freejoint name="root"/>'
        '<geom size=".1"/><body name="arm" pos=".1 0 0"><joint name="j"/><geom size=".1"/><body name="hand" pos="0 0 '
        '-.25"><joint name="k"/><geom size=".07"/></body></body></body></worldbody></mujoco>'
    )
    before, start, after = frozen(spec, ["root"])
    data = mujoco.MjData(after)
    mujoco.mj_forward(before, start)
    mujoco.mj_forward(after, data)
    assert [tuple(pair) for pair in data.contact.geom] == [tuple(pair) for pair in start.contact.geom]
    assert data.ncon == 1, "the hand still touches the floor"


def test_slack_of_a_tendon_stays() -> None:
    """A spring between two bodies is as long at rest as it was, although the reference posture is another."""
    spec = mujoco.MjSpec.from_string(
        '<mujoco><worldbody><site name="wall" pos="1 0 0"/><body><joint name="j"/><geom size=".1"/><body pos="0 .5 0">'
        '<joint name="k"/><geom size=".1"/><site name="end"/></body></body></worldbody><tendon><spatial stiffness="5">'
        '<site site="wall"/><site site="end"/></spatial></tendon></mujoco>'
    )
    before, start, after = frozen(spec, ["j"], np.array([1.0, 0.2]))
    data = mujoco.MjData(after)
    data.qpos[0] = start.joint("k").qpos[0]
    mujoco.mj_forward(before, start)
    mujoco.mj_forward(after, data)
    assert abs(data.joint("k").qfrc_passive[0] - start.joint("k").qfrc_passive[0]) < 1e-9
    assert np.allclose(after.tendon_lengthspring, before.tendon_lengthspring)
