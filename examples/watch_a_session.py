"""Run an experiment frame by frame without writing files, and stop when the hand was seen often enough.

usage: python watch_a_session.py [MINUTES of robot time at most, 1 by default] [--pictures]

With --pictures the robot looks through its rendered camera, which needs OpenGL, and the first picture with the hand in
it is kept as hand.png in the current folder.
"""

import sys
from pathlib import Path

import matplotlib.image
import numpy as np

from somatopy import Session, paper
from somatopy.experiment import frames_of

ENOUGH = 300


class Diary:
    """A sink: the session calls it with every frame. It prints every ten seconds how far the gaze was off."""

    def __init__(self):
        self.errors = []

    def __call__(self, frame):
        self.errors.append(np.rad2deg(frame.reading.view.gaze_error))
        if len(self.errors) == 150:
            print(f"{frame.reading.time:5.1f} s: {np.median(self.errors):3.0f} degrees from the hand (median)")
            self.errors.clear()


def keep_first_hit(frame):
    """A sink that saves the first picture with a hit. It asks for pictures, so the session draws them while it can."""
    if frame.sighting is not None and not Path("hand.png").exists():
        matplotlib.image.imsave("hand.png", frame.reading.image())


pictures, words = "--pictures" in sys.argv, [word for word in sys.argv[1:] if word != "--pictures"]
phase = paper().phases[0].replaced(frames=frames_of(float(words[0]) if words else 1.0))
eye = {"kind": "fiducial" if pictures else "geometric"}
with Session(paper().replaced(eye=eye, body={"motion": "kinematic"}, phases=[phase])) as session:
    session.attach(Diary())
    if pictures:
        session.attach(keep_first_hit, pictures=True)
    for _ in session:
        if session.hits == ENOUGH:  # whoever iterates a session may stop, go on, or go back to a state()
            break
    print(f"the hand was seen in {session.hits} of {session.done} frames")
    for part, seconds in session.seconds.items():
        print(f"{part:>8}: {1e6 * seconds / session.done:5.0f} microseconds a frame")
