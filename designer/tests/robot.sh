#!/usr/bin/env bash
# Builds a robot from nothing in a real window, by mouse and keyboard: palette, drag, a parameter,
# links, a refused link, a mission; saves it, lets `armor` check and run it; then kills the window
# in the middle of work and brings the work back. Nothing of the user's own is touched.
#
#   designer/tests/robot.sh [FOLDER]     pictures of the steps go to FOLDER, if it is given
#
# Needs xvfb, xdotool, imagemagick and Mesa (libgl1-mesa-dri, libegl1), and both programs built:
# ARMOR and ARMOR_DESIGNER name them, else they are taken from target/debug.
set -euo pipefail
root="$(cd "$(dirname "$0")/../.." && pwd)"
target="${CARGO_TARGET_DIR:-$root/target}/debug"
export ARMOR="${ARMOR:-$target/armor}"
designer="${ARMOR_DESIGNER:-$target/armor-designer}"
pictures="${1:+$(mkdir -p "$1" && cd "$1" && pwd)}"

work="$(mktemp -d)"
export HOME="$work/home" DISPLAY="${ROBOT_DISPLAY:-:94}" LIBGL_ALWAYS_SOFTWARE=1
unset WAYLAND_DISPLAY XDG_STATE_HOME XDG_DATA_HOME XDG_CONFIG_HOME XDG_CACHE_HOME
mkdir -p "$HOME/robot"
cp "$root/missions/worlds/rooms.svg" "$HOME/robot/"
cd "$HOME/robot"

display='' window=''
finish() {
  [ -z "$window" ] || kill "$window" 2>/dev/null || true
  [ -z "$display" ] || kill "$display" 2>/dev/null || true
  wait 2>/dev/null || true
  rm -rf "$work"
}
trap finish EXIT
fail() { printf 'failed: %s\n' "$1" >&2; exit 1; }
step() { printf '%s\n' "$1"; }

Xvfb "$DISPLAY" -screen 0 1360x860x24 >"$work/xvfb.log" 2>&1 & display=$!

# Opens the window with these arguments and waits until it is shown.
open_window() {
  "$designer" --theme light "$@" >"$work/designer.log" 2>&1 & window=$!
  local id
  id="$(timeout 60 xdotool search --sync --onlyvisible --pid "$window" | head -1)" || fail "there is no window: $(cat "$work/designer.log")"
  sleep 2
  xdotool windowfocus "$id"
}
# A real pointer does not jump: it moves in steps.
hold() {
  xdotool mousemove "$1" "$2" sleep 0.2 mousedown 1 sleep 0.1
  for n in $(seq 1 15); do
    xdotool mousemove $(($1 + ($3 - $1) * n / 15)) $(($2 + ($4 - $2) * n / 15)) sleep 0.05
  done
  sleep 0.3
}
drag() { hold "$@"; xdotool mouseup 1; sleep 0.6; }
click() { xdotool mousemove "$1" "$2" sleep 0.2 click 1; sleep 0.6; }
keys() { for key in "$@"; do xdotool key "$key" sleep 0.4; done; }
fill() { click "$1" "$2"; keys ctrl+a; xdotool type --delay 60 "$3"; sleep 0.3; keys Return; }
picture() {
  [ -n "$pictures" ] || return 0
  import -window root png:- |
    convert - +dither -colors 64 -define png:compression-level=9 "PNG8:$pictures/$1.png"
}
# Whether robot.xml contains this text.
saved() { grep -qF "$1" robot.xml 2>/dev/null; }

step "the first page"
timeout 30 bash -c "until xdotool getdisplaygeometry >/dev/null 2>&1; do sleep 0.2; done" || fail "no display"
open_window
picture 1-first-page
click 315 296
sleep 1.5
xdotool mousemove 640 365
keys ctrl+0

step "components: one dragged from the palette, one by its name"
# Searched for, so that its place in the list does not depend on the other kinds.
click 110 61
xdotool type --delay 60 simulator
sleep 0.6
drag 45 113 480 305
click 110 61
keys ctrl+a Delete Escape
xdotool mousemove 760 300
keys a
xdotool type --delay 60 "grid"
sleep 0.4
picture 2-added-by-name
keys Return

step "a link that is refused, and two that are not"
hold 744 265 769 445
picture 3-refused-link
xdotool mouseup 1
sleep 0.6
drag 744 265 769 425
drag 744 285 769 445

step "saving is refused while a parameter needs a value"
keys ctrl+s Return
sleep 1.5
picture 4-not-saved
[ ! -e robot.xml ] || fail "it was saved without a value"
xdotool mousemove 640 245 sleep 0.2 click --repeat 2 --delay 80 1
sleep 0.6
# The field that needs a value has the keyboard.
xdotool type --delay 60 rooms.svg
keys Return

step "the frame of the laser"
click 320 640
click 1150 197
keys ctrl+s Return
sleep 2
saved 'value="rooms.svg"' || fail "the robot is not saved"
saved '<link from="simulator.odometry" to="grid-slam.odometry"/>' || fail "a link is missing"
! saved 'from="simulator.scan" to="grid-slam.odometry"' || fail "a link of two types was made"
picture 5-saved

step "the mission: three places, two transitions"
keys ctrl+2
xdotool mousemove 640 365
keys ctrl+0
drag 45 66 360 300
fill 1207 64 look
click 1091 267
drag 45 66 860 300
fill 1207 64 over
click 1091 114
drag 45 66 860 480
fill 1207 64 hold
click 1091 142
drag 416 317 860 308
fill 1207 64 seen
click 1265 244
click 1231 297
picture 6-transition
drag 416 317 860 488
fill 1207 64 enough
click 1265 347
click 1219 427
click 640 620
keys ctrl+s
sleep 2
picture 7-mission
saved '<transition name="seen" from="look" to="over" timeout="10s"/>' || fail "no transition: $(cat robot.xml)"
saved '<transition name="enough" from="look" to="hold" operator="true"/>' || fail "no operator's transition"

step "nothing happens: CPU ticks of the window in 10 s"
ticks() { awk '{print $14 + $15}' "/proc/$window/stat"; }
before="$(ticks)"
sleep 10
step "  $(($(ticks) - before)) of $((10 * $(getconf CLK_TCK)))"

step "the window is killed in the middle of work"
cp robot.xml "$work/saved.xml"
keys ctrl+1 a
xdotool type --delay 60 "driver"
sleep 0.3
keys Return
sleep 5
kill -9 "$window"
wait "$window" 2>/dev/null || true
cmp robot.xml "$work/saved.xml" || fail "the file was touched"
grep -ql 'kind=\\"driver\\"' "$HOME"/.local/state/armor/designer/recovery/*.json || fail "the work is lost"
open_window robot.xml
picture 8-recover
click 878 451
picture 9-recovered
cmp robot.xml "$work/saved.xml" || fail "the file was touched"
kill "$window"
wait "$window" 2>/dev/null || true
window=''

step "armor checks it and runs it"
"$ARMOR" check robot.xml || fail "armor check refuses it"
timeout 120 "$ARMOR" run robot.xml --headless --out "$work/out" >"$work/run.log" 2>&1 || fail "it does not run: $(tail -3 "$work/run.log")"
step "done"
