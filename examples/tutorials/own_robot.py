# %% [markdown]
# # Your own robot
#
# Any robot will do that has a MuJoCo model or a URDF. This one is an arm of two hinges. It has no head, no camera and
# no motors.

# %%
from contextlib import redirect_stdout, suppress
from pathlib import Path

from somatopy import MujocoBody, check_body, paper, run
from somatopy.cli import main as somatopy
from somatopy.experiment import frames_of

Path("my_robot.xml").write_text("""
<mujoco model="my_robot">
  <compiler angle="radian"/>
  <worldbody>
    <light pos="0 0 2"/>
    <body name="upper_arm" pos="0 0 0.4">
      <joint name="shoulder" axis="0 0 1" range="-1 1" damping="0.1"/>
      <geom type="capsule" fromto="0 0 0 0.15 0 0" size="0.015" mass="0.1"/>
      <body name="forearm" pos="0.15 0 0">
        <joint name="elbow" axis="0 0 1" range="-0.2 1.8" damping="0.1"/>
        <geom type="capsule" fromto="0 0 0 0.15 0 0" size="0.012" mass="0.05"/>
      </body>
    </body>
  </worldbody>
</mujoco>
""")

# %% [markdown]
# ## Let it be proposed
#
# An *anatomy file* says which joints are arm and head, which camera looks, and where the marker goes. `check-body
# --propose` writes one. What the model lacks, it adds: here a neck with a camera, and servos. In a shell the command
# is `somatopy check-body my_robot.xml --propose > my.toml`.

# %%
with open("my.toml", "w") as file, redirect_stdout(file), suppress(SystemExit):
    somatopy(["check-body", "my_robot.xml", "--propose"])
print(Path("my.toml").read_text())

# %% [markdown]
# ## Does it work?
#
# `check_body` tries the laws of bodies on it. A body without pictures needs no OpenGL.

# %%
check_body(lambda: MujocoBody("my.toml"), pictures=False)
print("It keeps the contract of bodies.")

# %% [markdown]
# ## Let it look for its hand

# %%
described = paper().replaced(body={"model": "my.toml", "motion": "kinematic"}, eye={"kind": "geometric"})
phase = described.phases[0].replaced(frames=frames_of(3), trend_breaks=())
for learner in ("hebbian", "best"):
    described = described.replaced(phases=[phase], learner={"kind": learner})
    summary = run(described, learner, progress=False).summary
    rate, possible = summary["phases"][0]["rate"], summary["ceiling_rate"]
    print(f"{learner:>8}: hand seen in {rate:.1%} of 3 minutes; {possible:.1%} was possible")

# %% [markdown]
# Next: [what to do when the hand is not seen](../robots.md#when-the-hand-is-not-seen), [every key of the anatomy
# file](../anatomy.md), and [four robots from packages](../../examples/robots/README.md).
