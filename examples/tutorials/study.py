# %% [markdown]
# # A study
#
# One seed proves nothing: some arms are luckier than others. A *study* runs several conditions under several seeds,
# in all cores, and gathers their measures in one table. Does the paper's learner see more of its hand when the arm
# babbles slowly? *usual* is the preset's speed, 0.36 rad/s, with joints that obey at once; *slow* is 0.25 rad/s.

# %%
import somatopy
from somatopy import paper
from somatopy.experiment import frames_of

phase = paper().phases[0].replaced(frames=frames_of(3), trend_breaks=())
usual = paper().replaced(phases=[phase], body={"motion": "kinematic"})
slow = usual.replaced(babbling={"kind": "uniform", "range": "confined", "speed": 0.25})
result = somatopy.study({"usual": usual, "slow": slow}, seeds=3, out="study", processes=1, progress=False)

# %% [markdown]
# ## The table
#
# There is one row for each phase of each run.

# %%
table = result.table.to_pandas()
print(table[["condition", "seed", "rate", "efficiency"]].round(3).to_string(index=False))

# %% [markdown]
# ## The difference
#
# Subtract seed by seed: the same seed has the same luck.

# %%
rates = table.pivot(index="seed", columns="condition", values="rate")
difference = rates["slow"] - rates["usual"]
print(f"slow sees the hand {100 * difference.mean():+.1f} points more often than usual")
print(f"by seed: {difference.round(3).tolist()}")

# %% [markdown]
# Three seeds of three minutes are too few to tell. The report of a study has the means with their intervals, and says
# what the seeds cannot tell: `somatopy report study`. The same study goes on where it was stopped, and with
# `seeds=30` it runs only those that are new.
#
# Next: [study files, grids, searches, clusters](../studies.md).
