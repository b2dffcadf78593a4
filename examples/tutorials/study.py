# %% [markdown]
# # A study
#
# One seed proves nothing: with some random movements of the arm the hand is easier to see than with others. A *study*
# runs several conditions under several seeds, and gathers their measures in one table. Does the paper's learner see its
# hand more often when the arm babbles slowly? In both conditions joints obey at once. *usual* has the preset's speed of
# babbling, 0.36 rad/s; *slow* has 0.25 rad/s. `processes=1` uses one core; without it a study uses all.

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
# Subtract seed by seed: runs of one seed have the same random numbers, so that much of their luck cancels out.

# %%
rates = table.pivot(index="seed", columns="condition", values="rate")
difference = rates["slow"] - rates["usual"]
print(f"slow sees the hand {100 * difference.mean():+.1f} points more often than usual")
print(f"by seed: {difference.round(3).tolist()}")

# %% [markdown]
# Three seeds of three minutes are too few to tell. `somatopy report study` writes a report, which has the means with
# their intervals, and says what the seeds cannot tell. If the program is stopped and started again, the study goes on
# where it was; with `seeds=30` it runs only the seeds that are new.
#
# Next: [study files, grids, searches, clusters](../studies.md).
