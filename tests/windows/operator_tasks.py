"""The tasks of the operator's screen: a window that stays while runs of one file begin and end."""

import json
import os
import signal
import time
from pathlib import Path

from driver import TaskFailed, Window, await_that, mean_brightness, run
from tasks import Stage, TaskList

OPERATOR = TaskList("operator", Path(__file__).parents[2] / "docs" / "screen.md")
task = OPERATOR.task


class OperatorStage(Stage):
    """The window of `--watch`, and the run that it shows."""

    def __init__(self, desk, root, programs):
        super().__init__(desk, root, programs)
        mission = (root / "missions/operator.xml").read_text()
        # The mission asks before it drives home.
        mission = mission.replace(
            '<transition name="go-home" from="by-hand" to="return" on="view.home"/>',
            '<transition name="go-home" from="by-hand" to="return" on="view.home"\n'
            '                autonomy="confirm"/>',
        ).replace("worlds/office.svg", str(root / "missions/worlds/office.svg"))
        if 'autonomy="confirm"' not in mission:
            raise TaskFailed("operator.xml has no transition `go-home` any more")
        self.folder = desk.home / "robot"
        self.folder.mkdir()
        self.file = self.folder / "operator.xml"
        self.file.write_text(mission)
        os.chdir(self.folder)
        self.system = None
        program = programs / "armor-operator-view"
        log = desk.home / "operator.log"
        self.window = Window(desk, program, "--watch", self.file, log=log)

    def start_system(self, *arguments):
        out = self.folder / "out"
        command = [self.armor, "run", self.file, "--quiet", "--out", out, *arguments]
        self.system = self.desk.start(*command, log=self.desk.home / "run.log")

    def map_middle(self):
        """Returns the middle of the map, which is left of the panels and below the strip."""
        return (536, 480)

    def read(self, data):
        """Returns the newest message of an output."""
        line = run(self.armor, "echo", data, "--count", 1, "--format", "json")
        return json.loads(line.splitlines()[0])["value"]

    def place(self):
        """Returns where the robot is according to the simulator."""
        position = self.read("simulator.truth")["pose"]["pose"]["position"]
        return (position["x"], position["y"])

    def await_marked(self, place):
        """Waits until the mission is in a place."""
        shown = lambda: run(self.armor, "mission", "show", check=False)
        marked = lambda: f"marked      {place}" in shown()
        await_that(f"the mission in {place}", marked)

    def kill(self, component):
        """Kills the process of a component."""
        for line in run(self.armor, "ps", "--format", "json").splitlines():
            process = json.loads(line)
            if process.get("name") == component and "pid" in process:
                os.kill(process["pid"], signal.SIGKILL)
                return
        raise TaskFailed(f"{component} does not run")


@task("Open the window before the system", "waiting")
def wait_for_a_system(stage):
    stage.window.wait_for("waiting for a system")
    stage.window.wait_for("no system yet*")


@task("See what the map waits for", "no-map")
def wait_for_a_map(stage):
    stage.start_system("--without", "mapper")
    stage.window.wait_for("no map yet: waiting for mapper.map")


@task("See that a run has ended, and why", "ended")
def see_the_end(stage):
    stage.desk.end(stage.system, signal.SIGINT)
    stage.window.wait_for("operated-robot has ended:")
    stage.window.wait_for("old: the readings of the run that has ended")


@task("See the next run", "map")
def see_the_next_run(stage):
    stage.start_system()
    stage.window.wait_for("connected")
    stage.window.wait_until_gone("no map yet: waiting for mapper.map")
    stage.window.wait_for("explore")
    # Until there is something on the map to be clicked.
    start = stage.place()
    far = lambda: sum(abs(a - b) for a, b in zip(start, stage.place())) > 1.5
    await_that("1.5 m of exploring", far)


@task("STOP", "stopped")
def stop(stage):
    stage.window.press("space")
    stage.window.wait_for("STOPPED")
    stage.window.wait_for("the robot stands")
    stage.await_marked("by-hand")


@task("See why a goal is refused", "refused-goal")
def refuse_a_goal(stage):
    stage.window.click(stage.map_middle())
    stage.window.wait_for("no goal here: STOP is active*")


@task("Release", "released")
def release(stage):
    stage.window.click("Release")
    stage.window.wait_until_gone("STOPPED")


@task("Send it to a goal with a heading", "goal")
def send_to_a_goal(stage):
    window = stage.window
    window.click("follow")
    time.sleep(0.5)
    x, y = stage.map_middle()
    # Behind the robot all is known: it came from there.
    for dx, dy in [(-30, 0), (30, 0), (0, 30), (0, -30), (-20, 20), (20, -20), (20, 20)]:
        window.hold((x + dx, y + dy), (x + dx + 30, y + dy - 30))
        stage.shoot()
        window.release()
        time.sleep(0.5)
        if not window.find("no goal here*"):
            break
    goal = stage.read("view.goal")
    turn = goal["pose"]["orientation"]["z"]
    if abs(turn - 0.38) > 0.12:
        raise TaskFailed(f"the stroke led to the right and up: 45 degrees, not {goal}")


@task("Drive by hand", "by-hand")
def drive(stage):
    window = stage.window
    window.press("Escape")
    window.move_to(*stage.map_middle())
    before = stage.read("simulator.truth")["pose"]["pose"]["orientation"]["z"]
    # Turning is possible everywhere.
    run("xdotool", "keydown", "a")
    time.sleep(1.0)
    stage.shoot()
    run("xdotool", "keyup", "a")
    after = stage.read("simulator.truth")["pose"]["pose"]["orientation"]["z"]
    if abs(after - before) < 0.1:
        raise TaskFailed(f"the robot has not turned: {before} {after}")
    stage.await_marked("by-hand")


@task("Enlarge the camera image", "camera")
def enlarge_the_camera(stage):
    window = stage.window
    small = window.wait_for("image").rect
    window.click("image")
    grown = lambda: (window.find("image") or window.items()[0]).rect[2] > 1.5 * small[2]
    await_that("a larger image", grown)
    stage.shoot()
    window.press("Escape")
    await_that("the small image", lambda: window.find("image").rect[2] == small[2])


@task("Use the light theme in sunlight", "light")
def use_the_light_theme(stage):
    window = stage.window
    dark = mean_brightness(1100, 300, 180, 200)
    window.click("light")
    window.wait_for("dark")
    light = mean_brightness(1100, 300, 180, 200)
    if light < dark + 0.3:
        raise TaskFailed(f"brightness {dark:.2f} before, {light:.2f} after")
    stage.shoot()
    window.click("dark")


@task("Look at the links", "links")
def look_at_the_links(stage):
    window = stage.window
    window.click("*links*" if window.find("*links*") else "links")
    window.wait_for("via")
    stage.shoot()
    window.press("Escape")


@task("See a component die, and acknowledge the alert", "alert")
def acknowledge_an_alert(stage):
    window = stage.window
    stage.kill("mapper")
    window.wait_for("1 alert*")
    window.click("1 alert*")
    window.wait_for("Acknowledge all")
    stage.shoot()
    window.click("Acknowledge all")
    window.wait_for("alerts")
    window.press("Escape")


@task("See a mission that is paused, and resume it", "paused")
def see_a_pause(stage):
    run(stage.armor, "mission", "pause", "--as", "ruth")
    stage.window.wait_for("PAUSED")
    stage.window.wait_for("by ruth*")
    stage.shoot()
    # A new button takes no click for half a second.
    time.sleep(0.7)
    stage.window.click("Resume")
    stage.window.wait_until_gone("PAUSED")


@task("Acknowledge a map with a new origin", "new-origin")
def acknowledge_a_new_origin(stage):
    for state in (stage.folder / "out/states").glob("*.state"):
        state.write_bytes(b"damaged")
    stage.kill("mapper")
    stage.window.wait_for("The map has a new origin*")
    stage.shoot()
    stage.window.click("Acknowledge")
    stage.window.wait_until_gone("The map has a new origin*")


@task("Answer a question", "question")
def answer(stage):
    window = stage.window
    window.click("home")
    window.wait_for("go-home[?]*")
    stage.shoot()
    # A new button takes no click for half a second.
    time.sleep(0.7)
    window.click("Confirm")
    # Home may be near: the mission may have ended before it is asked.
    journal = stage.folder / "out/executive.journal"
    decisions = lambda: run(stage.armor, "mission", "journal", "--journal", journal, check=False)
    await_that("the way home", lambda: "go-home: by-hand -> return" in decisions())
    stage.desk.end(stage.system, signal.SIGINT)
