#!/usr/bin/env python3
"""Drives after the nearest thing that the laser sees."""

from __future__ import annotations

import math
from typing import Optional

import numpy as np

import armor
from armor.messages import LaserScan, Twist, Vector3


class Follower(armor.Component):
    """Follows the nearest thing that the laser sees."""

    speed = armor.parameter(0.3, unit="m/s", range=(0.0, 1.0), live=True, doc="forward speed")
    distance = armor.parameter(0.6, unit="m", range=(0.1, 5.0), doc="where it stops")
    events = [armor.DeclaredEvent("reached", "the thing is near", value=float, unit="m")]
    needs_rate = True

    def __init__(self) -> None:
        self.provide("velocity", Twist, doc="forward and turning speed")
        self.subscribe("scan", LaserScan, doc="what lies around the robot")
        self.bearing = 0.0
        self.range: Optional[float] = None

    def data_received(self, header: armor.Header, data: LaserScan) -> None:
        ranges = np.where(data.ranges >= data.range_min, data.ranges, np.inf)
        nearest = int(np.argmin(ranges))
        self.range = float(ranges[nearest])
        self.bearing = data.angle_min + nearest * data.angle_increment

    def exec(self, call: armor.Call) -> Optional[armor.Outcome]:
        if call == armor.Call.STOPPING or self.range is None or math.isinf(self.range):
            self.send_data("velocity", Twist())
            return None
        if self.range < self.distance:
            self.send_data("velocity", Twist())
            return armor.event("reached", self.range)
        forward = self.speed * max(0.0, math.cos(self.bearing))
        turning = Vector3(z=1.5 * self.bearing)
        self.send_data("velocity", Twist(linear=Vector3(x=forward), angular=turning))
        return None


if __name__ == "__main__":
    armor.run(Follower)
