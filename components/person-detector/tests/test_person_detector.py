"""Tests of the detector without a system, on drawn pictures: grey people before a bright wall."""

from __future__ import annotations

import sys
import unittest
from pathlib import Path
from typing import List, Tuple

import cv2
import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

import armor
from armor.messages import CompressedImage, Image
from armor.testing import Report, TestedComponent
from people import arrange
from person_detector import PersonDetector

SIZE = (480, 360)


def draw(*people: Tuple[int, int]) -> np.ndarray:
    """A picture with a figure at each (middle column, height in pixels); all stand on row 330."""
    picture = np.full((SIZE[1], SIZE[0], 3), 200, np.uint8)
    rows, columns = np.mgrid[: SIZE[1], : SIZE[0]]
    for middle, height in people:
        # In metres of a person of 1.75 m: from the middle, and above the floor.
        aside = np.abs(columns - middle) * 1.75 / height
        above = (330 - rows) * 1.75 / height
        legs = (above >= 0.0) & (above < 0.8) & (aside > 0.03) & (aside < 0.17)
        trunk = (above >= 0.8) & (above < 1.35) & (aside < 0.22)
        shoulders = (above >= 1.35) & (above < 1.52) & (aside < 0.22 - (above - 1.35))
        head = (aside / 0.1) ** 2 + ((above - 1.63) / 0.12) ** 2 < 1.0
        picture[legs | trunk | shoulders | head] = (60, 70, 80)
    return picture


def image(picture: np.ndarray, encoding: str = "bgr8", padding: int = 0) -> Image:
    """The picture as a message, each row with some more bytes behind it."""
    height, width = picture.shape[:2]
    rows = np.pad(picture.reshape(height, -1), ((0, 0), (0, padding)))
    return Image(
        stamp=7.5, frame="camera", height=height, width=width, encoding=encoding, step=rows.shape[1], data=rows
    )


def detector(**parameters: object) -> "TestedComponent[PersonDetector]":
    tested = TestedComponent(PersonDetector, **parameters)
    tested.execute_on_data()
    tested.start()
    return tested


class TestPictures(unittest.TestCase):
    def check(self, tested: "TestedComponent[PersonDetector]", people: List[Tuple[int, int]]) -> None:
        found = tested.last_output("people")
        self.assertEqual((found.stamp, found.frame, found.width, found.height), (7.5, "camera", *SIZE))
        self.assertEqual(len(found.detections), len(people), found.detections)
        columns = sorted(detection.center_x for detection in found.detections)
        for column, (middle, _) in zip(columns, sorted(people)):
            self.assertAlmostEqual(column, middle, delta=15)
        for detection in found.detections:
            self.assertEqual(detection.label, "person")
            self.assertGreaterEqual(detection.score, 0.5)
            # The window is a third higher than the person, who stands on row 330.
            foot = detection.center_y + detection.size_y / 2.0
            self.assertTrue(320 < foot < 400, detection)

    def test_people_are_found_where_they_stand(self) -> None:
        for people in ([(240, 200)], [(120, 180), (350, 220)], []):
            tested = detector()
            tested.send("image", image(draw(*people)))
            self.check(tested, people)

    def test_every_encoding_is_read_and_rows_may_be_longer_than_their_pixels(self) -> None:
        picture = draw((200, 200))
        grey = picture[:, :, 0]
        for message in (
            image(picture, padding=5),
            image(picture[:, :, ::-1], "rgb8"),
            image(grey, "mono8", padding=3),
        ):
            tested = detector()
            tested.send("image", message)
            self.check(tested, [(200, 200)])

    def test_compressed_pictures_are_searched(self) -> None:
        for suffix in (".jpg", ".png"):
            _, data = cv2.imencode(suffix, draw((200, 200)))
            tested = detector()
            tested.send("compressed", CompressedImage(stamp=7.5, frame="camera", format=suffix[1:], data=data))
            self.check(tested, [(200, 200)])

    def test_a_small_picture_is_enlarged_and_the_detections_are_in_its_own_pixels(self) -> None:
        picture = cv2.resize(draw((240, 200)), None, fx=0.25, fy=0.25, interpolation=cv2.INTER_AREA)
        tested = detector()
        tested.send("image", image(picture))
        self.assertEqual(tested.last_output("people").detections, [])
        tested = detector(scale=4.0)
        tested.send("image", image(picture))
        (found,) = tested.last_output("people").detections
        self.assertAlmostEqual(found.center_x, 60, delta=4)
        tested = detector()
        tested.send("image", image(np.zeros((2, 3, 3), np.uint8)))
        self.assertEqual(tested.last_output("people").detections, [])

    def test_what_is_no_picture_is_a_failure_with_the_reason(self) -> None:
        picture = image(draw())
        wrong = [
            (Image(width=4, height=4, step=4, encoding="bayer", data=np.zeros(16, np.uint8)), "'bayer'"),
            (Image(width=picture.width, height=9, step=4, encoding="mono8"), "rows of 4 are no image of 480 x 9"),
            (Image(width=4, height=4, step=4, encoding="mono8", data=np.zeros(15, np.uint8)), "15 bytes"),
        ]
        for message, why in wrong:
            with self.assertRaisesRegex(armor.TestError, why):
                detector().send("image", message)
        for data in (b"", b"\xff\xd8 damaged"):
            with self.assertRaisesRegex(armor.TestError, "no picture in JPEG or PNG"):
                detector().send("compressed", CompressedImage(data=data))

    def test_an_image_is_arranged_without_a_copy(self) -> None:
        data = np.zeros(6 * 20, np.uint8)
        self.assertTrue(np.shares_memory(arrange(data, 6, 6, 20, "rgb8"), data))


class TestReports(unittest.TestCase):
    def test_people_are_reported_once_and_their_leaving_too(self) -> None:
        tested = detector(confirm=2)
        for is_there in (True, False, True, True, True, False, True, False, False, False):
            tested.pass_time(1.0)
            tested.send("image", image(draw((240, 200)) if is_there else draw()))
        self.assertEqual(tested.reports, [Report("event", "appeared", 1.0), Report("event", "gone", 1.0)])
        self.assertEqual([flag.data for flag in tested.outputs("present")], [False, True, False])

    def test_pictures_beyond_the_rate_are_skipped(self) -> None:
        tested = detector(max_rate="2Hz")
        picture = image(draw())
        for _ in range(10):
            tested.pass_time(0.1)
            tested.send("image", picture)
        self.assertEqual(len(tested.outputs("people")), 2)

    def test_an_activation_begins_without_what_was_seen_before(self) -> None:
        tested = detector(confirm=1)
        tested.pass_time(1.0)
        tested.send("image", image(draw((240, 200))))
        self.assertEqual(len(tested.reports), 1)
        tested.stop()
        tested.start()
        self.assertFalse(tested.last_output("present").data)
        tested.pass_time(1.0)
        tested.send("image", image(draw((240, 200))))
        self.assertEqual(len(tested.reports), 2)


if __name__ == "__main__":
    unittest.main()
