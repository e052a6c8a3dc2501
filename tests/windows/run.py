#!/usr/bin/python3
"""Does the tasks of docs/designer.md and docs/screen.md in the real windows, under a display of
their own, and takes a picture of each.

  tests/windows/run.py [FOLDER] [--only designer|operator]

FOLDER receives the pictures. The programs are those of target/debug, or of the folder ARMOR_PROGRAMS.
Needs xvfb, xdotool, imagemagick, Mesa (libgl1-mesa-dri, libegl1), at-spi2-core, python3-gi and
gir1.2-atspi-2.0. Exits with 1 if a task fails."""

import argparse
import os
import sys
from pathlib import Path

# Before the accessibility is loaded, which connects to the bus of this process.
if os.environ.get("ARMOR_OWN_BUS") != "1":
    os.environ["ARMOR_OWN_BUS"] = "1"
    os.execvp("dbus-run-session", ["dbus-run-session", "--", sys.executable, *sys.argv])

from designer_tasks import DESIGNER, DesignerStage  # noqa: E402
from driver import Desk  # noqa: E402
from operator_tasks import OPERATOR, OperatorStage  # noqa: E402

LISTS = [(DESIGNER, DesignerStage), (OPERATOR, OperatorStage)]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", nargs="?", type=Path, help="for the pictures")
    parser.add_argument("--only", choices=["designer", "operator"])
    options = parser.parse_args()
    root = Path(__file__).resolve().parents[2]
    default = Path(os.environ.get("CARGO_TARGET_DIR", root / "target")) / "debug"
    programs = Path(os.environ.get("ARMOR_PROGRAMS", default)).resolve()
    os.environ["ARMOR"] = str(programs / "armor")
    folder = options.folder and options.folder.resolve()
    is_good = True
    for tasks, stage in LISTS:
        if options.only not in (None, tasks.window):
            continue
        for title in tasks.find_undocumented():
            print(f"not in {tasks.document.name}: {title}", file=sys.stderr)
            is_good = False
        pictures = folder and folder / tasks.window
        if pictures:
            pictures.mkdir(parents=True, exist_ok=True)
        desk = Desk()
        try:
            is_good &= tasks.do_all(stage(desk, root, programs), pictures)
        finally:
            desk.close()
    return 0 if is_good else 1


if __name__ == "__main__":
    sys.exit(main())
