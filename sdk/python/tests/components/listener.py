#!/usr/bin/env python3
"""Publishes what it has received, and checks the pictures that it keeps."""

import logging
from typing import Any, List, Union

import armor
from armor.messages import Count, Image


@armor.message
class Tally:
    counts: int
    pictures: int
    lost: int
    spoilt: int
    note: str = ""


class Listener(armor.Component):
    """Counts what it receives."""

    ends_by_itself = False
    step = armor.parameter(1, live=True)

    def __init__(self) -> None:
        self.subscribe("count", Count)
        self.subscribe("picture", Image)
        self.provide("tally", Tally, latched=True)
        self.tally = Tally(0, 0, 0, 0)
        self.kept: List[Image] = []

    def data_received(self, header: armor.Header, data: Union[Count, Image]) -> None:
        self.tally.lost += header.lost
        if isinstance(data, Count):
            self.tally.counts += self.step
            return
        self.tally.pictures += 1
        self.kept = [*self.kept[-2:], data]
        # What is kept stays as it was: the publisher does not use its memory again.
        for kept in self.kept:
            if kept.data.min() != kept.data.max():
                self.tally.spoilt += 1

    def exec(self, call: armor.Call) -> Any:
        if call == armor.Call.STARTED:
            logging.info("it begins")
        if call == armor.Call.STOPPING:
            print("stopped in order")
        else:
            self.send_data("tally", self.tally)


if __name__ == "__main__":
    armor.run(Listener)
