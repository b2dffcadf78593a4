"""Draw the pictures of the README and docs: ten frames of the robot's camera, figures of a run, the film of the demo.

usage: python docs/make_pictures.py RUN [--demo DEMO] [--out docs/img]

The frames are drawn from the arm and head postures that the run folder recorded, and looked at by the same detector.
DEMO is the folder that `somatopy demo` wrote; its film is copied as demo.gif.
"""

from __future__ import annotations

import argparse
import shutil
from pathlib import Path

import cv2
import numpy as np

from somatopy import load_run
from somatopy.experiment.film import Photograph, photographs
from somatopy.percept import Image

GAP = 6


def annotated(photograph: Photograph) -> Image:
    """A picture with the tags that were found outlined, and a cross on the hand's centre."""
    picture = photograph.image.copy()
    for tag, corners in photograph.tags.items():
        cv2.polylines(picture, [corners.round().astype(int)], True, (255, 120, 0), 2, cv2.LINE_AA)
        cv2.putText(
            picture, str(tag), corners[0].astype(int), cv2.FONT_HERSHEY_SIMPLEX, 0.5, (0, 90, 255), 1, cv2.LINE_AA
        )
    if photograph.pixel is not None:
        cv2.drawMarker(picture, np.round(photograph.pixel).astype(int), (0, 200, 80), cv2.MARKER_CROSS, 16, 2)
    return picture


def sheet(pictures: list[Image], columns: int) -> Image:
    """Pictures side by side, with white gaps."""
    framed = [np.pad(p, ((GAP, 0), (GAP, 0), (0, 0)), constant_values=255) for p in pictures]
    rows = [np.hstack(framed[k : k + columns]) for k in range(0, len(framed), columns)]
    return np.pad(np.vstack(rows), ((0, GAP), (0, GAP), (0, 0)), constant_values=255)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("run", type=Path, help="a run folder")
    parser.add_argument("--demo", type=Path, help="the folder of somatopy demo")
    parser.add_argument("--out", type=Path, default=Path("docs/img"))
    args = parser.parse_args()
    args.out.mkdir(parents=True, exist_ok=True)
    run = load_run(args.run)
    arms, heads = run.postures("arm"), run.postures("head")
    frames = np.linspace(0, len(arms) - 1, 12, dtype=int)[1:-1]
    ten = [annotated(photograph) for photograph in photographs(run.description["body"], arms[frames], heads[frames])]
    cv2.imwrite(str(args.out / "head_camera.png"), sheet(ten, 5)[..., ::-1])
    for name in ("figure3", "figure4", "figure5", "efficiency", "filmstrip"):
        shutil.copy2(args.run / "figures" / f"{name}.png", args.out)
    if args.demo is not None:
        shutil.copy2(args.demo / "film.gif", args.out / "demo.gif")


if __name__ == "__main__":
    main()
