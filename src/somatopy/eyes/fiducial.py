"""The fiducial eye: OpenCV's ArUco detector, applied to the camera's picture."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated

import cv2
import numpy as np
from typing_extensions import Doc

from somatopy.eyes.frustum import optics, part_with_tags
from somatopy.percept import Camera, Floats, Image, Marker, Part, Picture, Reading, Sighting
from somatopy.registry import BuildContext, Settings

__all__ = ["Fiducial", "FiducialEye"]


class FiducialEye:
    """Finds the cube of ArUco tags in a picture, and the pixel of the hand's centre.

    If several tags are found, the largest one counts. The hand's centre lies half a cube's edge behind that tag; its
    pixel comes
    from the tag's pose (infinitesimal plane-based pose estimation, Collins and Bartoli, IJCV 2014).

    Args:
        camera: size and intrinsics of the pictures.
        marker: sizes, ids and dictionary of the tags. Only these ids of the dictionary are looked for.
        skip: whether to save time by not drawing and searching pictures, or parts of pictures, that can show no tag.
            This needs a body that knows its true poses. docs/eyes.md says how it was tested.

    Example:
        >>> dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50)
        >>> picture = np.full((240, 320, 3), 255, np.uint8)
        >>> picture[90:150, 130:190] = cv2.aruco.generateImageMarker(dictionary, 2, 60)[..., None]
        >>> eye = FiducialEye(Camera("eye", 320, 240, fovy=0.83), Marker())
        >>> list(eye.detect(picture))
        [2]
    """

    #: A session then finds out at its start whether pictures can be drawn at all.
    needs_pictures = True

    def __init__(self, camera: Camera, marker: Marker, skip: bool = True) -> None:
        if not hasattr(cv2.aruco, marker.dictionary):
            names = [name for name in dir(cv2.aruco) if name.startswith("DICT_")]
            raise ValueError(f"OpenCV has no tag dictionary {marker.dictionary!r}. Available: {', '.join(names)}.")
        cv2.setNumThreads(1)
        whole = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, marker.dictionary))
        kept = cv2.aruco.Dictionary(whole.bytesList[list(marker.ids)], whole.markerSize, whole.maxCorrectionBits)
        self._parameters = cv2.aruco.DetectorParameters()
        self._parameters.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_CONTOUR
        self._detector = cv2.aruco.ArucoDetector(kept, self._parameters)
        self._ids = marker.ids
        self._skip, self._optics = skip, optics(camera, marker)
        self._whole = 0, 0, camera.width, camera.height
        side, rates = max(camera.width, camera.height), self._parameters
        self._outlines = int(rates.minMarkerPerimeterRate * side), int(rates.maxMarkerPerimeterRate * side)
        (across, along), (u, v) = camera.focals, camera.centre
        self._intrinsics = np.array([[across, 0, u], [0, along, v], [0, 0, 1]])
        half = 0.5 * marker.tag_size
        self._tag = np.array([[-half, half, 0], [half, half, 0], [half, -half, 0], [-half, -half, 0]])
        self._depth = 0.5 * marker.size

    def look(self, reading: Reading) -> Sighting | None:
        """Detect the marker in the reading's picture.

        Raises:
            ValueError: the reading has no picture, or one of another size than the camera's.
        """
        view, part = reading.view, self._whole
        if self._skip and view is not None:
            part = part_with_tags(view.camera, view.marker, *self._optics)
            if part[2] == 0:
                return None
        if reading.image is None:
            raise ValueError("This body takes no pictures, which the fiducial eye needs. Use another eye.")
        tags = self.detect(self._taken(reading.image, part), part)
        if not tags:
            return None
        tag, corners = max(tags.items(), key=lambda item: _area(item[1]))
        return Sighting(pixel=self._centre(corners), tag=tag, area=_area(corners))

    def _taken(self, image: Callable[[], Image], part: Part) -> Image:
        """That part of a picture; if the picture can be drawn in parts, only that is drawn."""
        left, top, right, bottom = part
        if part != self._whole and isinstance(image, Picture) and image.comes_in_parts:
            return image.part(left, top, right, bottom)
        whole, expected = image(), (self._whole[3], self._whole[2], 3)
        if whole.shape != expected:
            raise ValueError(f"The picture has shape {whole.shape}, but the camera was said to take {expected}.")
        return whole[top:bottom, left:right]

    def detect(self, image: Image, part: Part | None = None) -> dict[int, Floats]:
        """Corners of each tag in an RGB picture, (4, 2) px, clockwise from the top left, by tag id.

        Args:
            image: a whole picture, or a part of one.
            part: place of the part in the whole picture; corners count in the whole. The detector fits lines to
                outlines in single precision, so that its last digits depend on the place. The part is therefore
                searched at its place in the whole picture: its first row and column are repeated to the picture's
                edges.
        """
        left, top, *_ = part or self._whole
        grey = cv2.cvtColor(image, cv2.COLOR_RGB2GRAY)
        if left or top:
            grey = cv2.copyMakeBorder(grey, top, 0, left, 0, cv2.BORDER_REPLICATE)
        self._expect_outlines_in(max(grey.shape))
        corners, indices, _ = self._detector.detectMarkers(grey)
        if indices is None:
            return {}
        found = sorted(zip(indices.ravel(), corners, strict=True), key=lambda tag: _area(tag[1][0]))
        return {self._ids[int(k)]: np.asarray(c[0], float) for k, c in found}

    def _expect_outlines_in(self, side: int) -> None:
        """Accept outlines of the same lengths, px, in a part with this longer side as in a whole picture.

        OpenCV takes them as shares of the longer side and rounds down.
        """
        least, most = self._outlines
        self._parameters.minMarkerPerimeterRate = (least + 0.5) / side
        self._parameters.maxMarkerPerimeterRate = (most + 0.5) / side
        self._detector.setDetectorParameters(self._parameters)

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
    (x0, y0), (x1, y1), (x2, y2), (x3, y3) = corners.tolist()
    twice: float = (x0 * y1 + x1 * y2 + x2 * y3 + x3 * y0) - (y0 * x1 + y1 * x2 + y2 * x3 + y3 * x0)
    return 0.5 * abs(twice)


@dataclass(frozen=True)
class Fiducial(Settings):
    """OpenCV's ArUco detector on the camera's picture."""

    skip: Annotated[
        bool, Doc("Whether to spare pictures, and parts of pictures, that can show no tag (docs/eyes.md).")
    ] = True

    def build(self, context: BuildContext) -> FiducialEye:
        """The eye behind the camera of `context.body`."""
        return FiducialEye(context.body.camera, context.body.marker, self.skip)
