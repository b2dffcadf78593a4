"""Measure the robots in examples/robots, and draw them: the table in their README.md and a picture for each page.

usage: python docs/make_robots.py [--out runs/robots] [--seeds N] [--pictures]

Every robot runs with the preset `paper`, physics and the geometric eye, 30 minutes intact under five learners. The
paper's learner and the best one go on for 15 more with the arm vector shifted. Then comes the best fixed head for two
minutes under each of the two eyes.
All robots have the same settings. Needs `pip install "somatopy[robots]"` and `pip install --no-deps gym-aloha`. The
study goes on where it was stopped. `--pictures` draws the pictures alone.
"""

from __future__ import annotations

import argparse
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path

import cv2
import mujoco
import numpy as np
import pyarrow as pa
import pyarrow.compute as pc

import somatopy
from somatopy import paper
from somatopy.bodies import MujocoBody
from somatopy.experiment.changes import changed
from somatopy.experiment.description import Description
from somatopy.eyes import FiducialEye, GeometricEye
from somatopy.percept import Floats, Image

FOLDER = Path(__file__).parents[1] / "examples" / "robots"
LEARNERS = ("hebbian", "best", "fixed", "nearest", "random")
EYES = ("geometric", "fiducial")
GAP = 6
SIZE = 480  # px, height of the pictures


@dataclass(frozen=True)
class Shot:
    """Where a camera in the room stands: it looks at a place (m) from a distance (m); angles in degrees."""

    at: tuple[float, float, float]
    distance: float
    azimuth: float
    elevation: float


#: From where each robot is drawn.
SHOTS = {
    "aloha": Shot((0, 0.5, 0.2), 1.7, 75, -25),
    "cmu_humanoid": Shot((0, -0.1, 1.3), 1.9, 130, -10),
    "fetch": Shot((1.1, 0.7, 0.7), 2.6, 215, -20),
    "jaco": Shot((0.25, 0.1, 0.4), 1.6, 50, -20),
}


def conditions() -> dict[str, Description]:
    """Each robot under each learner, and with a fixed head under each eye."""
    sorts = {learner: {"learner": learner, "minutes": 30, "damage_minutes": 0} for learner in LEARNERS}
    sorts["hebbian"]["damage_minutes"] = sorts["best"]["damage_minutes"] = 15
    sorts |= {eye: {"learner": "fixed", "minutes": 2, "damage_minutes": 0, "eye": eye} for eye in EYES}
    fixed = {"eye": "geometric", "motion": "dynamic"}
    return {
        f"{robot}, {name}": changed(paper(), {"body.model": str(FOLDER / f"{robot}.toml"), **fixed, **short})
        for name, short in sorts.items()
        for robot in SHOTS
    }


def rates(table: pa.Table, robot: str, what: str, phase: int, column: str = "rate") -> Floats:
    """A column's values in one condition and phase, one for each seed."""
    here = pc.and_(pc.equal(table["condition"], f"{robot}, {what}"), pc.equal(table["phase"], phase))
    return table.filter(here)[column].to_numpy()


def row(table: pa.Table, robot: str) -> str:
    """A robot's row of the table: shares of frames in percent, and the time of the paper's learner."""
    name = MujocoBody(FOLDER / f"{robot}.toml", motion="kinematic").anatomy.name
    shares = [
        rates(table, robot, "hebbian", 0, "ceiling"),
        *(rates(table, robot, learner, 0) for learner in ("fixed", "nearest", "random")),
        *(rates(table, robot, learner, phase) for learner in ("hebbian", "best") for phase in (0, 1)),
        *(rates(table, robot, eye, 0) for eye in EYES),
    ]
    frames = rates(table, robot, "hebbian", 0, "frames") + rates(table, robot, "hebbian", 1, "frames")
    times = rates(table, robot, "hebbian", 0, "cpu_s") / frames
    cells = [f"{100 * share.mean():.0f}" if share.size else "" for share in shares]
    return f"| [{name}]({robot}.md) | {' | '.join(cells)} | {1e3 * times.mean():.1f} |"


def write_table(table: pa.Table) -> None:
    """Put the rows into README.md, between the head of the table and the next empty line."""
    page = FOLDER / "README.md"
    before, rest = page.read_text(encoding="utf-8").split("|---|", 1)
    head, after = rest.split("\n", 1)
    after = after.split("\n\n", 1)[1] if not after.startswith("\n") else after[1:]
    rows = "\n".join(row(table, robot) for robot in SHOTS)
    page.write_text(f"{before}|---|{head}\n{rows}\n\n{after}", encoding="utf-8")


def looking(body: MujocoBody, arm: Floats) -> Floats:
    """The head posture, of many at random, with the hand nearest to the middle of the picture."""
    eye = GeometricEye(body.camera, body.marker, body.occluders)
    heads = np.random.default_rng(0).uniform(*body.head.space.limits.T, (4000, len(body.head)))

    def aside(head: Floats) -> float:
        seen = eye.find(body.view(arm, head))
        return np.inf if seen is None else float(np.hypot(*np.subtract(seen.pixel, body.camera.centre)))

    return min((body.legal(head) for head in heads), key=aside)


def outside(body: MujocoBody, shot: Shot, arm: Floats, head: Floats) -> Image:
    """The body in a posture from a place in the room; its own camera is put there, so that it has no use afterwards."""
    model, k = body.model, body.model.camera(body.camera.name).id
    around, up = np.deg2rad([shot.azimuth, shot.elevation])
    ahead = np.array([np.cos(up) * np.cos(around), np.cos(up) * np.sin(around), np.sin(up)])
    right = np.cross(ahead, (0, 0, 1))
    right /= np.linalg.norm(right)
    mujoco.mju_mat2Quat(model.cam_quat[k], np.column_stack([right, np.cross(right, ahead), -ahead]).ravel())
    model.cam_bodyid[k], model.cam_pos[k], model.cam_fovy[k] = 0, np.array(shot.at) - shot.distance * ahead, 45.0
    model.cam_mode[k], model.cam_sensorsize[k] = mujoco.mjtCamLight.mjCAMLIGHT_FIXED, 0.0
    body.place(arm, head)
    return np.array(body.picture(width=SIZE, height=SIZE))


def draw(robot: str) -> Image:
    """A robot from outside, and beside it what its eye sees, the tags outlined."""
    with closing(MujocoBody(FOLDER / f"{robot}.toml", motion="kinematic")) as body:
        arm = body.reset().arm
        head = looking(body, arm)
        body.place(arm, head)
        seen = np.array(body.picture())
        eye = FiducialEye(body.camera, body.marker, skip=False)
        for corners in eye.detect(seen).values():
            cv2.polylines(seen, [corners.round().astype(int)], True, (255, 120, 0), 3, cv2.LINE_AA)
        seen = cv2.resize(seen, (SIZE * body.camera.width // body.camera.height, SIZE))
        with closing(body.another()) as shown:
            room = outside(shown, SHOTS[robot], arm, head)
    return np.hstack([room, np.full((SIZE, GAP, 3), 255, np.uint8), seen])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("runs/robots"), help="the study folder")
    parser.add_argument("--seeds", type=int, default=1)
    parser.add_argument("--pictures", action="store_true", help="draw the pictures alone")
    args = parser.parse_args()
    (FOLDER / "img").mkdir(exist_ok=True)
    for robot in SHOTS:
        cv2.imwrite(str(FOLDER / "img" / f"{robot}.jpg"), draw(robot)[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, 88])
    if not args.pictures:
        write_table(somatopy.study(conditions(), seeds=args.seeds, eye=None, out=args.out, processes=1).table)


if __name__ == "__main__":
    main()
