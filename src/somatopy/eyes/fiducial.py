"""The real eye: OpenCV's ArUco detector on the camera's picture."""

from __future__ import annotations

import cv2
import numpy as np

from somatopy.eyes.frustum import may_be_seen, optics
from somatopy.percept import Camera, Floats, Image, Marker, Reading, Sighting

__all__ = ["FiducialEye"]


class FiducialEye:
    """Finds the cube of ArUco tags in a picture, and in it the hand's centre.

    Of several tags the largest counts. The hand's centre lies half a cube's edge behind that tag; its pixel comes
    from the tag's pose (infinitesimal plane-based pose estimation, Collins and Bartoli, IJCV 2014).

    Args:
        camera: size and focal length of the pictures.
        marker: sizes, ids and dictionary of the tags; the dictionary is cut down to these ids.
        skip: whether to spare pictures that can show no tag, where the body knows its true poses. The test is
            conservative (see `frustum`): the answers are the same with it and without.

    Example:
        >>> dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50)
        >>> picture = np.full((240, 320, 3), 255, np.uint8)
        >>> picture[90:150, 130:190] = cv2.aruco.generateImageMarker(dictionary, 2, 60)[..., None]
        >>> eye = FiducialEye(Camera("eye", 320, 240, fovy=0.83), Marker())
        >>> list(eye.detect(picture))
        [2]
    """

    def __init__(self, camera: Camera, marker: Marker, skip: bool = True) -> None:
        if not hasattr(cv2.aruco, marker.dictionary):
            names = [name for name in dir(cv2.aruco) if name.startswith("DICT_")]
            raise ValueError(f"OpenCV has no tag dictionary {marker.dictionary!r}. Available: {', '.join(names)}.")
        cv2.setNumThreads(1)
        whole = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, marker.dictionary))
        kept = cv2.aruco.Dictionary(whole.bytesList[list(marker.ids)], whole.markerSize, whole.maxCorrectionBits)
        parameters = cv2.aruco.DetectorParameters()
        parameters.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_CONTOUR
        self._detector = cv2.aruco.ArucoDetector(kept, parameters)
        self._ids = marker.ids
        self._skip, self._optics = skip, optics(camera, marker)
        self._shape = (camera.height, camera.width, 3)
        u, v = camera.centre
        self._intrinsics = np.array([[camera.focal, 0, u], [0, camera.focal, v], [0, 0, 1]])
        half = 0.5 * marker.tag_size
        self._tag = np.array([[-half, half, 0], [half, half, 0], [half, -half, 0], [-half, -half, 0]])
        self._depth = 0.5 * marker.size

    def look(self, reading: Reading) -> Sighting | None:
        """Detect the marker in the reading's picture.

        Raises:
            ValueError: the reading has no picture, or one of another size than the camera's.
        """
        view = reading.view
        if self._skip and view is not None and not may_be_seen(view.camera, view.marker, *self._optics):
            return None
        if reading.image is None:
            raise ValueError("This body takes no pictures; the fiducial eye needs some. Use another eye.")
        image = reading.image()
        if image.shape != self._shape:
            raise ValueError(f"The picture has shape {image.shape}, but the camera was said to take {self._shape}.")
        tags = self.detect(image)
        if not tags:
            return None
        tag, corners = max(tags.items(), key=lambda item: _area(item[1]))
        return Sighting(pixel=self._centre(corners), tag=tag, area=_area(corners))

    def detect(self, image: Image) -> dict[int, Floats]:
        """Corners, (4, 2) px, of each tag in an RGB picture, top left first and clockwise, by tag id."""
        corners, indices, _ = self._detector.detectMarkers(cv2.cvtColor(image, cv2.COLOR_RGB2GRAY))
        if indices is None:
            return {}
        found = sorted(zip(indices.ravel(), corners, strict=True), key=lambda tag: _area(tag[1][0]))
        return {self._ids[int(k)]: np.asarray(c[0], float) for k, c in found}

    def _centre(self, corners: Floats) -> tuple[float, float]:
        """Pixel of the cube's centre, which lies behind the tag.

        The tag's axes are taken as x right, y down, z into the cube, from whichever corner is the upper left one in the
        image: OpenCV's solver fails on rotations by exactly 180 degrees, and the centre is the same for all four.
        """
        around = np.roll(corners, -int(corners.sum(axis=1).argmin()), axis=0)[::-1]
        _, turn, shift = cv2.solvePnP(self._tag, around, self._intrinsics, None, flags=cv2.SOLVEPNP_IPPE_SQUARE)
        centre = shift.ravel() + self._depth * cv2.Rodrigues(turn)[0][:, 2]
        u, v, w = self._intrinsics @ centre
        return float(u / w), float(v / w)


def _area(corners: Floats) -> float:
    """Area of a quadrangle, px^2 (shoelace formula)."""
    x, y = np.asarray(corners, float).T
    return 0.5 * abs(float(x @ np.roll(y, -1) - y @ np.roll(x, -1)))
