"""Robots of any shape: an arm of some joints, a head of some with a camera on it, and the anatomy file of both."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

__all__ = ["Joint", "Shape", "joints", "write_robot"]

SERVOS = {"hinge": 'kp="6" kv="0.3"', "slide": 'kp="600" kv="12"'}
ARMATURE = {"hinge": 0.005, "slide": 0.05}
GHOST = 'contype="0" conaffinity="0"'
AXES = {"x": "1 0 0", "y": "0 1 0", "z": "0 0 1"}


@dataclass(frozen=True)
class Joint:
    """A hinge or slide: its axis ("x" is ahead, "y" to the left, "z" up) and its limits, rad or m."""

    axis: str
    low: float
    high: float
    kind: str = "hinge"
    velocity: float = 2.0


def joints(axes: str, reach: float = 0.6, slides: str = "") -> tuple[Joint, ...]:
    """One joint for each axis that is named; those at the places that `slides` names slide.

    Args:
        axes: such as "yzx".
        reach: of a hinge, rad, to both sides.
        slides: places, from 0 on, such as "02".
    """
    hinge = [Joint(axis, -reach, reach) for axis in axes]
    return tuple(
        Joint(joint.axis, -0.04, 0.06, "slide", 0.5) if str(k) in slides else joint for k, joint in enumerate(hinge)
    )


@dataclass(frozen=True)
class Shape:
    """What a robot is made of.

    Attributes:
        arm: its arm's joints, from the shoulder on; the links between them are 0.32 m together.
        head: its head's joints, from the neck on.
        size: the picture's width and height, px.
        fovy: the camera's vertical field of view, degrees.
        shoulder: where the arm begins, m; the neck is at (0, 0, 0.25).
        link: length of the head's links, m; with more than 0 it is a second arm with the camera on its wrist.
    """

    arm: tuple[Joint, ...]
    head: tuple[Joint, ...]
    size: tuple[int, int] = (320, 240)
    fovy: float = 50.0
    shoulder: tuple[float, float, float] = (0.0, 0.0, -0.1)
    link: float = 0.0


def write_robot(folder: Path, shape: Shape, name: str = "robot") -> Path:
    """Write the model and the anatomy of a robot; gives the anatomy file."""
    names = [f"a{k}" for k in range(len(shape.arm))], [f"h{k}" for k in range(len(shape.head))]
    servos = [
        f'<position joint="{name}" {SERVOS[joint.kind]}/>'
        for group, made in zip(names, (shape.arm, shape.head), strict=True)
        for name, joint in zip(group, made, strict=True)
    ]
    (folder / f"{name}.xml").write_text(f"""
<mujoco model="{name}">
  <compiler angle="radian"/>
  <option integrator="implicitfast"/>
  <worldbody>
    <light pos="1 0 2"/>
    {_arm(shape)}
    {_head(shape)}
  </worldbody>
  <actuator>{"".join(servos)}</actuator>
</mujoco>
""")
    anatomy = folder / f"{name}.toml"
    anatomy.write_text(f"""
name = "{name}"
model = "{name}.xml"
arm = {_group(names[0], shape.arm)}
head = {_group(names[1], shape.head)}
camera = {{ name = "eye", width = {shape.size[0]}, height = {shape.size[1]} }}
marker = {{ body = "arm{len(shape.arm) - 1}", position = [{0.32 / len(shape.arm) + 0.03:.4f}, 0.0, 0.0] }}
""")
    return anatomy


def _arm(shape: Shape) -> str:
    """Links ahead, each behind its joint."""
    link, text = 0.32 / len(shape.arm), ""
    for k, joint in reversed([*enumerate(shape.arm)]):
        at = " ".join(map(str, shape.shoulder)) if k == 0 else f"{link:.4f} 0 0"
        geom = f'<geom type="capsule" fromto="0 0 0 {link:.4f} 0 0" size=".012" mass=".03" {GHOST}/>'
        text = f'<body name="arm{k}" pos="{at}" gravcomp="1">{_joint(f"a{k}", joint)}{geom}{text}</body>'
    return text


def _head(shape: Shape) -> str:
    """Joints in one place, or on links that point ahead, and a camera that looks ahead and down."""
    text = f'<camera name="eye" pos=".04 0 0" xyaxes="0 -1 0 .7 0 .7" fovy="{shape.fovy}"/>'
    for k, joint in reversed([*enumerate(shape.head)]):
        at, geom = ("0 0 .25" if k == 0 else f"{shape.link} 0 0"), f'<geom size=".03" mass=".1" {GHOST}/>'
        text = f'<body name="head{k}" pos="{at}" gravcomp="1">{_joint(f"h{k}", joint)}{geom}{text}</body>'
    return text


def _joint(name: str, joint: Joint) -> str:
    told = f'range="{joint.low} {joint.high}" armature="{ARMATURE[joint.kind]}"'
    return f'<joint name="{name}" type="{joint.kind}" axis="{AXES[joint.axis]}" {told}/>'


def _group(names: Sequence[str], made: Sequence[Joint]) -> str:
    listed = ", ".join(f'"{name}"' for name in names)
    return f"{{ joints = [{listed}], velocity = [{', '.join(str(joint.velocity) for joint in made)}] }}"
