# %% [markdown]
# # Reading a run
#
# A run folder is plain: a TOML file that says what ran, one Parquet row for each frame, and a summary. Any program
# can read it. `load_run` opens one in Python; `run` returns the same.

# %%
import numpy as np
import pandas as pd

from somatopy import load_run, paper, run
from somatopy.experiment import frames_of

described = paper().replaced(seed=1, eye={"kind": "geometric"}, body={"motion": "kinematic"})
phase = described.phases[0].replaced(frames=frames_of(10), trend_breaks=())
run(described.replaced(phases=[phase]), "run", progress=False)
opened = load_run("run")

# %% [markdown]
# ## What was recorded
#
# Each column says what it means, its unit and its role.

# %%
for column in opened.described_columns[:8]:
    print(f"{column.name:<22}{column.unit or '-':<6}{column.meaning}")
print("and", len(opened.columns) - 8, "more")

# %% [markdown]
# ## Frames in pandas
#
# `to_pandas` gives a table of the columns that you name, one row for each frame; `frames` gives the same as a pyarrow
# table. How often was the hand seen, minute by minute?

# %%
frames = opened.to_pandas(["time_s", "hit", "gaze_error_rad"])
by_minute = frames.groupby((frames["time_s"] // 60).astype(int))
print(by_minute["hit"].mean().rename_axis("minute").round(3).to_string())

# %% [markdown]
# How far was the gaze from the hand, where the hand was seen and where it was missed?

# %%
errors = np.rad2deg(frames["gaze_error_rad"])
print(errors.groupby(frames["hit"]).median().round(1).rename("median gaze error, degrees").to_string())

# %% [markdown]
# ## Postures
#
# `postures` gives the joints of a sense as one array, and `joints` their names. Is the hand missed where the arm is
# far out?

# %%
arm = pd.DataFrame(opened.postures("arm"), columns=opened.joints("arm"))
for joint in arm:
    thirds = frames["hit"].groupby(pd.cut(arm[joint], 3, labels=["low", "middle", "high"]), observed=True).mean()
    print(f"{joint:>15}: " + ", ".join(f"{name} {share:.0%}" for name, share in thirds.items()))

# %% [markdown]
# Next: [what else is in a run folder](../run_folder.md), [all calls that read one](../report.md#reading-a-run), and
# [many runs at once](../studies.md).
