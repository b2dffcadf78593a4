"""The clock of experiments: lengths of frames, minutes and windows."""

from __future__ import annotations

__all__ = ["DISTORTION_WIDTH", "FRAME", "FRAMES_PER_MINUTE", "FRAMES_PER_SECOND", "TEN_SECONDS", "WINDOW"]

#: Frames in a second of robot time.
FRAMES_PER_SECOND = 15
#: Length of a frame, s.
FRAME = 1.0 / FRAMES_PER_SECOND
FRAMES_PER_MINUTE = 60 * FRAMES_PER_SECOND
#: Frames in ten seconds, the step in which learning curves are read.
TEN_SECONDS = 10 * FRAMES_PER_SECOND
#: Frames in a window, over which the paper counts hits: five minutes. A part of the record holds one window.
WINDOW = 5 * FRAMES_PER_MINUTE
#: Frames over which the paper averages distortion: two minutes.
DISTORTION_WIDTH = 2 * FRAMES_PER_MINUTE
