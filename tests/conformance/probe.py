#!/usr/bin/env python3
"""The probe of the conformance test in Python; see probe.rs."""

import enum
import logging
import os
import pathlib
import sys
import time
from typing import Annotated, Any, Dict, List, Optional

import numpy
from numpy.typing import NDArray

import armor
from armor.messages import Count, Image, Number, Pose2D

IMAGE_LEN = 1 << 20


class Side(enum.Enum):
    Left = 0
    Right = 1


@armor.message
class Part:
    id: armor.i32
    name: str


@armor.message
class Mixed:
    flag: bool
    small: armor.i8
    wide: armor.u64
    number: Annotated[float, armor.unit("m")]
    single: armor.f32
    text: str
    maybe: Optional[float]
    side: Side
    pose: Pose2D
    parts: List[Part]
    numbers: NDArray[numpy.float64]
    fixed: Annotated[List[float], armor.fixed(3)]


def note(text: str) -> None:
    """Writes what the test looks for into the log."""
    logging.info("seen: %s", text)


def read_behaviour() -> str:
    """The behaviour of this process is the name of the component."""
    for index, argument in enumerate(sys.argv):
        if argument.startswith("--name="):
            return argument[len("--name=") :]
        if argument == "--name":
            return sys.argv[index + 1]
    return ""


def refusal(work: Any) -> None:
    try:
        work()
        note("nothing is refused")
    except Exception as error:
        note(f"refused: {error}")


def lower(flag: bool) -> str:
    return str(flag).lower()


class Probe(armor.Component):
    """Shows how a component behaves."""

    number = armor.parameter(0.3, unit="m/s", range=(0.0, 1.0), live=True, doc="A speed.")
    whole = armor.parameter(7, doc="A whole number.")
    flag = armor.parameter(False, doc="A flag.")
    text = armor.parameter("none", doc="A text.")
    file = armor.parameter(pathlib.Path("mark"), doc="A file.")
    reads_all = True
    events = [
        armor.DeclaredEvent("near", "something is near", value=float, unit="m"),
        armor.DeclaredEvent("over", "it is over"),
    ]

    def __init__(self) -> None:
        self.behaviour = read_behaviour()
        self.provide("out", Count)
        self.provide("state", Count, latched=True)
        self.provide("mixed", Mixed)
        self.provide("image", Image)
        self.subscribe("in", Count, optional=True)
        self.subscribe("other", Count, optional=True)
        self.subscribe("many", Count, optional=True, many=True)
        self.subscribe("mixed_in", Mixed, optional=True)
        self.subscribe("image_in", Image, optional=True)
        self.subscribe("any_in", armor.AnyMessage, optional=True, many=True)
        self.provide("any_out", armor.AnyMessage)
        self.provide("any_last", armor.AnyMessage, latched=True)
        if self.behaviour == "declare-twice":
            self.provide("out", Count)
        if self.behaviour == "declare-bad-name":
            self.provide("7 up", Count)
        if self.behaviour == "construct-fails":
            raise RuntimeError("no hardware")
        self.ticks = self.received = self.published = self.images = self.mixed = 0
        self.kept: Optional[Image] = None
        self.any: Optional[armor.AnyMessage] = None
        self.stamps: Dict[int, float] = {}
        self.since_s = 0.0

    def parameter_received(self, name: str, value: Any) -> None:
        if name == "number" and value == 0.9:
            raise ValueError("0.9 is not for this probe")
        note(f"parameter {name}={lower(value) if name == 'flag' else value}")

    def data_received(self, header: armor.Header, data: Any) -> None:
        self.received += 1
        if header.id == "mixed_in":
            return self.receive_mixed(data)
        if header.id == "image_in":
            return self.receive_image(data)
        if header.id == "any_in":
            return self.pass_on(header, data)
        if self.behaviour == "any-receiver":
            self.compare_stamps(header, data)
        if self.received <= 40:
            note(f"data {header.id} count={data.count} lost={header.lost} from={header.data}")
        if self.received == 1:
            recent = abs(self.timestamp() - header.stamp_s) < 5.0
            note(f"stamp recent={lower(recent)} instance={lower(header.instance != 0)}")
        if self.behaviour == "data-failure":
            raise ValueError("the data are spoilt")
        if self.behaviour in ("history", "history-forgotten") and self.received <= 4:
            self.show_history()
        if self.behaviour == "history-none" and self.received == 1:
            refusal(lambda: self.history("in"))
            refusal(lambda: self.history("none"))

    def pass_on(self, header: armor.Header, message: armor.AnyMessage) -> None:
        if self.any is None:
            self.any = message
            same = lower(message.stamp_s == header.stamp_s)
            note(f"any type={message.type_name} schema={message.schema} len={len(message)} stamp={same}")
        self.send_data("any_out", message)

    def compare_stamps(self, header: armor.Header, data: Count) -> None:
        if header.id == "in":
            self.stamps[data.count] = header.stamp_s
        elif data.count in self.stamps:
            # Two sources have the same counts; one of them is the source of `in`.
            if self.stamps[data.count] == header.stamp_s:
                note("passed on with its stamp=true")

    def show_history(self) -> None:
        history = self.history("in")
        counts = [past.data.count for past in history]
        note("history " + " ".join(str(count - counts[-1]) for count in counts))
        if self.received == 4:
            stamps = [past.header.stamp_s for past in history]
            ages = {past.header.sequence: age for age, past in enumerate(history)}
            around = history.around((stamps[0] + stamps[1]) / 2.0)
            nearest = history.nearest(stamps[2] + 1e-4)
            assert around is not None and nearest is not None
            pair = [ages[past.header.sequence] for past in around]
            note(f"around {pair[0]} {pair[1]} nearest {ages[nearest.header.sequence]}")
            note(f"around nothing={lower(history.around(stamps[2] - 10.0) is None)}")

    def exec(self, call: armor.Call) -> Optional[armor.Outcome]:
        if call == armor.Call.STARTED:
            self.ticks = self.received = 0
        elif call != armor.Call.STOPPING:
            self.ticks += 1
        if self.ticks <= 5 or call == armor.Call.STOPPING:
            names = {armor.Call.STARTED: "started", armor.Call.TICK: "tick"}
            names.update({armor.Call.DATA: "data", armor.Call.STOPPING: "stopping"})
            note(f"call {names[call]}")
        if call == armor.Call.STARTED:
            self.begin()
        elif call != armor.Call.STOPPING:
            return self.work()
        return None

    def begin(self) -> None:
        self.since_s = self.timestamp()
        if self.behaviour == "declare-late":
            refusal(lambda: self.provide("late", Count))
        if self.behaviour == "forbid-late":
            refusal(self.set_non_controllable)
        if self.behaviour == "send-unknown":
            refusal(lambda: self.send_data("nothing", Count(count=1)))
        if self.behaviour == "send-wrong-type":
            refusal(lambda: self.send_data("out", Number(data=1.0)))
        if self.behaviour == "names":
            for name in ("out", "nothing"):
                note(f"provided {self.provided_data(name) or 'none'}")
            for name in ("in", "other"):
                note(f"subscribed {self.subscribed_data(name) or 'none'}")

    def work(self) -> Optional[armor.Outcome]:
        place = (self.behaviour, self.ticks)
        if place == ("failed", 2):
            return armor.failed("no power")
        if place == ("failed-silently", 2):
            return armor.failed("")
        if place == ("exception", 2):
            raise RuntimeError("no power at all")
        if place == ("done", 2):
            return armor.DONE
        if place == ("event", 3):
            return armor.event("near", 0.5)
        if place == ("event-undeclared", 2):
            return armor.event("far", 0.5)
        if place == ("crash", 2) and not self.file.exists():
            self.file.touch()
            os.abort()
        if place == ("hang", 2):
            time.sleep(600)
        if place == ("busy", 2):
            time.sleep(2.6)
        if self.behaviour in ("slow", "slow-all") and self.ticks <= 6:
            time.sleep(0.3)
        if place == ("freeze-in-exec", 2):
            time.sleep(1.5)
            note("the call ends")
        if place == ("print", 1):
            print("printed on stdout")
        if place == ("synchronize", 2):
            self.get_parameter("number")
            self.synchronize()
            note("synchronized")
        if place == ("time", 3):
            now_s = self.timestamp()
            right = abs(now_s - time.time()) < 5.0
            note(f"time right={lower(right)} passes={lower(now_s > self.since_s)}")
        if place == ("any", 5) and self.any is not None:
            self.send_data("any_last", self.any)
        if self.behaviour == "sender":
            self.published += 1
            self.send_data("out", Count(count=self.published))
        return None

    def receive_mixed(self, mixed: Mixed) -> None:
        self.mixed += 1
        if self.mixed == 1:
            note(f"mixed wide={mixed.wide} small={mixed.small} text={mixed.text}")
            maybe = "none" if mixed.maybe is None else mixed.maybe
            note(f"mixed maybe={maybe} parts={len(mixed.parts)} numbers={len(mixed.numbers)}")
        mixed.maybe = None
        self.send_data("mixed", mixed)

    def receive_image(self, image: Image) -> None:
        self.images += 1
        if self.images == 1:
            whole = len(image.data) == IMAGE_LEN and bool((image.data == image.data[0]).all())
            note(f"image whole={lower(whole)}")
        self.send_data("image", image)
        if self.kept is None:
            self.kept = image
        elif self.images == 4:
            same = bool((self.kept.data == self.kept.data[0]).all())
            note(f"kept unchanged={lower(same)}")


if __name__ == "__main__":
    armor.run(Probe)
