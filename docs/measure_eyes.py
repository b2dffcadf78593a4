"""Measure how well the geometric eye agrees with the rendered one: numbers and picture of docs/eyes.md.

usage: python docs/measure_eyes.py [--out docs/img] [--run RUN] [--parts N]

With RUN, a run folder, it also counts in how many of its frames no picture need be drawn. With N it does nothing else
than compare parts with whole pictures in 3 N postures. Takes about a minute.
"""

from __future__ import annotations

import argparse
import math
from dataclasses import dataclass
from itertools import product
from pathlib import Path

import cv2
import numpy as np

from somatopy import load_run
from somatopy.bodies import MujocoBody
from somatopy.experiment.ceiling import Vantages
from somatopy.eyes import FiducialEye, GeometricEye, geometric
from somatopy.eyes.frustum import may_be_seen, optics, part_with_tags
from somatopy.percept import Floats, Image, Sighting, View

HALF = 3000  # postures to calibrate with, as many to report on, as many uniform ones
NOISE = 0.15  # rad, between the head posture that looks at the hand and the one that is taken
GAP = 6


@dataclass
class Sample:
    """A posture, what is truly there, and what the rendered eye found."""

    arm: Floats
    head: Floats
    view: View
    rendered: Sighting | None


def draw(body: MujocoBody, eye: FiducialEye, arm: Floats, head: Floats) -> Sample:
    reading = body.place(arm, head)
    assert reading.view is not None
    return Sample(reading.arm, reading.head, reading.view, eye.look(reading))


def uniform_head(body: MujocoBody, rng: np.random.Generator) -> Floats:
    return body.legal(rng.uniform(body.head.lower, body.head.upper))


def gaze_directed_head(vantages: Vantages, arm: Floats, rng: np.random.Generator, noise: float = NOISE) -> Floats:
    """The head posture of the grid that looks nearest to the hand, and some noise, rad."""
    ray = vantages.body.view(arm, vantages.heads[0]).marker[:3] - vantages.cameras[:, :3]
    along = -(vantages.cameras[:, 5::3] * ray).sum(axis=1) / np.linalg.norm(ray, axis=1)
    return vantages.body.legal(vantages.heads[along.argmax()] + rng.normal(0, noise, 2))


def table(samples: list[Sample], found: list[Sighting | None]) -> str:
    """The row of a two by two table, and how far pixels and tags differ where both see."""
    model = np.array([f is not None for f in found])
    drawn = np.array([s.rendered is not None for s in samples])
    both = [(f, s.rendered) for f, s in zip(found, samples, strict=True) if f is not None and s.rendered is not None]
    apart = np.array([np.hypot(*np.subtract(f.pixel, r.pixel)) for f, r in both])
    same = np.mean([f.tag == r.tag for f, r in both])
    counts = (model & drawn).sum(), (model & ~drawn).sum(), (~model & drawn).sum(), (~model & ~drawn).sum()
    return (
        f"| {' | '.join(map(str, counts))} | {(model == drawn).mean():.2%} "
        f"| {np.median(apart):.2f}, {np.percentile(apart, 95):.2f}, {apart.max():.2f} | {same:.1%} |"
    )


def calibrate(body: MujocoBody, samples: list[Sample]) -> None:
    """Print how many postures are judged wrongly for choices of the model's four numbers."""
    drawn = np.array([s.rendered is not None for s in samples])
    chosen = geometric.MIN_HEIGHT, geometric.MAX_TILT, geometric.BORDER, geometric.REACH
    print("\nheight px | tilt deg | border px | reach | wrong | only geometric | only rendered")
    wrong = []
    for height, tilt, border, reach in product(
        (8.0, 9.0, 10.0, 11.0, 12.0), (77, 78, 79, 80, 81), (1.0, 2.0, 3.0), (0.67, 0.75, 5 / 6, 0.9, 1.0)
    ):
        geometric.MIN_HEIGHT, geometric.MAX_TILT = height, math.radians(tilt)
        geometric.BORDER, geometric.REACH = border, reach
        eye = GeometricEye(body.camera, body.marker, body.occluders)
        model = np.array([eye.find(s.view) is not None for s in samples])
        numbers = height, tilt, border, round(reach, 2), (model != drawn).sum()
        wrong.append((*numbers, (model & ~drawn).sum(), (drawn & ~model).sum()))
    geometric.MIN_HEIGHT, geometric.MAX_TILT, geometric.BORDER, geometric.REACH = chosen
    for row in sorted(wrong, key=lambda row: row[4])[:10]:
        print(*row, sep=" | ")


def crop(body: MujocoBody, sample: Sample) -> Image:
    """The part of the robot's picture around the hand, twice as large."""
    reading = body.place(sample.arm, sample.head)
    assert reading.image is not None
    x, y, z = sample.view.camera[3:].reshape(3, 3).T @ (sample.view.marker[:3] - sample.view.camera[:3])
    u = int(np.clip(body.camera.centre[0] - body.camera.focal * x / z, 60, body.camera.width - 60))
    v = int(np.clip(body.camera.centre[1] + body.camera.focal * y / z, 50, body.camera.height - 50))
    part = reading.image()[v - 50 : v + 50, u - 60 : u + 60]
    return cv2.resize(part, None, fx=2, fy=2, interpolation=cv2.INTER_NEAREST)


def sheet(rows: list[list[Image]]) -> Image:
    framed = [[np.pad(p, ((GAP, 0), (GAP, 0), (0, 0)), constant_values=255) for p in row] for row in rows]
    return np.pad(np.vstack([np.hstack(row) for row in framed]), ((0, GAP), (0, GAP), (0, 0)), constant_values=255)


def saved_in(folder: Path, body: MujocoBody) -> tuple[float, float]:
    """Shares of a run's frames with a hit, and of every tenth in which no picture need be drawn."""
    run, sizes = load_run(folder), optics(body.camera, body.marker)
    arms, heads = run.postures("arm")[::10], run.postures("head")[::10]
    views = (body.view(arm, head) for arm, head in zip(arms, heads, strict=True))
    drawn = [may_be_seen(view.camera, view.marker, *sizes) for view in views]
    return float(run.frames(["hit"])["hit"].to_numpy().mean()), 1.0 - float(np.mean(drawn))


def compare_parts(body: MujocoBody, count: int, rng: np.random.Generator) -> None:
    """Print in how many pictures that may show a tag the eye answers otherwise when it has only a part of them."""
    part, whole = FiducialEye(body.camera, body.marker), FiducialEye(body.camera, body.marker, skip=False)
    vantages, sizes = Vantages.of(body), optics(body.camera, body.marker)
    print("gaze | pictures | hits | answers that differ | share of the picture")
    for name, noise in (("directed", NOISE), ("around the hand", 0.4), ("uniform", None)):
        areas, differ, hits = [], 0, 0
        for _ in range(count):
            arm = rng.uniform(body.arm.lower, body.arm.upper)
            head = uniform_head(body, rng) if noise is None else gaze_directed_head(vantages, arm, rng, noise)
            view = body.view(arm, head)
            left, top, right, bottom = part_with_tags(view.camera, view.marker, *sizes)
            if right == 0:
                continue
            areas.append((right - left) * (bottom - top) / body.camera.width / body.camera.height)
            seen, answer = whole.look(body.place(arm, head)), part.look(body.place(arm, head))
            hits, differ = hits + (seen is not None), differ + (seen != answer)
        print(f"| {name} | {len(areas)} | {hits} | {differ} | {np.mean(areas):.0%} |")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("docs/img"))
    parser.add_argument("--run", type=Path)
    parser.add_argument("--parts", type=int)
    args = parser.parse_args()
    body = MujocoBody("nao", motion="kinematic")
    if args.parts:
        compare_parts(body, args.parts, np.random.default_rng(1))
        body.close()
        return
    rendered, model = FiducialEye(body.camera, body.marker), GeometricEye(body.camera, body.marker, body.occluders)
    vantages, rng = Vantages.of(body), np.random.default_rng(0)
    arms = rng.uniform(body.arm.lower, body.arm.upper, (3 * HALF, len(body.arm)))
    directed = [draw(body, rendered, arm, gaze_directed_head(vantages, arm, rng)) for arm in arms[: 2 * HALF]]
    uniform = [draw(body, rendered, arm, uniform_head(body, rng)) for arm in arms[2 * HALF :]]
    print("postures | both | only geometric | only rendered | neither | agree | px median, 95 %, largest | same tag")
    sets = {"calibration": directed[:HALF], "gaze-directed": directed[HALF:], "uniform": uniform}
    for name, samples in sets.items():
        print(name, table(samples, [model.find(s.view) for s in samples]))
    calibrate(body, directed[:HALF])
    apart = [[s for s in directed if (s.rendered is None) == only and (model.find(s.view) is not None) == only]
             for only in (True, False)]  # fmt: skip
    args.out.mkdir(parents=True, exist_ok=True)
    rows = [[crop(body, s) for s in kind[k : k + 8]] for kind in apart for k in (0, 8)]
    cv2.imwrite(str(args.out / "eyes_apart.jpg"), sheet(rows)[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, 85])
    if args.run:
        hits, unneeded = saved_in(args.run, body)
        print(f"\nhits {hits:.1%}, no picture needed {unneeded:.1%}")
    body.close()


if __name__ == "__main__":
    main()
