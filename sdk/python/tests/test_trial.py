"""`python -m armor.testing`: a component of a script, without a system."""

from __future__ import annotations

import subprocess
import sys
import unittest
from pathlib import Path

HERE = Path(__file__).parent
FOLLOWER = str(HERE.parent / "examples" / "follower.py")
FAULTY = str(HERE / "components" / "faulty.py")


def run(*words: str) -> "subprocess.CompletedProcess[str]":
    command = [sys.executable, "-m", "armor.testing", *words]
    return subprocess.run(command, capture_output=True, text=True, timeout=60)


class TestTrial(unittest.TestCase):
    def test_messages_and_time_lead_to_what_is_published_and_reported(self) -> None:
        far = "scan=LaserScan(ranges=[2.0], range_max=8)"
        near = "scan=LaserScan(ranges=[0.3], range_max=8)"
        ran = run(FOLLOWER, "speed=0.5m/s", far, "0.25", "speed=0.2m/s", "0.25", near, "0.5")
        self.assertEqual((ran.returncode, ran.stderr), (0, ""))
        lines = ran.stdout.splitlines()
        self.assertTrue(lines[1].startswith("   0.250 s  velocity  Twist(linear=Vector3(x=0.5,"), lines)
        self.assertTrue(lines[2].startswith("   0.500 s  velocity  Twist(linear=Vector3(x=0.2,"), lines)
        self.assertTrue(lines[3].startswith("   1.000 s  velocity  Twist(linear=Vector3(x=0.0,"), lines)
        self.assertTrue(lines[4].startswith("   1.000 s  reports event reached 0.3"), lines)

    def test_a_failure_ends_it_with_its_reason(self) -> None:
        ran = run(FAULTY, "way=raise", *["0.1"] * 9)
        self.assertEqual(ran.returncode, 1)
        self.assertEqual(len(ran.stdout.splitlines()), 6)
        self.assertIn("reports failed: RuntimeError: on purpose (faulty.py, line", ran.stdout)
        self.assertIn("error: `faulty` has failed: RuntimeError: on purpose", ran.stderr)

    def test_mistakes_are_named(self) -> None:
        for words, code, why in [
            ([], 2, "usage: python -m armor.testing SCRIPT"),
            (["none.py"], 2, "none.py is no script of Python"),
            ([str(HERE / "test_trial.py")], 2, "one class of armor.Component; it has none"),
            ([FOLLOWER, "scna=LaserScan()"], 2, "`scna` is neither an input nor a parameter (there are: scan,"),
            ([FOLLOWER, "scan=LaserScn()"], 2, "NameError: name 'LaserScn' is not defined"),
            ([FOLLOWER, "soon"], 2, "`soon` is no step: give SECONDS, INPUT=MESSAGE or PARAMETER=VALUE"),
            ([FOLLOWER, "scan=Twist()"], 1, "`scan` is declared as LaserScan, but the test uses it as Twist"),
            ([FOLLOWER, "speed=9m/s", "1"], 1, "`9m/s` is out of range, 0 to 1 m/s"),
        ]:
            with self.subTest(why):
                ran = run(*words)
                self.assertEqual(ran.returncode, code, ran.stderr)
                self.assertIn(why, ran.stderr)
                self.assertNotIn("Traceback", ran.stderr)


if __name__ == "__main__":
    unittest.main()
