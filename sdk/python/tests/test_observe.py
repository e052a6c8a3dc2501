"""A running system, observed from a script: a small real one, of components in Python.

`ARMOR` names the program `armor`; without it, it is looked for in PATH.
"""

from __future__ import annotations

import asyncio
import contextlib
import io
import os
import shutil
import signal
import subprocess
import tempfile
import threading
import time
import unittest
from pathlib import Path
from typing import List

import armor
from armor._observe import Observer, class_of_schema
from armor.messages import Count, Image, Pose2D
from test_guide import listings
from test_systems import ARMOR, COMPONENTS, LIMIT_S, environment

SYSTEM = """<armor version="1">
  <system name="python-observe">
    <component name="talker" kind="talker" rate="50Hz"/>
    <component name="listener" kind="listener" rate="10Hz"/>
    <link from="talker.count" to="listener.count" keep="all"/>
    <link from="talker.picture" to="listener.picture"/>
  </system>
  <mission name="python-observe" safe="stopped">
    <place name="work" initial="true" components="talker"/>
    <place name="rest"/>
    <place name="stopped"/>
    <transition name="pause-it" from="work" to="rest" operator="true"/>
    <transition name="go-on" from="rest" to="work" operator="true"/>
    <transition name="end" from="rest" to="stopped" operator="true"/>
  </mission>
</armor>
"""


class TestClasses(unittest.TestCase):
    def test_a_schema_is_a_standard_class_or_one_that_is_made(self) -> None:
        self.assertIs(class_of_schema(armor.schema_of(Image)), Image)
        pose = armor.schema_of(Pose2D)
        schema = (
            f"Own{{stamp:f64(s),from:string,side:Side<Left,Right>,at:{pose},maybe:?u8,"
            f"rows:[f32](m),names:[string],three:[f64;3]}}"
        )
        own = class_of_schema(schema)
        self.assertEqual(armor.schema_of(own), schema)
        self.assertIs(class_of_schema(schema), own)
        with self.assertRaisesRegex(armor.MessageError, "Mode.On has fields"):
            class_of_schema("Own{mode:Mode<Off,On{level:u8}>}")
        with self.assertRaises(armor.MessageError):
            class_of_schema("Own{")


class TestAddresses(unittest.TestCase):
    def test_what_is_no_system_is_refused(self) -> None:
        with self.assertRaisesRegex(armor.ArmorError, "no such system runs"):
            armor.observe("no-such-system")
        with self.assertRaisesRegex(ValueError, "is no address"):
            armor.observe("nowhere.invalid:port")


@unittest.skipUnless(ARMOR, "the program `armor` is not in PATH; ARMOR names it")
class TestSystem(unittest.TestCase):
    folder: Path
    name: str
    run_process: "subprocess.Popen[bytes]"
    system: Observer

    @classmethod
    def setUpClass(cls) -> None:
        cls.folder = Path(tempfile.mkdtemp())
        cls.addClassCleanup(shutil.rmtree, cls.folder, True)
        components = cls.folder / "components"
        components.mkdir()
        for kind in ("talker", "listener"):
            shutil.copy(COMPONENTS / f"{kind}.py", components)
        file = cls.folder / "system.xml"
        file.write_text(SYSTEM)
        cls.name = f"python-observe-{os.getpid()}"
        command = [ARMOR, "run", str(file), "--headless", "--system", cls.name]
        with (cls.folder / "log").open("w") as log:
            cls.run_process = subprocess.Popen(
                [*command, "--out", str(cls.folder / "out")], env=environment(), stdout=log, stderr=log
            )
        cls.addClassCleanup(cls.end_run)
        cls.system = cls.await_system()
        cls.addClassCleanup(cls.system.close)

    @classmethod
    def end_run(cls) -> None:
        cls.run_process.send_signal(signal.SIGINT)
        cls.run_process.wait(LIMIT_S)

    @classmethod
    def await_system(cls) -> Observer:
        deadline = time.monotonic() + LIMIT_S
        while True:
            try:
                system = armor.observe(cls.name)
                states = {process.name: process.state for process in system.processes()}
                if states.get("talker") == "active" and states.get("listener") == "active":
                    return system
            except armor.ArmorError:
                pass
            if time.monotonic() > deadline or cls.run_process.poll() is not None:
                raise AssertionError((cls.folder / "log").read_text())
            time.sleep(0.05)

    def test_the_listing_of_the_guide(self) -> None:
        listing = next(text for text in listings("docs/python.md") if '"office"' in text)
        for text, here in [
            ('"office"', repr(self.name)),
            ("simulator.odometry", "talker.count"),
            ('"pose.pose.position.x", "twist.twist.linear.x"', '"count"'),
            ("pose.pose.position.x", "count"),
            ("twist.twist.linear.x", "count"),
            ("count=100", "count=5"),
        ]:
            self.assertIn(text, listing)
            listing = listing.replace(text, here)
        printed = io.StringIO()
        with contextlib.redirect_stdout(printed):
            exec(compile(listing, "listing", "exec"), {})
        self.assertEqual(len(printed.getvalue().splitlines()), 1 + 10 + 1 + 10)

    def test_outputs_and_processes_are_listed(self) -> None:
        outputs = {output.data: output for output in self.system.outputs()}
        self.assertEqual(outputs["talker.count"].type, "Count")
        self.assertTrue(outputs["listener.tally"].latched)
        kinds = {process.name: process.kind for process in self.system.processes()}
        self.assertEqual(kinds["listener"], "listener")
        with armor.observe(self.system._native.registry) as same:
            self.assertEqual({output.data for output in same.outputs()}, set(outputs))

    def test_messages_are_read_in_order_and_into_arrays(self) -> None:
        received = list(self.system.read("talker.count", 10, keep=1000))
        counts = [message.data.count for message in received]
        self.assertEqual(counts, list(range(counts[0], counts[0] + 10)))
        self.assertEqual({message.header.data for message in received}, {"talker.count"})
        (picture,) = self.system.read("talker.picture", 1)
        self.assertIs(type(picture.data), Image)
        arrays = self.system.arrays("talker.count", "count", count=5)
        self.assertEqual(list(arrays["count"] - arrays["count"][0]), [0, 1, 2, 3, 4])
        self.assertTrue((arrays["stamp_s"][1:] > arrays["stamp_s"][:-1]).all())
        with self.assertRaisesRegex(armor.ArmorError, "Count has no field `cuont`.*count"):
            self.system.arrays("talker.count", "cuont", count=1)

    def test_what_is_not_published_is_refused_and_what_does_not_come_ends(self) -> None:
        with self.assertRaisesRegex(armor.ArmorError, "talker.nothing"):
            self.system.read("talker.nothing")
        with self.assertRaisesRegex(ValueError, "keep is 1 to"):
            self.system.read("talker.count", keep=0)
        with self.system.publish("hand.silent", Count):
            self.assertEqual(list(self.system.read("hand.silent", timeout=0.1)), [])

    def test_messages_are_read_by_asyncio(self) -> None:
        async def read_both() -> List[int]:
            async def count_of(data: str) -> int:
                count = 0
                async for _ in self.system.stream(data, 5):
                    count += 1
                return count

            return list(await asyncio.gather(count_of("talker.count"), count_of("talker.picture")))

        self.assertEqual(asyncio.run(read_both()), [5, 5])

    def test_a_closed_observer_ends_the_iterators_that_wait(self) -> None:
        system = armor.observe(self.name)
        has_begun = threading.Event()

        def read_all() -> None:
            for _ in system.read("talker.count"):
                has_begun.set()

        reader = threading.Thread(target=read_all)
        reader.start()
        self.assertTrue(has_begun.wait(LIMIT_S))
        system.close()
        reader.join(LIMIT_S)
        self.assertFalse(reader.is_alive())
        with self.assertRaisesRegex(armor.ArmorError, "closed"):
            system.read("talker.count")

    def test_a_published_message_arrives_at_those_who_read_it(self) -> None:
        threads = len(os.listdir("/proc/self/task"))
        with self.assertRaisesRegex(armor.ArmorError, "the name `talker` belongs to the component"):
            self.system.publish("talker.other", Count)
        # A publisher that is refused does not try again, and take the name later.
        deadline = time.monotonic() + LIMIT_S
        while len(os.listdir("/proc/self/task")) > threads:
            self.assertLess(time.monotonic(), deadline, "its threads are still there")
            time.sleep(0.05)
        with self.system.publish("hand.count", Count, latched=True) as publisher:
            with self.assertRaisesRegex(TypeError, "a Count is published here"):
                publisher.send(Image())
            publisher.send(Count(count=7))
            (received,) = self.system.read("hand.count", 1)
            self.assertEqual((received.data.count, received.header.lost), (7, 0))
        with self.assertRaisesRegex(armor.SendError, "closed"):
            publisher.send(Count(count=2))

    def test_parameters_are_listed_and_set(self) -> None:
        step = [it for it in self.system.parameters("listener") if it.name == "step"]
        self.assertEqual((step[0].value, step[0].live), ("1", True))
        (change,) = self.system.set_parameter("listener.step", "2")
        self.assertIn("step", change)
        self.assertEqual(self.system.parameters("listener")[0].value, "2")
        with self.assertRaisesRegex(armor.ArmorError, "step"):
            self.system.set_parameter("listener.step", "much")
        with self.assertRaises(ValueError):
            self.system.set_parameter("listener", "2")
        self.system.set_parameter("listener.step", None)

    def test_orders_reach_the_mission_and_a_refusal_has_its_reason(self) -> None:
        with self.assertRaisesRegex(armor.ArmorError, "go-on"):
            self.system.fire("go-on")
        self.system.pause()
        self.system.resume()
        with self.assertRaisesRegex(armor.ArmorError, "(?s)move|pause"):
            self.system.move("work", "rest")


if __name__ == "__main__":
    unittest.main()
