#!/usr/bin/env bash
# Draws a mission of two robots in a real window, from an empty file: two robots, their routes on the map,
# a meeting, a stay, a zone, a rally point; it is proven, rehearsed and run, and a waypoint is dragged while
# it runs. Counts the gestures: a click, a drag, a key, a text.
#
#   designer/tests/plan.sh [FOLDER]     pictures of the stages go to FOLDER, if it is given
#
# Needs what tests/windows/README.md lists, and both programs built: ARMOR_PROGRAMS names their folder, else
# they are taken from target/debug. Nothing of the user's own is touched.
set -euo pipefail
here="$(cd "$(dirname "$0")" && pwd)"
exec dbus-run-session -- /usr/bin/python3 "$here/plan.py" "$@"
