#!/usr/bin/env python3
"""Plans paths over a grid map: A* on its cells, around walls and not too near to them."""
import heapq
import math

import numpy as np

import armor
from armor.messages import OccupancyGrid, Path, Point, Pose, PoseStamped, PoseWithCovarianceStamped


class PythonPlanner(armor.Component):
    """Plans a path over the map to the goal that has priority."""

    radius = armor.parameter(0.25, unit="m", range=(0.02, 5.0), doc="kept free around the robot's centre")
    timeout = armor.parameter(0.5, unit="s", range=(0.05, 10.0), doc="a goal older than this is ignored")
    reports_done = False
    stale_after = {"goal": "timeout", "override": "timeout"}

    def __init__(self):
        self.subscribe("map", OccupancyGrid)
        self.subscribe("pose", PoseWithCovarianceStamped)
        self.subscribe("goal", PoseStamped, optional=True)
        self.subscribe("override", PoseStamped, optional=True, doc="has priority over the other goal")
        self.provide("path", Path)
        self.newest = {}

    def data_received(self, header, data):
        self.newest[header.id] = (header.stamp_s, data)
        if header.id == "map":
            cells = data.data.reshape(data.info.height, data.info.width)
            near, walls = math.ceil(self.radius / data.info.resolution), cells >= 50
            cost = np.where(grow(walls, 2 * near), 4.0, 1.0)
            cost[grow(walls, near)] = 50.0  # not forbidden: the robot may stand there
            self.cost = np.where(walls | (cells < 0), np.inf, cost).tolist()

    def exec(self, call):
        fresh = [self.newest[id] for id in ("override", "goal") if id in self.newest]
        goals = [goal for stamp_s, goal in fresh if self.timestamp() - stamp_s < self.timeout]
        if not goals or not {"map", "pose"} <= self.newest.keys():
            return
        grid, robot, goal = self.newest["map"][1], self.newest["pose"][1].pose.pose, goals[0].pose
        corner, size = grid.info.origin.position, grid.info.resolution
        ends = [((it.position.y - corner.y) // size, (it.position.x - corner.x) // size) for it in (robot, goal)]
        ends = [(int(row), int(column)) for row, column in ends]
        cells = search(self.cost, *ends)
        places = [Point(x=corner.x + (x + 0.5) * size, y=corner.y + (y + 0.5) * size) for y, x in cells]
        poses = [PoseStamped(pose=Pose(position=it, orientation=goal.orientation)) for it in places]
        self.send_data("path", Path(stamp=self.timestamp(), frame=grid.frame, poses=poses))


def grow(walls, cells):
    """The cells that are at most so many cells away from a wall."""
    grown, (height, width) = walls.copy(), walls.shape
    for y, x in np.argwhere(np.hypot(*np.mgrid[-cells : cells + 1, -cells : cells + 1]) <= cells) - cells:
        there = walls[max(-y, 0) : height - max(y, 0), max(-x, 0) : width - max(x, 0)]
        grown[max(y, 0) : height + min(y, 0), max(x, 0) : width + min(x, 0)] |= there
    return grown


def search(cost, start, goal):
    """The cells of the cheapest way from start to goal, or to the cell nearest to it that can be reached."""
    before, spent, nearest, waiting = {start: start}, {start: 0.0}, start, [(0.0, start)]
    while waiting and nearest != goal:
        y, x = here = heapq.heappop(waiting)[1]
        nearest = min(nearest, here, key=lambda cell: math.dist(cell, goal))
        for cell in ((y + dy, x + dx) for dy in (-1, 0, 1) for dx in (-1, 0, 1)):
            if 0 <= cell[0] < len(cost) and 0 <= cell[1] < len(cost[0]):
                now = spent[here] + cost[cell[0]][cell[1]] * math.dist(cell, here)
                if now < spent.get(cell, math.inf):
                    before[cell], spent[cell] = here, now
                    heapq.heappush(waiting, (now + math.dist(cell, goal), cell))
    way = [nearest]
    while way[-1] != start:
        way.append(before[way[-1]])
    return way[::-1]


if __name__ == "__main__":
    armor.run(PythonPlanner)
