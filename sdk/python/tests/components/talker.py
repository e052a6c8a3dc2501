#!/usr/bin/env python3
"""Counts, and publishes pictures whose bytes all are the count."""

import numpy as np

import armor
from armor.messages import Count, Image


class Talker(armor.Component):
    """Counts and publishes pictures."""

    size = armor.parameter(300_000, range=(1, 10_000_000))

    def __init__(self) -> None:
        self.provide("count", Count)
        self.provide("picture", Image)
        self.count = 0

    def exec(self, call: armor.Call) -> None:
        if call == armor.Call.TICK:
            self.count += 1
            self.send_data("count", Count(count=self.count))
            data = np.full(self.size, self.count % 256, np.uint8)
            self.send_data("picture", Image(width=self.size, height=1, data=data))


if __name__ == "__main__":
    armor.run(Talker)
