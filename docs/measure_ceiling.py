"""Measure the ceiling's grid, its truth and its cost: numbers and figure of docs/ceiling.md.

usage: python docs/measure_ceiling.py [--out docs/img]

The arm postures are those of the paper's babbling, 273,872 frames with physics. Takes about four minutes.
"""

from __future__ import annotations

import argparse
import os
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter

import matplotlib.pyplot as plt
import numpy as np

from somatopy.analysis.style import CEILING, HITS, TREND, style
from somatopy.babbling import UniformBabbler
from somatopy.bodies import MujocoBody
from somatopy.clock import WINDOW
from somatopy.experiment import ceiling
from somatopy.experiment.ceiling import EVERY, Vantages, reachable, reactive_hits
from somatopy.eyes import FiducialEye
from somatopy.eyes.frustum import may_be_seen, optics
from somatopy.percept import Floats

FRAMES = (177_823, 96_049)
GRID = ceiling.GRIDS[2]
GRIDS = ((25, 8), (49, 15), (97, 29), (193, 57))
SAMPLE, CHECKED = 2000, 500
ROBUST, SPREAD = 5, 60  # head postures drawn where the hand is said to be reachable, and where not


def trajectory(body: MujocoBody) -> Floats:
    """Sensed arm postures of the paper's babbling, the head at rest, (frames, n_arm)."""
    reading = body.reset()
    bounds = np.column_stack([body.arm.lower, body.arm.upper])
    babbler = UniformBabbler(body.arm, bounds, 0.8, reading.arm, np.random.default_rng(0))
    arms = np.empty((sum(FRAMES), len(body.arm)))
    for k in range(len(arms)):
        arms[k] = reading.arm
        reading = body.step(babbler.command(reading.time), reading.head_command)
    return arms


def convergence(body: MujocoBody, arms: Floats) -> list[float]:
    """Print and return the ceiling by grid."""
    rates = []
    finest = reachable(Vantages.of(body, GRIDS[-1]), arms)
    print("\ngrid | head postures | ceiling | lost against the finest | us a posture")
    for shape in GRIDS:
        vantages = Vantages.of(body, shape)
        start = perf_counter()
        found = reachable(vantages, arms)
        cost = 1e6 * (perf_counter() - start) / len(arms)
        lost = (finest & ~found).mean()
        print(f"{shape[0]} x {shape[1]} | {len(vantages.heads)} | {found.mean():.2%} | {lost:.2%} | {cost:.0f}")
        rates.append(float(found.mean()))
    return rates


def drawn_at(body: MujocoBody, eye: FiducialEye, arm: Floats, heads: Floats) -> list[bool]:
    """Whether the rendered eye finds the hand from these head postures."""
    return [eye.look(body.place(arm, head)) is not None for head in heads]


def check(body: MujocoBody, arms: Floats) -> tuple[Floats, Floats]:
    """Draw what the model says of each arm posture.

    Returns:
        For those reachable whether the hand is found from the most robust head posture, and from any of the five most
        robust, (n, 2); for the others whether it is found from any of 60 spread over those from which it could be.
    """
    vantages, eye = Vantages.of(body), FiducialEye(body.camera, body.marker, skip=False)
    sizes, yes, no = optics(body.camera, body.marker), [], []
    for arm in arms:
        seen = vantages.seeing(arm)
        if seen.any():
            best = np.argsort(-vantages.robustness(seen), kind="stable")[: min(ROBUST, int(seen.sum()))]
            found = drawn_at(body, eye, arm, vantages.heads[best])
            yes.append((found[0], any(found)))
        else:
            marker = body.view(arm, vantages.heads[0]).marker
            could = np.flatnonzero([may_be_seen(camera, marker, *sizes) for camera in vantages.cameras])
            some = could[np.linspace(0, len(could) - 1, min(SPREAD, len(could))).astype(int)]
            no.append(any(drawn_at(body, eye, arm, vantages.heads[some])))
    return np.array(yes), np.array(no)


def figure(rates: list[float], yes: Floats, no: Floats) -> plt.Figure:
    with style():
        drawing, (left, right) = plt.subplots(1, 2, figsize=(9, 3.4), layout="constrained")
        steps = [shape[0] for shape in GRIDS]
        left.plot(steps, 100 * np.array(rates), color=CEILING, marker="o")
        left.plot(GRID[0], 100 * rates[GRIDS.index(GRID)], color=HITS, marker="o", markersize=11, fillstyle="none")
        left.set_xscale("log", base=2)
        left.set_xticks(steps, [f"{a} × {b}" for a, b in GRIDS])
        left.minorticks_off()
        left.set(xlabel="head postures tried, yaw × pitch", ylabel="arm postures that can be seen, %")
        left.set_title("Ceiling against grid; the ring is the grid in use")
        shares = [yes[:, 0].mean(), yes[:, 1].mean(), 1 - no.mean()]
        labels = ["reachable: found from\nthe most robust view", "reachable: found from one\nof the five most robust"]
        labels.append("out of reach: not found\nfrom any of 60 views")
        bars = right.barh(range(3), [100 * share for share in shares], color=[HITS, HITS, TREND])
        right.bar_label(bars, [f"{share:.1%}" for share in shares], padding=-44, color="white", fontweight="bold")
        right.set_yticks(range(3), labels)
        right.invert_yaxis()
        right.set(xlim=(0, 100), xlabel="confirmed by pictures, %")
        right.grid(axis="y", visible=False)
        right.set_title(f"{len(yes) + len(no)} postures checked by drawing")
    return drawing


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("docs/img"))
    args = parser.parse_args()
    body = MujocoBody("nao")
    arms = trajectory(body)
    with TemporaryDirectory() as empty:
        os.environ["XDG_CACHE_HOME"] = empty  # so that nothing is looked up
        start = perf_counter()
        result = ceiling.ceiling([body, body], [arms[: FRAMES[0]], arms[FRAMES[0] :]], WINDOW, EVERY, GRID)
        seconds, reactive = perf_counter() - start, result["reactive"]
    windows = [rate for phase in result["phases"] for rate in phase["per_window"]]
    print(f"run of {len(arms)} frames: {seconds:.1f} s; ceiling {result['rate']:.2%}", end=", ")
    print(f"windows {min(windows):.1%} to {max(windows):.1%}, standard deviation {np.std(windows):.1%}")
    print(
        f"reactive: {reactive['rate']:.2%} of {reactive['ceiling_rate']:.2%} in {reactive['frames']} frames", end=", "
    )
    print(f"efficiency {reactive['rate'] / reactive['ceiling_rate']:.1%}")
    still = MujocoBody("nao", motion="kinematic")
    parts = [reactive_hits(Vantages.of(still), arms[k : k + 900]) for k in range(0, 9000, 1800)]
    hits, possible = (np.concatenate([part[k] for part in parts]) for k in (0, 1))
    print(f"reactive without the servos' lag, 4,500 frames: efficiency {hits.sum() / possible.sum():.1%}")
    rates = convergence(still, arms[:: len(arms) // SAMPLE][:SAMPLE])
    yes, no = check(still, arms[7 :: len(arms) // CHECKED][:CHECKED])
    print(f"\nreachable {len(yes)}: found from the most robust {yes[:, 0].mean():.1%}, of five {yes[:, 1].mean():.1%}")
    print(f"out of reach {len(no)}: found from some head posture {no.mean():.1%}")
    args.out.mkdir(parents=True, exist_ok=True)
    figure(rates, yes, no).savefig(args.out / "ceiling.png", dpi=150)
    body.close()
    still.close()


if __name__ == "__main__":
    main()
