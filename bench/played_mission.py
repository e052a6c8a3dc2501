#!/usr/bin/env python3
"""Plays a recorded office mission at several speeds, and compares what comes out.

    armor record --wait -o office.mcap & armor run missions/office.xml --headless
    python3 bench/played_mission.py office.mcap [--armor target/release/armor] [--speeds 1 10 max]

The mapper, the writer and the mission run; the others are played. Besides the speeds, one run is paused
and stepped through by `armor playback`. The map, the trajectory and the journal of all runs must be the same
to the byte. A journal has the mission time of each decision, which is that of the recording.
"""

import argparse
import hashlib
import pathlib
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parent.parent
PLAYED = ["simulator", "explorer", "homing", "driver", "planner"]
STEPPED = "stepped"


def play(options, speed, out):
    is_stepped = speed == STEPPED
    command = [options.armor, "play", options.recording, ROOT / "missions/office.xml", "--headless",
               "--out", out, "--speed", "max" if is_stepped else speed, "--system", f"played-{speed}"]
    for name in PLAYED:
        command += ["--replace", name]
    if is_stepped:
        command.append("--paused")
    begun = time.monotonic()
    run = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    if is_stepped:
        step_through(options, run)
    run.wait()
    return run.returncode, time.monotonic() - begun


def step_through(options, run):
    """Steps of one message and of some time, a pause while it runs, another speed, and on."""
    def order(*words):
        command = [options.armor, "playback", *words, "--system", f"played-{STEPPED}"]
        while run.poll() is None:
            if subprocess.run(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL).returncode == 0:
                return
            time.sleep(0.2)

    for _ in range(20):
        order("step")
    for _ in range(10):
        order("step", "0.5s")
    for speed in ("5", "20", "max"):
        order("speed", speed)
        order("resume")
        time.sleep(1)
        order("pause")
        time.sleep(0.5)
        order("step", "1s")
    order("resume")


def digest(options, out):
    files = sorted(it for it in pathlib.Path(out).rglob("*") if it.suffix in (".pgm", ".png", ".csv", ".yaml"))
    journal = subprocess.run([options.armor, "mission", "journal", out], capture_output=True, check=True).stdout
    found = {it.name: hashlib.sha256(it.read_bytes()).hexdigest()[:12] for it in files}
    found["journal"] = hashlib.sha256(journal).hexdigest()[:12]
    return found


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("recording")
    parser.add_argument("--armor", default=str(ROOT / "target/release/armor"))
    parser.add_argument("--speeds", nargs="+", default=["1", "10", "max", STEPPED])
    options = parser.parse_args()
    results = {}
    with tempfile.TemporaryDirectory() as folder:
        for speed in options.speeds:
            out = f"{folder}/{speed}"
            code, took_s = play(options, speed, out)
            results[speed] = digest(options, out)
            print(f"{speed:8} exit code {code}, {took_s:.0f} s, {results[speed]}", flush=True)
    same = all(it == results[options.speeds[0]] for it in results.values())
    print("all are the same" if same else "they differ")
    sys.exit(not same)


main()
