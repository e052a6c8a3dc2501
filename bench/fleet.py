#!/usr/bin/env python3
"""Prints a mission of 8 robots with 40 legs each, 5 exits from every leg, and 6 meetings.

    python3 bench/fleet.py > missions/fleet.xml
    armor check missions/fleet.xml

--deadlock     robot 7 waits for robot 6 after leg 30, without patience and without an order that leads on,
               and robot 6 may have parked where it does not end the mission
--exclusive    two robots have an arm each, which exclude each other, on legs that they may drive at the same time
--robots N     fewer robots
--legs N       fewer legs
--zones N      N no-go zones in rows between the legs and the rally points, around which every exit leads
"""

import argparse

# Which robots meet after which of their legs.
MEETINGS = [(0, 1, 10), (2, 3, 10), (4, 5, 10), (6, 7, 10), (1, 2, 20), (5, 6, 20)]
# The meeting without patience, and the robot that may park before it.
LAST_MEETING = (6, 7, 30)
PARKS, WAITS = 6, 7
# Robots with an arm, and the legs on which it works.
ARMS = {3: (15, 25), 4: (20, 30)}


def read_arguments():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    for flag in ("deadlock", "exclusive"):
        parser.add_argument(f"--{flag}", action="store_true")
    parser.add_argument("--robots", type=int, default=8)
    parser.add_argument("--legs", type=int, default=40)
    parser.add_argument("--zones", type=int, default=0)
    return parser.parse_args()


def print_system(options):
    print('<armor version="1">\n  <system>')
    print('    <frame name="laser" in="base_link" x="0.08m" z="0.2m"/>')
    print('    <component name="simulator" kind="simulator" rate="20Hz">')
    print('      <parameter name="world" value="worlds/office.svg"/>\n    </component>')
    print('    <component name="mapper" kind="grid-slam" rate="10Hz"/>')
    for robot in range(options.robots):
        print(f'    <component name="way{robot}" kind="patrol" rate="5Hz">')
        print('      <parameter name="route" value="0,0"/>\n    </component>')
        if options.exclusive and robot in ARMS:
            print(f'    <component name="arm{robot}" kind="chart" rate="1Hz"/>')
    print('    <link from="simulator.scan" to="mapper.scan" keep="10"/>')
    print('    <link from="simulator.odometry" to="mapper.odometry" keep="50"/>')
    for robot in range(options.robots):
        print(f'    <link from="mapper.pose" to="way{robot}.pose"/>')
    if options.zones:
        print_planners(options)
    print("  </system>")


def print_planners(options):
    """Planners that drive around the zones of the map."""
    print('    <component name="chart" kind="chart"/>')
    for robot in range(options.robots):
        print(f'    <component name="planner{robot}" kind="planner" rate="10Hz"/>')
        for output, port in [
            ("mapper.map", "map"),
            ("mapper.pose", "pose"),
            (f"way{robot}.goal", "goal"),
            ("chart.zones", "zones"),
        ]:
            print(f'    <link from="{output}" to="planner{robot}.{port}"/>')


def print_zones(options):
    """A row of zones for each robot, with gaps of 1 m."""
    width = 5 * options.legs * options.robots / options.zones
    for zone in range(options.zones):
        robot = zone * options.robots // options.zones
        place = zone - -(-robot * options.zones // options.robots)
        left, right = place * width, (place + 1) * width - 1
        low, high = 20 * robot + 3, 20 * robot + 4
        shape = f"{left:g},{low} {right:g},{low} {right:g},{high} {left:g},{high}"
        print(f'      <zone name="z{zone}" kind="no-go" shape="{shape}"/>')


def print_map(options):
    print('  <mission name="fleet" goal="over" safe="hold">\n    <map>')
    for robot in range(options.robots):
        y = 20 * robot
        for point in range(options.legs + 1):
            print(f'      <point name="P{robot}-{point}" at="{5 * point} {y + point % 2}"/>')
        print(f'      <rally name="R{robot}" at="100 {y + 6}"/>')
    if options.zones:
        print_zones(options)
    print("    </map>")


def steps_of(robot, options):
    lines = []
    for leg in range(1, options.legs + 1):
        first, last = ARMS.get(robot, (0, -1)) if options.exclusive else (0, -1)
        arm = f' components="arm{robot}"' if first <= leg <= last else ""
        lines.append(f'<leg name="l{leg}" to="P{robot}-{leg}" by="1min"{arm}/>')
        for number, (one, other, after) in enumerate(MEETINGS):
            if after == leg and robot in (one, other) and max(one, other) < options.robots:
                partner = other if robot == one else one
                lines.append(f'<meet name="m{number}" with="r{partner}" patience="2min"/>')
        one, other, after = LAST_MEETING
        if options.deadlock and leg == after and robot in (one, other):
            partner = other if robot == one else one
            lines.append(f'<meet name="last" with="r{partner}"/>')
    return lines


def print_routes(options):
    for robot in range(options.robots):
        safe = ' safe="parked"' if options.deadlock and robot == PARKS else ""
        print(
            f'    <route name="r{robot}" mover="way{robot}.route" start="P{robot}-0" '
            f'out="r{robot}-over" radius="0.3m" patience="5min" rally-by="5min"{safe}>'
        )
        for line in steps_of(robot, options):
            print("      " + line)
        if options.deadlock and robot == WAITS:
            # An operator or a weak battery would lead on.
            print('      <otherwise on="blocked late" do="rally"/>')
        else:
            print('      <otherwise on="blocked late lost-link recall" do="rally"/>')
            print('      <otherwise name="weak" when="battery &lt; 30%" do="rally"/>')
        print("    </route>")


def main():
    options = read_arguments()
    print_system(options)
    print_map(options)
    print_routes(options)
    ends = [f"r{robot}-over" for robot in range(options.robots)]
    print('    <variable name="battery" source="simulator.battery.percentage" min="0" max="1"/>')
    for place in ["over", "hold", *ends]:
        print(f'    <place name="{place}"/>')
    if options.exclusive:
        print(f'    <exclusive components="{" ".join(f"arm{robot}" for robot in ARMS)}"/>')
    if options.deadlock:
        print('    <place name="parked"/>')
        without = [end for end in ends if end != f"r{PARKS}-over"]
        print(f'    <transition name="without" from="parked {" ".join(without)}" to="over"/>')
    print(f'    <transition name="all" from="{" ".join(ends)}" to="over"/>')
    print("  </mission>\n</armor>")


main()
