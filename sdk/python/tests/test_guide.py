"""The listings of the documents run as they are printed."""

from __future__ import annotations

import re
import sys
import types
import unittest
from pathlib import Path
from typing import Any, Dict, List
from unittest import mock

import armor
from armor.messages import Count, LaserScan
from armor.testing import TestedComponent

ROOT = Path(__file__).parents[3]


def listings(document: str) -> List[str]:
    text = (ROOT / document).read_text()
    return re.findall(r"```python\n(.*?)```", text, re.DOTALL)


def run_listing(code: str, name: str) -> Dict[str, Any]:
    """The names that a listing defines; `armor.run` does nothing in it."""
    module = types.ModuleType(name)
    sys.modules[name] = module
    with mock.patch.object(armor, "run"):
        exec(compile(code, name, "exec"), vars(module))
    return vars(module)


class TestListings(unittest.TestCase):
    def test_the_guide(self) -> None:
        packages, component, messages, relay, test, _ = listings("docs/python.md")
        self.assertIn("# /// script\n# dependencies = [", packages)
        follower = TestedComponent(run_listing(component, "follower")["Follower"])
        follower.start()
        follower.send("scan", LaserScan(ranges=[0.9]))
        follower.tick()
        self.assertEqual(follower.last_output("velocity").linear.x, 0.3)
        newest = TestedComponent(run_listing("import armor\n" + relay, "relay")["Newest"])
        newest.start()
        newest.send("writers", Count(count=3))
        self.assertEqual(newest.outputs("element"), [Count(count=3)])
        run_listing(test, "test_follower")["test_it_stops_in_front_of_a_wall"]()
        reading = run_listing(messages, "reading")["Reading"]
        self.assertTrue(
            armor.schema_of(reading).startswith(
                "Reading{celsius:f64(degC),count:u32,mood:Mood<Calm,Busy>,spectrum:[f32],poses:[Pose2D{"
            )
        )

    def test_the_readme(self) -> None:
        (blinker,) = listings("README.md")
        tested = TestedComponent(run_listing(blinker, "blinker")["Blinker"])
        tested.start()
        tested.tick()
        self.assertEqual([flag.data for flag in tested.outputs("light")], [True, False])


if __name__ == "__main__":
    unittest.main()
