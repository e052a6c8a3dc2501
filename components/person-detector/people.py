"""Finds standing people in pictures, with OpenCV's detector: histograms of oriented gradients and a linear
classifier (Dalal & Triggs, Histograms of Oriented Gradients for Human Detection, CVPR 2005).
"""

from __future__ import annotations

from typing import Any, List, NamedTuple

import cv2
import numpy as np

# OpenCV 5 has no such detector. An import that fails is reported with the package to install.
from cv2 import HOGDescriptor, HOGDescriptor_getDefaultPeopleDetector

#: The window of the detector in pixels: a person fills about three quarters of its height.
WINDOW = (64, 128)
#: Pixels around a picture that are searched, too, so that people at its edges are found.
MARGIN = 16


class Person(NamedTuple):
    """A person in a picture, in its pixels: how sure it is, and the window around the person."""

    score: float
    left: float
    top: float
    width: float
    height: float


class PeopleFinder:
    """Searches pictures for people."""

    def __init__(self) -> None:
        self._detector: Any = HOGDescriptor()
        self._detector.setSVMDetector(HOGDescriptor_getDefaultPeopleDetector())

    def find(
        self, picture: np.ndarray, *, threshold: float, scale: float, stride: int, step: float
    ) -> List[Person]:
        """The people in a picture of one or three 8-bit channels, the surest first.

        `threshold`: least distance from the classifier's plane. `scale`: the picture is searched in this
        many times its size. `stride`: pixels from one window to the next. `step`: ratio of one size of
        people that is searched for to the next.
        """
        if scale != 1.0:
            picture = cv2.resize(picture, None, fx=scale, fy=scale, interpolation=cv2.INTER_LINEAR)
        height, width = picture.shape[:2]
        if width + 2 * MARGIN < WINDOW[0] or height + 2 * MARGIN < WINDOW[1]:
            return []
        windows, scores = self._detector.detectMultiScale(
            np.ascontiguousarray(picture),
            hitThreshold=threshold,
            winStride=(stride, stride),
            padding=(MARGIN, MARGIN),
            scale=step,
        )
        people = [
            Person(float(score), *(float(side) / scale for side in window))
            for window, score in zip(windows, np.ravel(scores))
        ]
        return sorted(people, reverse=True)


#: The channels of an encoding of an image.
CHANNELS = {"rgb8": 3, "bgr8": 3, "mono8": 1}


def arrange(data: np.ndarray, width: int, height: int, row: int, encoding: str) -> np.ndarray:
    """The bytes of an image as a picture, without a copy; `row`: bytes from one row to the next.

    The order of the colours does not matter to the detector.
    """
    channels = CHANNELS.get(encoding)
    if channels is None:
        raise ValueError(f"an image in {encoding!r} cannot be searched, only in {', '.join(CHANNELS)}")
    if row < width * channels or len(data) < height * row:
        raise ValueError(
            f"{len(data)} bytes in rows of {row} are no image of {width} x {height} pixels in {encoding}"
        )
    rows = data[: height * row].reshape(height, row)[:, : width * channels]
    return rows if channels == 1 else rows.reshape(height, width, channels)


def decompress(data: np.ndarray) -> np.ndarray:
    """The picture in a JPEG or PNG file."""
    picture = cv2.imdecode(data, cv2.IMREAD_COLOR) if len(data) else None
    if picture is None:
        raise ValueError(f"{len(data)} bytes are no picture in JPEG or PNG, or a damaged one")
    return picture
