"""An eye of your own: it sees the hand within a cone around the optical axis."""

import numpy as np

from somatopy.percept import Column, Sighting


class Cone:
    """Sees the hand if the angle between the optical axis and the line to the hand is small enough.

    `columns` declares what the eye adds to the record of frames.
    """

    columns = (Column("off_axis_deg", "float", "angle between the optical axis and the hand, degrees", "deg"),)

    def __init__(self, body, angle: float = 20.0):
        self.camera, self.angle = body.camera, np.radians(angle)
        self.off_axis = np.nan

    def look(self, reading):
        if reading.view is None:
            raise ValueError("This body does not know its true poses; the cone needs them.")
        self.off_axis = reading.view.gaze_error
        if self.off_axis > self.angle:
            return None
        camera, hand = reading.view.camera, reading.view.marker[:3]
        x, y, z = camera[3:].reshape(3, 3).T @ (hand - camera[:3])
        u, v = self.camera.centre
        return Sighting((u - self.camera.focal * x / z, v + self.camera.focal * y / z), tag=0, area=100.0)

    def probes(self):
        return {"off_axis_deg": float(np.degrees(self.off_axis))}
