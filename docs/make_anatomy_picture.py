"""Draw the picture of docs/anatomy.md: how a neck turns, and how the marker lies on its body.

usage: python docs/make_anatomy_picture.py [--out docs/img]

Nothing is drawn by hand: a small robot with a neck of three joints is built from an anatomy, and asked where its camera
looks at some angles; the cube is a picture of the same robot's hand.
"""

from __future__ import annotations

import argparse
import tempfile
from contextlib import closing
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np

from somatopy.bodies import MujocoBody
from somatopy.percept import Floats, Image

MJCF = """
<mujoco>
  <visual><headlight ambient=".5 .5 .5" diffuse=".5 .5 .5"/></visual>
  <asset><texture type="skybox" builtin="flat" rgb1=".8 .82 .85" rgb2=".8 .82 .85" width="8" height="48"/></asset>
  <worldbody>
    <body name="base"/>
    <body name="hand" pos="1 0 0">
      <joint name="wrist" range="-1 1"/>
      <geom type="capsule" fromto="0 0 0 .1 0 0" size=".002" rgba=".84 .15 .16 1" mass=".1"/>
      <geom type="capsule" fromto="0 0 0 0 .06 0" size=".002" rgba=".17 .63 .17 1" mass=".1"/>
      <geom type="capsule" fromto="0 0 0 0 0 .06" size=".002" rgba=".12 .47 .71 1" mass=".1"/>
      <camera name="outside" pos=".16 .16 .15" xyaxes="-.16 .12 0 -.018 -.024 .04" fovy="42"/>
    </body>
  </worldbody>
</mujoco>
"""
ANATOMY = """
name = "frames"
model = "frames.xml"
[arm]
joints = ["wrist"]
[head]
joints = ["pan", "tilt", "roll"]
[camera]
name = "eye"
[marker]
body = "hand"
position = [0.04, 0, 0]
axis = [1, 0, 0]
[add.neck]
body = "base"
joints = ["pan", "tilt", "roll"]
limits = [[-1, 1], [-1, 1], [-1, 1]]
[add.camera]
"""
RED, GREEN, BLUE = "#d62728", "#2ca02c", "#1f77b4"
TURNS = np.linspace(0, 0.7, 20)  # rad


def frames_of(body: MujocoBody, joint: int) -> Floats:
    """Forward, left and up of the camera while one joint of the neck turns, shape (turns, 3, 3)."""
    found = []
    for angle in TURNS:
        head = np.zeros(3)
        head[joint] = angle
        right, up, back = body.view([0.0], head).camera[3:].reshape(3, 3).T  # MuJoCo's camera looks along -z
        found.append([-back, -right, up])
    return np.array(found)


def arrow(axes: Any, tip: Floats, colour: str, name: str) -> None:
    axes.quiver(0, 0, 0, *(0.9 * tip), color=colour, linewidth=2.5, arrow_length_ratio=0.1)
    axes.text(*(1.02 * tip), name, color=colour, ha="center", va="center", fontsize=11)


def draw_neck(axes: Any, body: MujocoBody) -> None:
    forward, left, up = frames_of(body, 0)[0]
    for tip, colour, name in ((forward, RED, "forward"), (left, GREEN, "left"), (up, BLUE, "up")):
        arrow(axes, tip, colour, name)
    for joint, name, watched in ((0, "pan", 0), (1, "tilt", 0), (2, "roll", 1)):
        path = 0.8 * frames_of(body, joint)[:, watched]
        axes.plot(*path.T, color="black", linewidth=1.5)
        axes.quiver(*path[-2], *(4 * (path[-1] - path[-2])), color="black", linewidth=1.5, arrow_length_ratio=0.9)
        axes.text(*(1.3 * path[-1]), f"{name} > 0", ha="center", va="center", fontsize=11)
    axes.set(xlim=(-0.15, 0.85), ylim=(-0.25, 0.75), zlim=(-0.55, 0.85), box_aspect=(1, 1, 1.4))
    axes.view_init(elev=24, azim=-38)
    axes.set_axis_off()
    axes.set_title("[add.neck] and [add.camera]", fontsize=12)


def hand(body: MujocoBody) -> Image:
    body.reset()
    return np.array(body.picture("outside", 700, 700))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("docs/img"))
    args = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        Path(folder, "frames.xml").write_text(MJCF)
        path = Path(folder, "frames.toml")
        path.write_text(ANATOMY)
        with closing(MujocoBody(path, motion="kinematic")) as body:
            figure = plt.figure(figsize=(9, 4.4))
            draw_neck(figure.add_subplot(1, 2, 1, projection="3d"), body)
            axes = figure.add_subplot(1, 2, 2)
            axes.imshow(hand(body))
            axes.set_axis_off()
            axes.set_title("[marker]: x red, y green, z blue, axis = [1, 0, 0]", fontsize=12)
            figure.tight_layout()
            figure.savefig(args.out / "anatomy.png", dpi=110)


if __name__ == "__main__":
    main()
