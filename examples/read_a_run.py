"""Read a run with pandas: print how far the gaze was off, how often the hand was seen, and in which postures.

usage: python read_a_run.py RUN
"""

import sys

import numpy as np
import pandas as pd

from somatopy import load_run

if len(sys.argv) != 2:
    sys.exit(__doc__)
run = load_run(sys.argv[1])
frames = run.frames().to_pandas()
phases = [phase["name"] for phase in run.description["phases"]]
frames["phase"] = frames["phase"].map(dict(enumerate(phases)))
frames["gaze_error_deg"] = np.rad2deg(frames["gaze_error_rad"])

print(f"{run.path}: {len(frames)} frames, seed {run.description['seed']}\n")

print("Hit rate and gaze error (degrees) of each phase:")
errors = frames.groupby("phase", sort=False)["gaze_error_deg"].describe(percentiles=[0.5, 0.95])[["50%", "95%"]]
print(errors.assign(hit_rate=frames.groupby("phase", sort=False)["hit"].mean()).round(3), "\n")

print("Hit rate in windows of 5 minutes:")
print(frames.groupby(frames["time_s"] // 300 * 5)["hit"].mean().rename_axis("from minute").round(3), "\n")

print("Hit rate by the angle of each arm joint, thirds of its range from low to high:")
thirds = {
    joint: frames["hit"].groupby(pd.cut(angles, 3, labels=["low", "middle", "high"]), observed=True).mean()
    for joint, angles in zip(run.joints("arm"), run.postures("arm").T, strict=True)
}
print(pd.DataFrame(thirds).T.round(3))
