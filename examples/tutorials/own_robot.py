# %% [markdown]
# # Your own robot
#
# You have a robot with an arm and a head that moves a camera, and a file that describes it: MJCF, which MuJoCo reads,
# or URDF. Can it learn to keep its hand in view? This tutorial answers that in simulation. It takes a small robot from
# its first file to a run, through the mistakes that everyone makes.
#
# The tutorial uses the command line. `shell` does what its line does in a shell, and prints what you would see there.

# %%
import contextlib
import io
import shlex
import sys
from pathlib import Path

from somatopy import fork, load_description, load_run
from somatopy.cli import main


def shell(line):
    command, _, file = line.partition(" > ")
    out = io.StringIO()
    with contextlib.redirect_stderr(sys.stdout), contextlib.redirect_stdout(out):
        main(shlex.split(command)[1:])
    if file:
        Path(file).write_text(out.getvalue())
    else:
        print(out.getvalue(), end="")


# %% [markdown]
# ## The robot
#
# Lookout is a column with an arm of three joints and a head that pans and tilts. Its joints have names, limits and
# position servos, and a camera is mounted on the head. It knows nothing of somatopy.

# %%
ROBOT = """
<mujoco model="lookout">
  <option integrator="implicitfast"/>
  <visual><headlight ambient="0.4 0.4 0.4"/></visual>
  <asset><texture type="skybox" builtin="flat" rgb1="0.8 0.85 0.9" rgb2="0.8 0.85 0.9" width="8" height="8"/></asset>
  <worldbody>
    <light pos="1 0 2"/>
    <body name="column" pos="0 0 0.2">
      <geom type="cylinder" size="0.03 0.2" mass="2" rgba="0.4 0.45 0.5 1"/>
      <body name="upper_arm" pos="0 0.06 0.1">
        <joint name="shoulder_pitch" axis="0 1 0" range="-1.2 0.7" damping="0.1"/>
        <joint name="shoulder_yaw" axis="0 0 1" range="-0.9 1.0" damping="0.1"/>
        <geom type="capsule" fromto="0 0 0 0.16 0 0" size="0.015" mass="0.2" rgba="0.2 0.5 0.8 1"/>
        <body name="forearm" pos="0.16 0 0">
          <joint name="elbow" axis="0 1 0" range="-1.7 0" damping="0.1"/>
          <geom type="capsule" fromto="0 0 0 0.13 0 0" size="0.012" mass="0.1" rgba="0.9 0.6 0.2 1"/>
        </body>
      </body>
      <body name="neck" pos="0 0 0.26">
        <joint name="pan" axis="0 0 1" range="-1.6 1.6" damping="0.05"/>
        <geom type="cylinder" size="0.015 0.02" mass="0.1"/>
        <body name="face" pos="0 0 0.04">
          <joint name="tilt" axis="0 1 0" range="-0.7 1.2" damping="0.05"/>
          <geom type="box" size="0.02 0.04 0.02" mass="0.1"/>
          <camera name="eye" pos="0.03 0 0" xyaxes="0 -1 0 0 0 1" fovy="45"/>
        </body>
      </body>
    </body>
  </worldbody>
  <actuator>
    <position joint="shoulder_pitch" kp="20" kv="1"/>
    <position joint="shoulder_yaw" kp="20" kv="1"/>
    <position joint="elbow" kp="10" kv="0.5"/>
    <position joint="pan" kp="40" kv="0.5"/>
    <position joint="tilt" kp="40" kv="0.5"/>
  </actuator>
</mujoco>
"""
Path("lookout.xml").write_text(ROBOT.strip())

# %% [markdown]
# ## Run it?
#
# To run the model is what everyone tries first. But a model does not say which of its joints are the arm, and where the
# hand is. That stands in a second file, the *anatomy*.

# %%
shell("somatopy run best --body.model lookout.xml")

# %% [markdown]
# ## Let somatopy look at it
#
# The command that the message names writes the anatomy. It also says what it found, and what is wrong:

# %%
shell("somatopy check-body lookout.xml --propose > lookout.toml")

# %% [markdown]
# The note is right. The file has its angles in radians, and nothing in it says so. MuJoCo read degrees: an arm that
# hardly moves, before a head that hardly turns. somatopy even put a second head on the robot, since the first one
# could not see the hand. The note has the line that mends it.

# %%
Path("lookout.xml").write_text(ROBOT.strip().replace("<option", '<compiler angle="radian"/>\n  <option'))
shell("somatopy check-body lookout.xml --propose > lookout.toml")

# %% [markdown]
# Now arm and head are those of the robot. The *arm* is a chain of joints that ends in a hand. The *head* is made of the
# joints that move a camera, but not the arm. The line *Sight* says whether it pays to learn:
#
# - The larger share is the *ceiling*. At the other postures of the arm, no posture of the head shows the hand.
# - The smaller share is what the best head that never moves sees. A learner is worth something only above it.
#
# ## The anatomy file
#
# Each line that was chosen for you says why. [The page on anatomy files](../anatomy.md) explains every key.

# %%
print(Path("lookout.toml").read_text())

# %% [markdown]
# Read it through, and change what you know better. Three things deserve a look:
#
# - **Speeds.** MuJoCo's models have no velocity limits, but your servos do. Lookout's head turns at 6 rad/s.
# - **The marker.** The hand is found by a cube of 5 cm, with a tag of 4 cm on four of its sides: numbers 0 to 3 of
#   OpenCV's ArUco dictionary `DICT_4X4_50`. somatopy mounts it on the model. `position` is the place of its centre in
#   the frame of `body`. Here that is beyond the end of the forearm, so that nothing hides the tags. On the real robot
#   you print the tags and mount the cube at the same place.
# - **The range `confined`.** The arm babbles inside it. It is as wide as it can be while the hand can mostly be seen.

# %%
anatomy = Path("lookout.toml").read_text()
Path("lookout.toml").write_text(anatomy.replace("velocity = [3.0, 3.0] ", "velocity = [6.0, 6.0] "))

# %% [markdown]
# ## See what its eye sees
#
# `check-body` takes the anatomy as well. With `--picture` it draws the robot in two postures, and beside it what its
# eye sees there. The tags that the detector found are outlined. This is the only step that needs OpenGL. What is
# printed is the same as above, so that it is left out here.

# %%
with contextlib.redirect_stdout(io.StringIO()):
    main(["check-body", "lookout.toml", "--picture", "own_robot.png"])

# %% [markdown]
# ![The robot from outside, and what its camera sees, in two postures](own_robot.png)
#
# ## Let it learn
#
# Ten minutes of babbling come first. Then the sense of the arm is damaged for five minutes: each joint is felt
# somewhere else than where it is, as after an encoder has lost its zero. `best` is a learner that knows nothing about
# the robot but the limits of its joints and the size of its picture. The robot moves by physics. The geometric eye
# computes whether the camera would find a tag, instead of rendering pictures.

# %%
minutes = "--minutes 10 --damage-minutes 5 --damage offset-0.8"
shell(f"somatopy run best --body.model lookout.toml --eye geometric {minutes} --quiet --out run")

# %% [markdown]
# ## Did it?
#
# *Efficiency* is the share of the ceiling that was reached. The summary has it for each phase, in windows of five
# minutes.

# %%
opened = load_run("run")
for phase in opened.summary["phases"]:
    efficiency = ", ".join(f"{window:.0%}" for window in phase["efficiency_per_window"])
    print(f"{phase['damage']:>13}: hand seen in {phase['rate']:.0%} of all frames, efficiency by window {efficiency}")

# %% [markdown]
# The first minute of each phase shows how fast it learns. These are the shares of frames with the hand, for every ten
# seconds:

# %%
frames = opened.to_pandas(["phase", "hit"])
for phase, hits in frames.groupby("phase")["hit"]:
    print(f"phase {phase + 1}:", "  ".join(f"{hits.iloc[k : k + 150].mean():.0%}" for k in range(0, 900, 150)))

# %% [markdown]
# The damage hardly shows. Is it harmless, or did the robot learn again? Forbid it to learn during the damage, and see.
# `fork` continues a run after its first phase, here with a second phase in which no part of the learner is *plastic*.

# %%
described = load_description("run/experiment.toml")
intact, damaged = described.phases
stopped = fork("run", described.replaced(phases=[intact, damaged.replaced(plastic=())]), progress=False)
print(f"hand seen in {stopped.summary['phases'][1]['rate']:.0%} of the damaged phase")

# %% [markdown]
# `somatopy report run` writes a page with the robot's picture and curves ([how to read it](../report.md)), and
# `somatopy film run` a [film](../film.md). Try [other damages](../damages.md), such as `--damage camera-tilt`.
#
# ## If your robot sees less
#
# - Run two minutes with rendered pictures, `--eye fiducial --minutes 2`. If it sees the hand far less often than with
#   the geometric eye, the tags are too small or too oblique in the picture:
#   [what helps](../robots.md#when-the-hand-is-not-seen).
# - Look at the servos of the head. Lookout's follow their set-points with a lag of 14 milliseconds. With `kp="20"
#   kv="1.95"` the lag is 100 milliseconds, one and a half frames. Then `best` saw the hand in 93 percent of the first
#   ten minutes instead of 95 (means of three seeds). [Choosing a servo](../anatomy.md#choosing-a-servo) has the
#   formula.
#
# ## The real robot
#
# somatopy has no driver for a real robot, and nothing in it has run on one yet. What it has is the place where a driver
# belongs: a *body* is a class with `reset`, `step`, `close` and four attributes, and needs no base class.
#
# | member | what it is |
# |---|---|
# | `arm`, `head` | `JointGroup(names, lower, upper, velocity)`, arrays in rad and rad/s; set them before you connect |
# | `camera` | `Camera(name, width, height, fovy)`, `fovy` in rad; a pinhole, so undistort your pictures first |
# | `marker` | `Marker()`, if the cube is the one described above |
# | `reset(seed)` | goes to the start posture, and returns a `Reading` at time 0 |
# | `step(arm, head)` | clips both targets to the limits, lets the robot move for 1/15 s, and returns a `Reading` |
# | `close()` | releases the robot; may be called twice |
#
# A `Reading` has the time, the postures and commands of arm and head, and `image`, a function that returns the camera's
# picture as an array (height, width, 3) in RGB. All these classes are in `somatopy.percept`. In `my_robot.py`, your
# class `Lookout` then runs with
#
# ```sh
# somatopy run best --body.kind my_robot:Lookout --babbling.range -1.1 -0.3 -0.3 0.9 -0.9 -0.1 \
#     --minutes 10 --damage-minutes 0
# ```
#
# and the default eye searches its pictures. The range is low and high of each arm joint: choose it so that the arm
# cannot hit anything.
#
# A real robot cannot be put back into an earlier state, so that its runs cannot be resumed. Without a model of itself
# its runs have no ceiling either. [A simulated body of 80 lines](../../examples/own_parts/planar/body.py), without
# MuJoCo, can be resumed and has such a model. `check_body(Lookout)` tries the contract. It sends the joints to all
# their limits, so try it on a simulated driver.
#
# Next: [the page on robots](../robots.md), [everything an anatomy can say](../anatomy.md), and
# [parts of your own](../../CONTRIBUTING.md#add-yours).
