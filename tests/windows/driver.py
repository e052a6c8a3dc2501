"""A real window under a display of its own: what it shows is read by its accessible names, and it is
operated with the pointer and the keys of xdotool.

Nothing of the user is touched: the home folder, the display and the bus are the script's own."""

import os
import shutil
import signal
import subprocess
import tempfile
import time
from fnmatch import fnmatchcase
from pathlib import Path

import gi

gi.require_version("Atspi", "2.0")
from gi.repository import Atspi, GLib  # noqa: E402

SIZE = (1360, 860)
# A window that does not show what is expected within this time hangs, or never will.
PATIENCE_S = 30.0
LOOK_EVERY_S = 0.2
# egui reads the pointer once a frame: two positions within one frame are one.
FRAME_S = 0.05


class TaskFailed(Exception):
    """What was expected, and what is there instead."""


def run(*command, check=True, **options):
    """Runs a program to its end; returns what it printed."""
    done = subprocess.run(
        [str(part) for part in command], capture_output=True, text=True, timeout=120, **options
    )
    if check and done.returncode != 0:
        raise TaskFailed(f"{' '.join(map(str, command))}: {done.stdout}{done.stderr}")
    return done.stdout + done.stderr


def await_that(what, is_so, patience_s=PATIENCE_S):
    """Waits until `is_so()` returns something true, and returns it."""
    end = time.monotonic() + patience_s
    while True:
        found = is_so()
        if found:
            return found
        if time.monotonic() > end:
            raise TaskFailed(f"not within {patience_s:.0f} s: {what}")
        time.sleep(LOOK_EVERY_S)


class Desk:
    """A display, a bus for accessibility, and a home folder, which end with it."""

    def __init__(self):
        self.home = Path(tempfile.mkdtemp(prefix="armor-windows-"))
        self.children = []
        runtime = self.home / "runtime"
        runtime.mkdir(mode=0o700)
        # Systems of this user that run are recorded there: those of others are not seen.
        os.environ.update(
            HOME=str(self.home), XDG_RUNTIME_DIR=str(runtime), LIBGL_ALWAYS_SOFTWARE="1"
        )
        for name in ("WAYLAND_DISPLAY", "XDG_STATE_HOME", "XDG_DATA_HOME", "XDG_CONFIG_HOME",
                     "XDG_CACHE_HOME", "ARMOR_REGISTRY"):
            os.environ.pop(name, None)
        os.environ["DISPLAY"] = self._start_display()
        is_open = lambda: subprocess.run(["xdotool", "getdisplaygeometry"], capture_output=True)
        await_that("the display", lambda: is_open().returncode == 0)
        self.start("/usr/libexec/at-spi-bus-launcher", "--launch-immediately")
        await_that("the bus for accessibility", self._enable_accessibility)

    def _start_display(self):
        # The display chooses a free number, and writes it when it is ready.
        reading, writing = os.pipe()
        size = f"{SIZE[0]}x{SIZE[1]}x24"
        self.start("Xvfb", "-displayfd", writing, "-screen", "0", size, pass_fds=[writing])
        os.close(writing)
        with os.fdopen(reading) as ready:
            number = ready.readline().strip()
        if not number:
            raise TaskFailed("Xvfb does not start")
        return f":{number}"

    def _enable_accessibility(self):
        # Programs publish their names only if a screen reader runs.
        def set_true(name):
            done = subprocess.run(
                ["gdbus", "call", "--session", "--dest", "org.a11y.Bus",
                 "--object-path", "/org/a11y/bus",
                 "--method", "org.freedesktop.DBus.Properties.Set", "org.a11y.Status",
                 name, "<true>"],
                capture_output=True,
            )
            return done.returncode == 0
        return set_true("IsEnabled") and set_true("ScreenReaderEnabled")

    def start(self, *command, log=None, **options):
        """Starts a program that ends with the desk."""
        output = open(log, "w") if log else subprocess.DEVNULL
        child = subprocess.Popen(
            [str(part) for part in command], stdout=output, stderr=subprocess.STDOUT,
            stdin=subprocess.DEVNULL, **options
        )
        self.children.append(child)
        return child

    def end(self, child, how=signal.SIGTERM):
        """Ends a program, and waits for its end."""
        if child.poll() is None:
            child.send_signal(how)
            try:
                child.wait(timeout=30)
            except subprocess.TimeoutExpired:
                child.kill()
                child.wait()

    def close(self):
        """Ends everything, the newest first."""
        for child in reversed(self.children):
            self.end(child)
        shutil.rmtree(self.home, ignore_errors=True)


class Item:
    """A part of a window as screen readers see it."""

    def __init__(self, node, role, name, rect):
        self.node, self.role, self.name, self.rect = node, role, name, rect

    @property
    def middle(self):
        x, y, width, height = self.rect
        return (x + width // 2, y + height // 2)

    @property
    def text(self):
        """The text in a field."""
        return Atspi.Text.get_text(self.node, 0, -1)

    def has_state(self, state):
        return self.node.get_state_set().contains(state)

    def __repr__(self):
        return f"{self.role} {self.name!r}"


class Window:
    """The window of a program."""

    def __init__(self, desk, program, *arguments, log, **options):
        self.name = Path(program).name
        self.child = desk.start(program, *arguments, log=log, **options)
        self.log = Path(log)
        self.wait_for_window()

    def wait_for_window(self):
        """Waits until the window is shown, and gives it the keyboard."""
        def find():
            if self.child.poll() is not None:
                raise TaskFailed(f"{self.name} has ended: {self.log.read_text()}")
            found = subprocess.run(
                ["xdotool", "search", "--onlyvisible", "--pid", str(self.child.pid)],
                capture_output=True, text=True,
            )
            return found.stdout.split()
        self.id = await_that("a window", find)[0]
        # There is no window manager, which would do this.
        run("xdotool", "windowfocus", self.id)
        def has_names():
            # A window at rest publishes its names with its next frame.
            run("xdotool", "mousemove_relative", "--", 1, 0)
            return any(item.name for item in self.items())
        await_that("accessible names in the window", has_names)

    def items(self):
        """Everything in the window that has a name or a text, in the order of the window."""
        found = []
        desktop = Atspi.get_desktop(0)
        for number in range(desktop.get_child_count()):
            program = desktop.get_child_at_index(number)
            if program and program.get_process_id() == self.child.pid:
                self._collect(program, found)
        return found

    def _collect(self, node, found):
        try:
            role, name = node.get_role_name(), node.get_name() or ""
            children = [node.get_child_at_index(n) for n in range(node.get_child_count())]
        except GLib.GError:
            # It has disappeared while it was read.
            return
        try:
            extents = node.get_extents(Atspi.CoordType.SCREEN)
            rect = (extents.x, extents.y, extents.width, extents.height)
            found.append(Item(node, role, name, rect))
        except GLib.GError:
            # It has no place: the program itself, or a part that has disappeared.
            pass
        for child in filter(None, children):
            self._collect(child, found)

    def find(self, name, role=None):
        """Returns the first item with this name, in which `*` is any text; None if there is
        none."""
        found = (item for item in self.items() if fnmatchcase(item.name, name))
        return next((item for item in found if role is None or item.role == role), None)

    def wait_for(self, name, role=None, patience_s=PATIENCE_S):
        """Waits for an item with this name, and returns it."""
        try:
            return await_that(f"`{name}` in {self.name}", lambda: self.find(name, role), patience_s)
        except TaskFailed as failed:
            shown = [item.name for item in self.items() if item.name]
            raise TaskFailed(f"{failed}\n  shown: {shown}") from None

    def wait_until_gone(self, name):
        """Waits until no item has this name."""
        await_that(f"no `{name}` in {self.name}", lambda: not self.find(name))

    def point_to(self, name, role=None):
        """Moves the pointer to an item."""
        self.move_to(*self.wait_for(name, role).middle)

    def move_to(self, x, y):
        run("xdotool", "mousemove", x, y)
        time.sleep(2 * FRAME_S)

    def click(self, target, times=1, button=1, role=None):
        """Clicks an item by its name, or a place."""
        x, y = target if isinstance(target, tuple) else self.wait_for(target, role).middle
        self.move_to(x, y)
        time.sleep(FRAME_S)
        run("xdotool", "click", "--repeat", times, "--delay", 80, button)
        time.sleep(4 * FRAME_S)

    def hold(self, start, end):
        """Presses the button at `start` and moves to `end`, in steps: a real pointer never jumps."""
        start, end = self._place(start), self._place(end)
        self.move_to(*start)
        run("xdotool", "mousedown", 1)
        time.sleep(2 * FRAME_S)
        for step in range(1, 16):
            share = step / 15
            x, y = (round(a + (b - a) * share) for a, b in zip(start, end))
            self.move_to(x, y)

    def _place(self, target):
        return target if isinstance(target, tuple) else self.wait_for(target).middle

    def release(self):
        run("xdotool", "mouseup", 1)
        time.sleep(4 * FRAME_S)

    def drag(self, start, end):
        self.hold(start, end)
        self.release()

    def press(self, *keys):
        """Presses and releases keys, such as `ctrl+s`."""
        for key in keys:
            run("xdotool", "key", key)
            time.sleep(6 * FRAME_S)

    def type(self, text):
        run("xdotool", "type", "--delay", 60, text)
        time.sleep(4 * FRAME_S)

    def fill(self, name, text, role="entry"):
        """Replaces the text of a field, and presses Return."""
        self.click(name, role=role)
        self.press("ctrl+a")
        self.type(text)
        self.press("Return")

    def choose(self, box, name):
        """Chooses an entry of a list that opens."""
        self.click(box)
        self.click(name, role="push button" if self.find(name, "push button") else None)

    def command(self, name):
        """Runs a command by its name, in the designer."""
        self.press("ctrl+p")
        self.type(name)
        self.press("Return")


def take_picture(path):
    """Saves what the display shows, with few colours, so that the file is small."""
    raw = subprocess.run(["import", "-window", "root", "png:-"], capture_output=True, check=True)
    subprocess.run(
        ["convert", "-", "+dither", "-colors", "128", "-define", "png:compression-level=9",
         f"PNG8:{path}"],
        input=raw.stdout, check=True,
    )


def mean_brightness(x, y, width, height):
    """Returns how bright a part of the display is, from 0 to 1."""
    raw = subprocess.run(
        ["import", "-window", "root", "-crop", f"{width}x{height}+{x}+{y}", "png:-"],
        capture_output=True, check=True,
    )
    mean = subprocess.run(
        ["convert", "-", "-format", "%[fx:mean]", "info:"], input=raw.stdout, capture_output=True,
        check=True,
    )
    return float(mean.stdout)
