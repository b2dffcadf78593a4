"""A model cut into parts: what can be parted, that parts move as the whole does, and that heads do not move arms."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest

from somatopy.bodies import MujocoBody, check_body
from somatopy.bodies.constants import Watch
from somatopy.bodies.limits import hold_inside
from somatopy.percept import Floats

Robot = Callable[..., Path]
POST, TILT = '<body name="post" pos="0 0 .5">', '<position joint="tilt" kp="20" kv="1"/>'
END = "</worldbody>"
#: Changes of the crane by which its arm and its head depend on each other.
COUPLED = {
    "a moving post": (POST, POST + '<joint name="sway" axis="0 1 0"/><geom size=".05" mass="1"/>'),
    "a free base": (POST, POST + '<freejoint/><geom size=".05" mass="1"/>'),
    "an equality": (END, END + '<equality><joint joint1="lift" joint2="pan"/></equality>'),
    "a tendon": (
        END,
        f'{END}<tendon><fixed name="rope"><joint joint="lift" coef="1"/><joint joint="pan" coef="1"/></fixed></tendon>',
    ),
    "something both can touch": (END, f'<body pos="2 0 1"><freejoint/><geom size=".1" mass="1"/></body>{END}'),
}
#: A shape that is only drawn, and heavy.
HEAVY = '<geom type="box" size=".02 .02 .02" mass=".3" contype="0" conaffinity="0"/>'


def random_targets(body: MujocoBody, seed: int, frames: int) -> list[tuple[Floats, Floats]]:
    """Each held for some frames, up to a little beyond the limits."""
    rng, targets = np.random.default_rng(seed), []
    for frame in range(frames):
        if frame % 25 == 0:
            arm = rng.uniform(body.arm.lower - 0.1, body.arm.upper + 0.1)
        if frame % 5 == 0:
            head = rng.uniform(body.head.lower - 0.1, body.head.upper + 0.1)
        targets.append((arm, head))
    return targets


class Whole:
    """A body's model, stepped in one piece."""

    def __init__(self, body: MujocoBody) -> None:
        names = (*body.arm.names, *body.head.names)
        self.model, self.data = body.model, mujoco.MjData(body.model)
        joints = [self.model.joint(name).id for name in names]
        self.places, self.dofs = (
            adr[joints].astype(np.int64) for adr in (self.model.jnt_qposadr, self.model.jnt_dofadr)
        )
        self.servos = [int(np.flatnonzero(self.model.actuator_trnid[:, 0] == joint)[0]) for joint in joints]
        ends = ([*getattr(body.arm, end), *getattr(body.head, end)] for end in ("lower", "upper", "velocity"))
        self.ends = [np.array(values) for values in ends]
        body.reset()
        self.data.qpos[:], self.data.ctrl[:] = body.data.qpos, body.data.ctrl
        self.data.act[self.model.actuator_actadr[self.servos]] = body.data.qpos[self.places]

    def step(self, before: Floats, after: Floats) -> Floats:
        """A frame in which set-points go from `before` to `after`."""
        self.data.ctrl[self.servos] = (after - before) * 15
        self.data.act[self.model.actuator_actadr[self.servos]] = before
        for _ in range(round(1 / 15 / self.model.opt.timestep)):
            mujoco.mj_step(self.model, self.data)
            hold_inside(self.data.qpos, self.data.qvel, self.places, self.dofs, *self.ends, self.model.opt.timestep)
        return np.array(self.data.qpos)


def apart(body: MujocoBody, frames: int) -> tuple[float, int]:
    """Largest difference (rad) of any joint between the body and its model in one piece; frames with contacts."""
    whole, touched, largest = Whole(body), 0, 0.0
    for arm, head in random_targets(body, 1, frames):
        before = body.state()["setpoint"]
        body.step(arm, head)
        largest = max(largest, np.abs(body.data.qpos - whole.step(before, body.state()["setpoint"])).max())
        touched += bool((whole.data.contact.efc_address >= 0).any()) if whole.data.ncon else 0
    return largest, touched


def test_parts_move_as_the_whole_does() -> None:
    """Each joint of the NAO, those that are neither arm nor head too, over 1,500 frames with contacts among them."""
    body = MujocoBody("nao")
    assert body.arm_moves_alone
    largest, touched = apart(body, 1500)
    assert largest < 1e-9 and touched > 20


def test_drawn_shapes_keep_their_mass(robot: Robot) -> None:
    """A body's inertia comes from all its shapes, those that are cut away included."""
    jib = '<joint name="swing" axis="0 0 1" range="-1.5 .5"/>'
    light = MujocoBody(robot())
    heavy = MujocoBody(robot(mjcf=(jib, jib + HEAVY)))
    assert light.arm_moves_alone and heavy.arm_moves_alone
    assert apart(heavy, 200)[0] < 1e-9
    movements = [[body.step(*targets).arm for targets in random_targets(body, 2, 50)] for body in (light, heavy)]
    assert np.abs(np.subtract(*movements)).max() > 1e-3


def test_drawn_shapes_that_water_pushes_are_kept(robot: Robot) -> None:
    """A fin that touches nothing, but brakes the jib."""
    jib = '<joint name="swing" axis="0 0 1" range="-1.5 .5"/>'
    fin = '<geom type="ellipsoid" size=".1 .002 .1" mass=".01" contype="0" conaffinity="0" fluidshape="ellipsoid"/>'
    body = MujocoBody(robot(mjcf=(jib, jib + fin)))
    body.model.opt.density = 1000.0
    assert body.arm_moves_alone
    assert apart(body, 100)[0] < 1e-9


def test_what_stands_still_is_still_touched(robot: Robot) -> None:
    """A pole beside the crane, on no joint, stops the jib as it does in one piece."""
    pole = '<geom name="pole" type="capsule" fromto=".25 -.06 .3 .25 -.06 .7" size=".01"/>'
    body = MujocoBody(robot(mjcf=(END, pole + END)))
    assert body.arm_moves_alone
    largest, touched = apart(body, 300)
    assert largest < 1e-9 and touched > 20


def test_head_does_not_move_the_arm() -> None:
    """Arm postures and marker are the same to the last bit while the head rests, jumps, and goes to and fro."""
    movements, touched = [], 0
    for seed in range(3):
        body, rng = MujocoBody("nao"), np.random.default_rng(seed)
        seen = []
        for frame, (arm, head) in enumerate(random_targets(body, 3, 2500)):
            if seed == 1:
                head = rng.choice([-9.0, 9.0], 2)
            elif seed == 2:
                head = rng.uniform(body.head.lower, body.head.upper) if frame % 7 == 0 else head
            reading = body.step(arm, head if seed else np.zeros(2))
            assert reading.view is not None
            seen.append(np.concatenate([reading.arm, reading.view.marker]))
            touched += bool(_arm_contacts(body))
        movements.append(np.array(seen).tobytes())
    assert movements[0] == movements[1] == movements[2]
    assert touched > 50


def _arm_contacts(body: MujocoBody) -> int:
    mujoco.mj_collision(body.model, body.data)
    return sum(contact.dist < 0 and contact.exclude == 0 for contact in body.data.contact)


# -- what cannot be parted ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("how", COUPLED)
def test_bodies_whose_parts_are_coupled_say_so_and_run_whole(robot: Robot, how: str) -> None:
    """Their arm moves as in one piece, which it is; without physics every arm moves alone."""
    path = robot(mjcf=COUPLED[how])
    body = MujocoBody(path)
    assert not body.arm_moves_alone
    assert MujocoBody(path, "kinematic").arm_moves_alone
    assert apart(body, 60)[0] == 0.0


def test_link_that_the_head_can_touch_belongs_to_neither(robot: Robot) -> None:
    """A joint under the arm, not named as one of it, whose shape can push the head: the head can move the arm."""
    body = MujocoBody(robot(anatomy=('["lift", "swing"]\nvelocity = [2.0, 3.0]', '["swing"]\nvelocity = [3.0]')))
    assert not body.arm_moves_alone


def test_exclusion_of_contact_parts_them(robot: Robot) -> None:
    """The same, where the model says that boom and head do not touch."""
    exclude = "".join(f'<exclude body1="boom" body2="{name}"/>' for name in ("neck", "face"))
    change = (END, f"{END}<contact>{exclude}</contact>")
    anatomy = ('["lift", "swing"]\nvelocity = [2.0, 3.0]', '["swing"]\nvelocity = [3.0]')
    assert MujocoBody(robot(mjcf=change, anatomy=anatomy)).arm_moves_alone


def test_coupled_body_keeps_the_laws(robot: Robot) -> None:
    """All of them, on a post that sways."""
    path = robot(mjcf=COUPLED["an equality"])
    check_body(lambda: MujocoBody(path), pictures=False)


# -- injuries ----------------------------------------------------------------------------------------------------------


def weak_elbow(model: mujoco.MjModel) -> None:
    model.actuator("LElbowRoll").gainprm[0] *= 0.1
    model.actuator("LElbowRoll").biasprm[1] *= 0.1


def heavy_hand(model: mujoco.MjModel) -> None:
    model.body("l_wrist").mass[0] *= 3


def long_arm(model: mujoco.MjModel) -> None:
    model.body("LElbow").pos[0] += 0.02


def stiff_neck(model: mujoco.MjModel) -> None:
    model.joint("HeadYaw").damping[0] *= 20


def no_gravity(model: mujoco.MjModel) -> None:
    model.opt.gravity[2] = -1.0


def under_water(model: mujoco.MjModel) -> None:
    model.opt.density, model.opt.viscosity = 1000.0, 0.5


def weightless(model: mujoco.MjModel) -> None:
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_GRAVITY)


@pytest.mark.parametrize("injure", [weak_elbow, heavy_hand, long_arm, stiff_neck, no_gravity, under_water, weightless])
def test_change_of_the_model_counts_from_the_next_frame_on(injure: Any) -> None:
    """The body moves on to the last bit as one that was made with the changed model and put into the same state."""
    body = MujocoBody("nao")
    targets = random_targets(body, 4, 60)
    for arm, head in targets[:20]:
        body.step(arm, head)
    state = body.state()
    injure(body.model)
    other = body.another()
    other.restore(state)
    readings = [(body.step(*pair), other.step(*pair)) for pair in targets[20:]]
    for mine, theirs in readings:
        assert mine.arm.tobytes() == theirs.arm.tobytes() and mine.head.tobytes() == theirs.head.tobytes()
    intact = MujocoBody("nao")
    intact.restore(state)
    assert any(
        (mine.arm != whole.arm).any() or (mine.head != whole.head).any()
        for (mine, _), whole in zip(readings, [intact.step(*pair) for pair in targets[20:]], strict=True)
    )


def test_change_that_is_undone_leaves_no_trace() -> None:
    """After it the body moves as one that was never injured, from the same state."""
    body, intact = MujocoBody("nao"), MujocoBody("nao")
    gain = body.model.actuator("LElbowRoll").gainprm[0]
    body.model.actuator("LElbowRoll").gainprm[0] = 0.0
    targets = random_targets(body, 5, 40)
    body.step(*targets[0])
    body.model.actuator("LElbowRoll").gainprm[0] = gain
    intact.restore(body.state())
    for pair in targets[1:]:
        assert body.step(*pair).arm.tobytes() == intact.step(*pair).arm.tobytes()


def test_every_option_is_noticed_and_carried_over() -> None:
    """Numbers and vectors alike; and what is drawn, which stands beside them, is none of them."""
    body = MujocoBody("nao")
    whole, arm = body.model, body.arm_alone().part
    assert arm.constants is not None
    watch = Watch(arm.constants.sources)
    for name in (name for name in dir(whole.opt) if not name.startswith("_")):
        before = np.copy(getattr(whole.opt, name))
        setattr(whole.opt, name, getattr(whole.opt, name) + 1)
        assert watch.changed(), name
        assert arm.constants.renew()
        assert np.array_equal(getattr(arm.model.opt, name), before + 1)
    whole.vis.global_.offwidth += 1
    assert not watch.changed()


@pytest.mark.parametrize("size", [1, 3, 64, 1000])
def test_watch_notices_every_byte(size: int) -> None:
    """Wherever it changes in the arrays, once; and nothing where nothing changes."""
    arrays = [np.zeros(size), np.zeros(size, np.int32), np.zeros(size, np.bool_)]
    watch = Watch(arrays)
    assert not watch.changed()
    for array in arrays:
        for k in {0, size // 2, size - 1}:
            array[k] = 1
            assert watch.changed()
            assert not watch.changed()


def test_a_pair_of_the_models_own_between_arm_and_head_pushes_neither(robot: Robot) -> None:
    """They pass through each other, as without it, and move alone."""
    named = ('<geom type="sphere" size=".04" mass=".1"/>\n        <body name="face">', "")
    pairs = '<contact><pair geom1="ball" geom2="rod"/></contact>\n  <actuator>\n    <position joint="lift"'
    plain = robot()
    text = (plain.parent / "crane.xml").read_text()
    assert named[0] in text
    text = text.replace(named[0], named[0].replace("<geom ", '<geom name="ball" '))
    text = text.replace('<geom type="capsule" fromto="0 0 0 .2', '<geom name="rod" type="capsule" fromto="0 0 0 .2')
    (plain.parent / "crane.xml").write_text(text.replace('<actuator>\n    <position joint="lift"', pairs))
    body = MujocoBody(plain)
    model = body.model
    between = {model.geom("ball").id, model.geom("rod").id}
    margins = [
        margin
        for first, second, margin in zip(model.pair_geom1, model.pair_geom2, model.pair_margin, strict=True)
        if {int(first), int(second)} == between
    ]
    assert margins == [-1.0] and body.arm_moves_alone
