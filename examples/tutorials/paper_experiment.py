# %% [markdown]
# # The paper's experiment
#
# A simulated NAO babbles: its arm moves to random postures. Its head learns where to look so that the camera sees the
# hand. Then the robot's sense of its arm is damaged, and it goes on learning. The paper runs for 304 minutes. Here
# are twenty minutes, and ten with the damage.
#
# `paper()` describes the experiment, and `replaced` gives another description with some values changed. Two changes
# make it fast. The *geometric* eye computes whether the hand can be seen, where the other one renders a picture and
# searches it. A *kinematic* body moves at its joints' speeds, without physics. Here its head also turns faster than in
# the preset, because `replaced` replaces a part as a whole, and the preset's `head_speed` goes with it.
# `trend_breaks=()` draws no trend lines: the run is too short for them.

# %%
from somatopy import paper, run
from somatopy.experiment import frames_of

described = paper().replaced(seed=1, eye={"kind": "geometric"}, body={"motion": "kinematic"})
intact, damaged = described.phases
phases = (
    intact.replaced(frames=frames_of(20), trend_breaks=()),  # in minutes of robot time: 15 frames a second
    damaged.replaced(frames=frames_of(10), trend_breaks=()),
)
result = run(described.replaced(phases=phases), "run", progress=False)

# %% [markdown]
# ## What came of it
#
# The summary has an entry for each phase. A *hit* is a frame in which the hand was seen, and a *window* has five
# minutes, which are 4,500 frames. The folder `run` must be new or empty: to run this again, delete it or name another.

# %%
for phase in result.summary["phases"]:
    print(f"{phase['damage']:>6}: seen in {phase['rate']:.1%} of {phase['frames']} frames")
    print(f"        hits by window: {phase['hits_per_window']}")

# %% [markdown]
# ## What was possible
#
# Not every posture of the arm can be seen. The *ceiling* is the share of frames in which some head posture would have
# seen the hand, and *efficiency* is what was reached of it.

# %%
for phase in result.summary["phases"]:
    efficiency = ", ".join(f"{window:.0%}" for window in phase["efficiency_per_window"])
    print(f"{phase['damage']:>6}: efficiency by window {efficiency}")

# %% [markdown]
# ## Look at it
#
# After the damage the learner sees its hand less. But this is one seed, a short run, and a faster head than the
# paper's. With the slow head of the preset, over thirty seeds of full length, the hand is seen in 51.9 % of the frames
# before the damage and in 50.8 % after it ([reproduction](../reproduction.md)).
#
# Everything is in the run folder ([what each file holds](../run_folder.md)). `somatopy report run` adds figures and a
# page that opens in any browser, offline.

# %%
print(sorted(entry.name for entry in result.path.iterdir() if not entry.name.startswith(".")))

# %% [markdown]
# The same length on the command line, with physics, rendered pictures and the preset's slow head:
#
# ```sh
# somatopy run paper --seed 1 --minutes 20 --damage-minutes 10
# ```
#
# Next: [read a run in detail](reading_a_run.md), [the whole paper over thirty seeds](../reproduction.md), or
# [other damages](../damages.md).
