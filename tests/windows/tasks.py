"""A list of tasks: each has a title, which the documents list too, and a function that does it and
checks its effect."""

import sys
import time
import traceback
from driver import TaskFailed, take_picture


class TaskList:
    """The tasks of one window, in the order in which they are done: each begins where the one
    before it has ended."""

    def __init__(self, window, document):
        self.window, self.document, self.tasks = window, document, []

    def task(self, title, picture):
        """Adds a function as a task. `picture` names the picture that is taken at its end, or
        earlier by `shot`."""
        def add(function):
            self.tasks.append((title, picture, function))
            return function
        return add

    def find_undocumented(self):
        """Returns the titles that the document does not list."""
        text = self.document.read_text()
        return [title for title, _, _ in self.tasks if f"| {title} |" not in text]

    def do_all(self, stage, pictures):
        """Does all tasks, until one fails; returns whether none has."""
        for number, (title, picture, function) in enumerate(self.tasks, 1):
            begun = time.monotonic()
            stage.picture = pictures and pictures / f"{number:02}-{picture}.png"
            try:
                function(stage)
                stage.shoot()
            except Exception as error:
                # A failure of xdotool or of a file fails the task just as a missing effect does.
                if not isinstance(error, TaskFailed):
                    traceback.print_exc()
                print(f"FAILED  {self.window} {number}, {title}: {error}", file=sys.stderr)
                if pictures:
                    take_picture(pictures / f"{number:02}-{picture}-failed.png")
                return False
            seconds = time.monotonic() - begun
            print(f"done    {self.window} {number}, {title} ({seconds:.0f} s)", flush=True)
        return True


class Stage:
    """What the tasks of a window share."""

    def __init__(self, desk, root, programs):
        self.desk, self.root, self.programs = desk, root, programs
        self.armor = programs / "armor"
        self.picture = None

    def shoot(self):
        """Takes the task's picture, if it has none yet."""
        if self.picture:
            take_picture(self.picture)
            self.picture = None
