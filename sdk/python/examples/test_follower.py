"""Tests of the follower without a system."""

import unittest

from armor.messages import LaserScan
from armor.testing import Report, TestedComponent
from follower import Follower


class TestFollower(unittest.TestCase):
    def test_it_turns_to_what_is_near_and_stops_there(self) -> None:
        follower = TestedComponent(Follower, speed="0.5m/s")
        follower.start()
        scan = LaserScan(angle_min=-0.5, angle_increment=0.5, range_min=0.1, ranges=[3.0, 2.0, 1.0])
        follower.send("scan", scan)
        follower.tick(0.1)
        velocity = follower.last_output("velocity")
        self.assertGreater(velocity.linear.x, 0.4)
        self.assertEqual(velocity.angular.z, 0.75)
        follower.send("scan", LaserScan(range_min=0.1, ranges=[0.5]))
        follower.tick(0.1)
        self.assertEqual(follower.last_output("velocity").linear.x, 0.0)
        self.assertEqual(follower.reports, [Report("event", "reached", 0.5)])


if __name__ == "__main__":
    unittest.main()
