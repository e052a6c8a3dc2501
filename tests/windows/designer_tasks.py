"""The tasks of the designer: a robot is built from nothing, saved, proven, run and watched."""

import os
import shutil
import signal
import time
from pathlib import Path

from driver import TaskFailed, Window, await_that, run
from tasks import Stage, TaskList

DESIGNER = TaskList("designer", Path(__file__).parents[2] / "docs" / "designer.md")
task = DESIGNER.task


class DesignerStage(Stage):
    """The designer's window and the file that is drawn in it."""

    def __init__(self, desk, root, programs):
        super().__init__(desk, root, programs)
        self.folder = desk.home / "robot"
        self.folder.mkdir()
        shutil.copy(root / "missions/worlds/rooms.svg", self.folder)
        os.chdir(self.folder)
        self.file = self.folder / "robot.xml"
        self.window = None

    def open_window(self, *arguments):
        program = self.programs / "armor-designer"
        log = self.desk.home / "designer.log"
        self.window = Window(self.desk, program, "--theme", "light", *arguments, log=log)

    def await_text(self, *texts):
        """Waits until the file contains these texts."""
        def missing():
            text = self.file.read_text() if self.file.exists() else ""
            return [part for part in texts if part not in text]
        try:
            await_that("", lambda: not missing(), patience_s=10)
        except TaskFailed:
            text = self.file.read_text() if self.file.exists() else "no file"
            raise TaskFailed(f"{missing()} is not in the file:\n{text}") from None

    def save(self, *texts):
        """Saves, and waits until the file contains these texts."""
        self.window.press("ctrl+s")
        self.await_text(*texts)


@task("Begin a new robot", "first-page")
def begin(stage):
    stage.open_window()
    stage.window.wait_for("Open the example Office")
    stage.window.wait_for("* component kinds")
    stage.shoot()
    stage.window.click("Start a new robot")
    stage.window.wait_for("drawing of the system")


@task("Place a component by dragging", "dragged")
def drag_a_component(stage):
    # Searched for, so that its place in the list does not depend on the other kinds.
    window = stage.window
    window.click("Search components")
    window.type("simulator")
    window.wait_until_gone("kind board")
    window.drag("kind simulator", (400, 240))
    window.wait_for("component simulator")
    window.click("Search components")
    window.press("ctrl+a", "Delete", "Escape")


@task("Place a component by name", "added-by-name")
def add_by_name(stage):
    window = stage.window
    window.move_to(760, 240)
    window.press("a")
    window.type("grid")
    window.wait_for("Add a component", "entry")
    stage.shoot()
    window.press("Return")
    window.wait_for("component grid-slam")


@task("See why a link is refused", "refused-link")
def refuse_a_link(stage):
    window = stage.window
    window.press("f")
    window.hold("output simulator.scan", "input grid-slam.odometry")
    # The text follows the pointer by some frames.
    time.sleep(1.0)
    stage.shoot()
    window.release()
    if window.find("link simulator.scan to grid-slam.odometry"):
        raise TaskFailed("a link between two types was made")


@task("Connect two ports", "connected")
def connect(stage):
    window = stage.window
    for data in ("scan", "odometry"):
        window.drag(f"output simulator.{data}", f"input grid-slam.{data}")
        window.wait_for(f"link simulator.{data} to grid-slam.{data}")


@task("See why saving is refused", "not-saved")
def refuse_to_save(stage):
    window = stage.window
    window.press("ctrl+s", "Return")
    window.wait_for("Not saved: simulator has no value for world*")
    if stage.file.exists():
        raise TaskFailed("it was saved without a value")


@task("Set a parameter", "parameter")
def set_a_parameter(stage):
    window = stage.window
    window.click("component simulator", times=2)
    window.wait_for("parameter world")
    # The field that needs a value has the keyboard.
    window.type("rooms.svg")
    window.press("Return")
    window.wait_until_gone("simulator has no value for world")


@task("Say where a sensor is", "frame")
def add_a_frame(stage):
    window = stage.window
    window.press("Escape")
    window.click((260, 660))
    window.click("Add a frame")
    window.wait_for("frame laser name")
    window.fill("frame laser x", "0.08m")
    window.press("Escape", "ctrl+s", "Return")
    stage.await_text('name="laser"', 'x="0.08m"', 'value="rooms.svg"')


@task("Rename a component", "renamed")
def rename(stage):
    window = stage.window
    window.click("component grid-slam")
    window.press("F2", "ctrl+a")
    window.type("mapper")
    window.press("Return")
    window.wait_for("link simulator.scan to mapper.scan")
    stage.save('<component name="mapper" kind="grid-slam"', 'to="mapper.scan"')


@task("Undo and redo", "undone")
def undo(stage):
    window = stage.window
    window.click((260, 660))
    window.press("ctrl+z")
    window.wait_for("component grid-slam")
    stage.shoot()
    window.press("ctrl+shift+z")
    window.wait_for("component mapper")


@task("Find something", "found")
def find(stage):
    window = stage.window
    window.press("ctrl+f")
    window.type("rooms")
    window.wait_for("*", "toggle button")
    stage.shoot()
    window.press("Return")
    window.wait_for("parameter world")


@task("Group blocks, and write a note", "group")
def group(stage):
    window = stage.window
    window.click((260, 660))
    window.press("ctrl+a", "ctrl+g")
    stage.save("<group ")
    window.click((260, 660))
    window.press("Escape", "n")
    stage.save("<note ")


@task("Draw places", "places")
def draw_places(stage):
    window = stage.window
    window.press("Escape", "ctrl+2")
    window.wait_for("drawing of the mission")
    places = [("look", (360, 200)), ("over", (840, 200)), ("hold", (840, 400))]
    for name, place in places:
        window.drag("new place", place)
        window.fill("name of the place", name)
        window.wait_for(f"place {name}")
    window.click("place look")
    window.click("mapper is active in look")
    window.click("place over")
    window.click("Goal: the mission ends successfully here")
    window.click("place hold")
    window.click("Safe: where the mission goes when something fails")
    window.click((360, 600))


@task("Connect places by a transition", "transition")
def draw_transitions(stage):
    window = stage.window
    for name, end in (("seen", "over"), ("enough", "hold")):
        window.press("f")
        window.drag("arc from place look", f"place {end}")
        window.fill("name of the transition", name)
        window.wait_for(f"transition {name}")
        if name == "seen":
            window.choose("when it fires", "after a time (timeout)")
            window.fill("timeout", "30s")
        else:
            window.choose("who decides", "the operator")
    window.click((360, 640))
    stage.save(
        '<transition name="seen" from="look" to="over" timeout="30s"/>',
        '<transition name="enough" from="look" to="hold" operator="true"/>',
    )


@task("Write a guard", "guard")
def write_a_guard(stage):
    window = stage.window
    window.drag("arc from place look", "place hold")
    window.fill("name of the transition", "weak")
    window.fill("guard", "simulator.battery.percentage < ")
    stage.shoot()
    window.fill("guard", "simulator.battery.percentage < 0.2")
    stage.save('when="simulator.battery.percentage &lt; 0.2"')


@task("Prove the mission", "mission")
def prove(stage):
    window = stage.window
    window.press("Escape")
    window.click((360, 640))
    window.wait_for("proven*")
    window.press("f")
    window.wait_for("Play the shortest run")
    run(stage.armor, "check", stage.file)


@task("Play a counterexample", "counterexample")
def play_a_counterexample(stage):
    window = stage.window
    window.click("Add a check…")
    window.click("always reachable(over or hold)", role="push button")
    window.fill("check 1", "never hold")
    window.wait_for("violated")
    window.click("Play its firing*")
    window.wait_for("Run being shown")
    window.press("F10")
    stage.shoot()
    window.press("Escape", "ctrl+z", "ctrl+z")
    window.wait_until_gone("check 1")


@task("Save a draft", "draft")
def save_a_draft(stage):
    window = stage.window
    before = stage.file.read_text()
    window.press("ctrl+1")
    window.wait_for("drawing of the system")
    window.move_to(400, 600)
    window.press("a")
    window.type("patrol")
    window.press("Return")
    window.wait_for("component patrol")
    window.command("save as draft")
    stage.await_text('kind="patrol"', "draft")
    stage.shoot()
    refused = run(stage.armor, "run", stage.file, "--headless", check=False)
    if "draft" not in refused:
        raise TaskFailed(f"a draft is run: {refused}")
    # The mark is a step of the history, too.
    window.press("ctrl+z", "ctrl+z")
    window.wait_until_gone("component patrol")
    window.press("ctrl+s")
    await_that("no draft any more", lambda: "draft" not in stage.file.read_text(), patience_s=10)
    if "patrol" in stage.file.read_text() or "<mission" not in before:
        raise TaskFailed("the draft was not undone")


@task("Run it", "run")
def run_it(stage):
    window = stage.window
    window.press("ctrl+r")
    window.wait_for("place look: marked")
    window.wait_for("component mapper: active")
    window.press("f")
    await_that("the run", lambda: "mapper" in run(stage.armor, "ps", check=False))
    stage.shoot()
    # The mission reaches its goal after half a minute, and the run ends by itself.
    ended = lambda: "mapper" not in run(stage.armor, "ps", check=False)
    await_that("the end of the run", ended, patience_s=90)
    window.wait_for("Open results")


@task("Watch a running system", "watched")
def watch(stage):
    stage.desk.end(stage.window.child)
    office = stage.root / "missions/office.xml"
    command = [stage.armor, "run", office, "--headless", "--quiet", "--out", stage.folder / "out"]
    system = stage.desk.start(*command)
    await_that("the run", lambda: "explorer" in run(stage.armor, "ps", check=False))
    stage.open_window("--attach")
    window = stage.window
    window.wait_for("component explorer*")
    window.click("component mapper*")
    window.click("output mapper.map of type OccupancyGrid")
    window.wait_for("preview of mapper.map*")
    stage.shoot()
    pid = run("pgrep", "-P", system.pid, "-f", "explorer").split()[0]
    os.kill(int(pid), signal.SIGKILL)
    window.wait_for("component explorer*1 restart*")
    stage.desk.end(system)
    stage.desk.end(window.child)


@task("Recover work after a crash", "recover")
def recover(stage):
    before = stage.file.read_bytes()
    stage.open_window(stage.file)
    window = stage.window
    window.wait_for("component mapper")
    window.move_to(400, 600)
    window.press("a")
    window.type("driver")
    window.press("Return")
    window.wait_for("component driver")
    backups = stage.desk.home / ".local/state/armor/designer/recovery"
    has_backup = lambda: any("driver" in path.read_text() for path in backups.glob("*.json"))
    await_that("a backup", has_backup)
    stage.desk.end(window.child, signal.SIGKILL)
    stage.open_window(stage.file)
    window = stage.window
    window.wait_for("Recover")
    stage.shoot()
    window.click("Recover")
    window.wait_for("component driver")
    if stage.file.read_bytes() != before:
        raise TaskFailed("the file was touched")


@task("Export the drawing", "exported")
def export(stage):
    drawing = stage.folder / "robot.svg"
    run(stage.programs / "armor-designer", "--export", drawing, stage.file)
    if "mapper" not in drawing.read_text():
        raise TaskFailed("the drawing does not name its blocks")
    stage.shoot()
    stage.desk.end(stage.window.child)


@task("Play a recording", "recording")
def play_a_recording(stage):
    recording = stage.folder / "rooms.mcap"
    recorder = stage.desk.start(stage.armor, "record", "--wait", "--output", recording)
    run(stage.armor, "run", stage.file, "--headless", "--quiet", "--out", stage.folder / "recorded")
    recorder.wait(timeout=90)
    stage.open_window(recording)
    window = stage.window
    window.wait_for("marks: Firings 1")
    if window.find("Discard"):
        # What the crash before has left.
        window.click("Discard")
    window.wait_for("place look: marked")
    window.click("component mapper*")
    # The list moves while values arrive, so that a click may meet another line.
    for _ in range(3):
        window.click("output mapper.map of type OccupancyGrid")
        time.sleep(1.0)
        if window.find("preview of mapper.map*"):
            break
    window.wait_for("preview of mapper.map*")
    window.click("live: Marks")
    window.press("f")
    # Near the end, so that there is a map.
    window.click("time line")
    window.press("Home", "Right", "Right", "Right", "Right", "Right", "Right", "space")
    window.wait_for("paused")
    stage.shoot()
    # The firing that ends the mission, at the moment at which it begins to fire.
    window.click("firing seen at *")
    window.wait_for("transition seen: fires")
    window.press("space")
    window.wait_for("place over: marked")
    window.press("Home")
    window.wait_for("place look: marked")
    played = stage.folder / "no-recording.mcap"
    played.write_text("this is no recording")
    window.press("ctrl+shift+o")
    window.type(str(played))
    window.press("Return")
    window.wait_for("*cannot be read as a recording*")
    stage.desk.end(window.child)


@task("Move a waypoint on the map", "map")
def move_a_waypoint(stage):
    stage.file = stage.folder / "drawn.xml"
    shutil.copy(stage.root / "missions/drawn.xml", stage.file)
    shutil.copytree(stage.root / "missions/worlds", stage.folder / "worlds", dirs_exist_ok=True)
    stage.before = stage.file.read_text()
    stage.open_window("--view", "map", stage.file)
    window = stage.window
    window.wait_for("point studio")
    stage.shoot()
    window.drag("point studio", "rally point R2")
    window.press("ctrl+z")
    # By one step of the keyboard, to have a number that does not depend on the window's size.
    window.click("point studio")
    window.press("shift+Right")
    window.fill("position", "2.5 -3.5")
    stage.save('<point name="studio" at="2.5 -3.5"/>')
    changed = [
        new for old, new in zip(stage.before.splitlines(), stage.file.read_text().splitlines())
        if old != new
    ]
    if len(changed) != 1:
        raise TaskFailed(f"more than one line has changed: {changed}")


@task("Add legs by clicks on the map", "legs")
def add_legs(stage):
    window = stage.window
    window.press("Escape")
    window.click("map tool: Leg")
    window.click("point corridor-end")
    stage.save('<leg name="l6" to="corridor-end"/>')
    window.press("Escape", "Escape")
    window.click("leg l6 of route red")
    window.drag("middle of leg l6 of route red", "rally point R2")
    stage.shoot()
    window.wait_for("leg l7 of route red")
    stage.save('<leg name="l7" to="R2"/>\n      <leg name="l6" to="corridor-end"/>')
    window.press("ctrl+z", "ctrl+z")
    window.wait_until_gone("leg l6 of route red")


@task("Draw a zone, and see which leg enters it", "zone")
def draw_a_zone(stage):
    window = stage.window
    window.click("map tool: Zone: no-go")
    corner = window.wait_for("point door").middle
    for x, y in [(-40, 30), (40, 30), (40, 60), (-40, 60)]:
        window.click((corner[0] + x, corner[1] + y))
    window.press("Return")
    window.wait_for("zone zone1")
    window.click("leg l3 of route red")
    window.wait_for("*enters zone1*")
    stage.shoot()
    window.press("ctrl+z", "ctrl+s")
    stage.desk.end(window.child)
