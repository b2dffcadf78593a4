"""Draw the pictures of the README and docs: the robot from outside, and ten frames of its own camera.

usage: python docs/make_pictures.py RUN [--out docs/img]

The frames are drawn from the arm and head postures that the run folder recorded, and looked at by the same detector.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import cv2
import numpy as np

from somatopy import FiducialEye, MujocoBody, load_run
from somatopy.analysis.runs import Run
from somatopy.percept import Image, Reading

GAP = 6


def postures(run: Run, frames: list[int], body: MujocoBody) -> list[tuple[np.ndarray, np.ndarray]]:
    """Recorded arm and head postures of some frames."""
    names = [f"arm_{n}_rad" for n in body.arm.names] + [f"head_{n}_rad" for n in body.head.names]
    table = run.frames(names).to_pandas().to_numpy()[frames]
    return [(row[: len(body.arm)], row[len(body.arm) :]) for row in table]


def annotated(eye: FiducialEye, reading: Reading) -> Image:
    """The robot's picture with the tags that were found, and the hand's centre."""
    picture = reading.image().copy()
    for tag, corners in eye.detect(picture).items():
        cv2.polylines(picture, [corners.round().astype(int)], True, (255, 120, 0), 2, cv2.LINE_AA)
        cv2.putText(
            picture, str(tag), corners[0].astype(int), cv2.FONT_HERSHEY_SIMPLEX, 0.5, (0, 90, 255), 1, cv2.LINE_AA
        )
    seen = eye.look(reading)
    if seen is not None:
        cv2.drawMarker(picture, tuple(np.round(seen.pixel).astype(int)), (0, 200, 80), cv2.MARKER_CROSS, 16, 2)
    return picture


def sheet(pictures: list[Image], columns: int) -> Image:
    """Pictures side by side, with white gaps."""
    framed = [np.pad(p, ((GAP, 0), (GAP, 0), (0, 0)), constant_values=255) for p in pictures]
    rows = [np.hstack(framed[k : k + columns]) for k in range(0, len(framed), columns)]
    return np.pad(np.vstack(rows), ((0, GAP), (0, GAP), (0, 0)), constant_values=255)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("run", type=Path, help="a run folder with the rendered eye")
    parser.add_argument("--out", type=Path, default=Path("docs/img"))
    args = parser.parse_args()
    args.out.mkdir(parents=True, exist_ok=True)
    run = load_run(args.run)
    body = MujocoBody(motion="kinematic", arm_speed=None)
    eye = FiducialEye(body.camera, body.marker)
    hits = run.frames(["hit"])["hit"].to_numpy()
    frames = np.linspace(0, len(hits) - 1, 12, dtype=int)[1:-1].tolist()
    pictures = []
    for arm, head in postures(run, frames, body):
        pictures.append(annotated(eye, place(body, arm, head)))
    cv2.imwrite(str(args.out / "head_camera.png"), sheet(pictures, 5)[..., ::-1])
    steady = next(k for k in range(len(hits) // 2, len(hits)) if hits[k : k + 15].all())
    [(arm, head)] = postures(run, [steady], body)
    reading = place(body, arm, head)
    outside = body.picture("outside", 720, 720)
    inset = cv2.resize(annotated(eye, reading), (480, 360), interpolation=cv2.INTER_AREA)
    canvas = np.full((720, 720 + GAP + 480, 3), 255, np.uint8)
    canvas[:, :720] = outside
    canvas[:360, 726:] = inset
    cv2.imwrite(str(args.out / "robot.png"), canvas[..., ::-1])
    body.close()


def place(body: MujocoBody, arm: np.ndarray, head: np.ndarray) -> Reading:
    """Bring the kinematic body to a posture, however far."""
    for _ in range(12):
        reading = body.step(arm, head)
    return reading


if __name__ == "__main__":
    main()
