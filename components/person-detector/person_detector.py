#!/usr/bin/env python3
# /// script
# requires-python = ">=3.9"
# dependencies = [
#   "armor",
#   "opencv-python-headless<5",  # version 5 has no detector of this kind
# ]
# ///
"""The detector as a component: what it receives, what it publishes, and when it works."""

from __future__ import annotations

from typing import List, Optional, Union

import armor
from armor.messages import CompressedImage, Detection2D, Detection2DArray, Flag, Image
from people import PeopleFinder, Person, arrange, decompress


class PersonDetector(armor.Component):
    """Finds standing people in pictures."""

    threshold = armor.parameter(0.5, range=(0.0, 10.0), live=True, doc="least score of a person")
    scale = armor.parameter(
        1.0, range=(0.1, 8.0), live=True, doc="pictures are searched in this many times their size"
    )
    stride = armor.parameter(8, range=(4, 32), live=True, doc="pixels between two windows of the search")
    step = armor.parameter(
        1.05, range=(1.01, 2.0), live=True, doc="ratio of one size of people to the next in the search"
    )
    max_rate = armor.parameter(
        10.0, unit="Hz", range=(0.1, 1000.0), live=True, doc="pictures per second at most; others are skipped"
    )
    confirm = armor.parameter(
        2, range=(1, 1000), live=True, doc="pictures in a row with, or without, people until it is reported"
    )
    events = [
        armor.DeclaredEvent("appeared", "a person is seen; the value is the number of persons", value=int),
        armor.DeclaredEvent("gone", "no person is seen any more"),
    ]
    reports_done = False
    needs_one_of = [["image", "compressed"]]

    def __init__(self) -> None:
        self.subscribe("image", Image, optional=True, doc="pictures: rgb8, bgr8 or mono8")
        self.subscribe("compressed", CompressedImage, optional=True, doc="pictures as JPEG or PNG")
        self.provide("people", Detection2DArray, doc="the people in each picture that was searched")
        self.provide("present", Flag, latched=True, doc="whether a person is seen")
        self.finder = PeopleFinder()
        self.forget()

    def forget(self) -> None:
        self.newest: Union[Image, CompressedImage, None] = None
        self.searched_s = float("-inf")
        #: What was reported last, and the pictures in a row that contradict it.
        self.present = False
        self.contradictions = 0

    def data_received(self, header: armor.Header, data: Union[Image, CompressedImage]) -> None:
        self.newest = data

    def exec(self, call: armor.Call) -> Optional[armor.Outcome]:
        if call == armor.Call.STARTED:
            self.forget()
            self.send_data("present", Flag(data=False))
            return None
        newest, now_s = self.newest, self.timestamp()
        # Half a millisecond less: a picture at exactly this rate is not late because of its jitter.
        is_due = abs(now_s - self.searched_s) >= 1.0 / self.max_rate - 0.0005
        if call == armor.Call.STOPPING or newest is None or not is_due:
            return None
        self.newest, self.searched_s = None, now_s
        return self.report(self.search(newest))

    def search(self, image: Union[Image, CompressedImage]) -> List[Person]:
        if isinstance(image, CompressedImage):
            picture = decompress(image.data)
        else:
            picture = arrange(image.data, image.width, image.height, image.step, image.encoding)
        people = self.finder.find(
            picture, threshold=self.threshold, scale=self.scale, stride=self.stride, step=self.step
        )
        found = [
            Detection2D(
                label="person",
                score=person.score,
                center_x=person.left + person.width / 2.0,
                center_y=person.top + person.height / 2.0,
                size_x=person.width,
                size_y=person.height,
            )
            for person in people
        ]
        height, width = picture.shape[:2]
        detections = Detection2DArray(
            stamp=image.stamp, frame=image.frame, height=height, width=width, detections=found
        )
        self.send_data("people", detections)
        return people

    def report(self, people: List[Person]) -> Optional[armor.Outcome]:
        self.contradictions = self.contradictions + 1 if bool(people) != self.present else 0
        if self.contradictions < self.confirm:
            return None
        self.present, self.contradictions = bool(people), 0
        self.send_data("present", Flag(data=self.present))
        return armor.event("appeared", len(people)) if people else armor.event("gone")


if __name__ == "__main__":
    armor.run(PersonDetector)
