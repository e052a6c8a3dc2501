"""A plan of two robots, drawn, proven, rehearsed and run in a real window. Started by plan.sh."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests" / "windows"))
from driver import Desk, TaskFailed, Window, await_that, run, take_picture  # noqa: E402

# What the whole plan may take.
MOST_GESTURES = 60
# Two robots are simulated by ten processes, in real time if the host is slow.
PATIENCE_S = 600.0


class CountingWindow(Window):
    """A window that counts what a person does in it."""

    gestures = 0

    def click(self, target, times=1, button=1, role=None):
        self.gestures += 1
        super().click(target, times, button, role)

    def drag(self, start, end):
        self.gestures += 1
        super().drag(start, end)

    def press(self, *keys):
        self.gestures += len(keys)
        super().press(*keys)

    def type(self, text):
        self.gestures += 1
        super().type(text)


class Plan:
    """The window, the file that is drawn in it, and the pictures."""

    def __init__(self, desk, pictures):
        programs = os.environ.get("ARMOR_PROGRAMS")
        target = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target"))
        programs = Path(programs) if programs else target / "debug"
        self.armor = programs.resolve() / "armor"
        os.environ["ARMOR"] = str(self.armor)
        self.pictures, self.number = pictures, 0
        folder = desk.home / "robot"
        folder.mkdir()
        shutil.copy(ROOT / "missions/worlds/office.svg", folder)
        os.chdir(folder)
        self.file = folder / "robot.xml"
        self.window = CountingWindow(
            desk, programs.resolve() / "armor-designer", "--theme", "light",
            log=desk.home / "designer.log",
        )

    def shoot(self, name):
        """Takes a picture of a stage, and prints how many gestures it took until there."""
        self.number += 1
        print(f"{self.window.gestures:3} gestures: {name}", flush=True)
        if self.pictures:
            take_picture(self.pictures / f"{self.number}-{name.replace(' ', '-')}.png")

    def text(self):
        return self.file.read_text() if self.file.exists() else ""

    def await_text(self, *parts):
        """Waits until the file contains these texts."""
        missing = lambda: [part for part in parts if part not in self.text()]
        try:
            await_that("", lambda: not missing())
        except TaskFailed:
            raise TaskFailed(f"{missing()} is not in the file:\n{self.text()}") from None

    def place(self, x_m, y_m):
        """Where a position of the map is, by the points at 0 0 and 4 0."""
        origin, other = (self.window.wait_for(f"point {name}").middle for name in ("P1", "P2"))
        metre = (other[0] - origin[0]) / 4.0
        return (round(origin[0] + x_m * metre), round(origin[1] - y_m * metre))


def add_robots(plan):
    window = plan.window
    window.wait_for("* component kinds")
    window.click("Start a new robot")
    window.click("kind simulated robot", times=2)
    window.wait_for("component simulator")
    # The simulator is selected: its first field without a value takes the keys.
    window.press("Return")
    window.type("office.svg")
    window.press("Return")
    window.click("kind simulated robot", times=2)
    window.wait_for("component driver-2")
    plan.shoot("two robots")


def draw_routes(plan):
    window = plan.window
    window.press("ctrl+3")
    window.click("map tool: Leg")
    middle = window.wait_for("drawing of the map").middle
    # An empty map has 20 points for a metre, and its origin in the middle.
    window.click(middle)
    window.click((middle[0] + 80, middle[1]))
    window.wait_for("leg l1 of route route")
    window.click(plan.place(1.0, 0.0))
    window.wait_for("leg l2 of route route")
    window.click("begin a new route")
    window.click("point P1")
    window.click(plan.place(2.0, -2.0))
    window.wait_for("leg l1 of route route-1")
    window.click("point P2")
    window.wait_for("leg l2 of route route-1")
    window.click("point P4")
    window.wait_for("leg l3 of route route-1")
    plan.shoot("two routes")


def let_them_meet(plan):
    window = plan.window
    window.click("map tool: Meeting")
    # Both routes lead to it.
    window.click("point P2")
    window.wait_for("meeting m1 of route route-1")
    window.click("map tool: Stay")
    window.click("point P4")
    window.wait_for("stay s1 of route route-1")
    # The mission ends with the first route that does: both end together.
    window.click("map tool: Meeting")
    window.click("leg l2 of route route")
    window.click("stay s1 of route route-1")
    window.wait_for("meeting m2 of route route-1")
    # Slow, so that there is time to drag a point that is coming.
    window.press("Escape")
    window.click("leg l1 of route route")
    window.fill("speed", "0.06m/s")
    window.click("map tool: Rally point")
    window.click(plan.place(-1.0, 0.0))
    window.wait_for("rally point R1")
    window.click("map tool: Zone: no-go")
    for x_m, y_m in [(-5.4, -1.2), (-1.6, -1.2), (-1.6, -5.0), (-5.4, -5.0)]:
        window.click(plan.place(x_m, y_m))
    window.press("Return")
    window.wait_for("zone zone1")
    window.press("f")
    plan.shoot("meeting, zone and rally point")


def prove(plan):
    window = plan.window
    window.press("ctrl+s", "Return")
    plan.await_text('<meet name="m1" with="route-1"', '<meet name="m1" with="route"', "no-go")
    printed = run(plan.armor, "check", plan.file, check=False)
    print(printed)
    done = subprocess.run([str(plan.armor), "check", str(plan.file)], capture_output=True)
    if done.returncode != 0:
        raise TaskFailed(f"the plan is not proven: {printed}\n{plan.text()}")
    plan.shoot("proven and saved")


def rehearse(plan):
    window = plan.window
    window.press("y")
    window.wait_for("at its goal after*", patience_s=PATIENCE_S)
    plan.shoot("rehearsed")
    window.press("t")


def run_and_drag(plan):
    window = plan.window
    window.press("ctrl+r")
    # The robots drive; the point of the last leg of the first route is coming.
    window.wait_for("robot route,*", patience_s=PATIENCE_S)
    before = plan.text()
    window.drag("point P3", plan.place(0.5, 0.5))
    window.press("ctrl+s")
    plan.shoot("running")
    await_that("the new position in the file", lambda: plan.text() != before)
    changed = [
        new for old, new in zip(before.splitlines(), plan.text().splitlines()) if old != new
    ]
    print(f"changed: {changed}")
    if len(changed) != 1 or "P3" not in changed[0]:
        raise TaskFailed(f"not one line has changed: {changed}")
    window.wait_for("version 2 of the file", patience_s=PATIENCE_S)
    plan.shoot("dragged while it runs")
    window.wait_for("goal*", patience_s=PATIENCE_S)
    plan.shoot("at the goal")


def main():
    pictures = Path(sys.argv[1]).resolve() if len(sys.argv) > 1 else None
    if pictures:
        pictures.mkdir(parents=True, exist_ok=True)
    desk = Desk()
    try:
        plan = Plan(desk, pictures)
        try:
            for stage in (add_robots, draw_routes, let_them_meet, prove, rehearse, run_and_drag):
                stage(plan)
        except TaskFailed:
            plan.shoot("failed")
            raise
        print(f"{plan.window.gestures} gestures, at most {MOST_GESTURES} may be needed")
        return 0 if plan.window.gestures <= MOST_GESTURES else 1
    except TaskFailed as failed:
        print(f"failed: {failed}", file=sys.stderr)
        return 1
    finally:
        desk.close()


if __name__ == "__main__":
    sys.exit(main())
