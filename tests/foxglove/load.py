#!/usr/bin/env python3
"""Measures the component `foxglove` with missions/foxglove.xml: a JPEG of 640 x 480 at 30 Hz and all
other outputs, with no viewer, with one that reads, and with one that is stopped (SIGSTOP).

Prints the rates of the robot in each case, and the memory, the processor time and the dropped
messages of the component; and how long the robot moves on when a viewer that drives is stopped.
"""

import argparse
import json
import os
import pathlib
import signal
import subprocess
import sys
import tempfile
import threading
import time

from PIL import Image

from run import ROOT, Robot, drive_for, resident_mb, speed_seen, watch_rest
from viewer import Viewer

WATCHED = ["camera.image", "simulator.scan", "simulator.odometry", "mapper.pose", "driver.velocity"]


def make_pictures():
    """A folder with pictures of 640 x 480 as JPEG, with noise, so that they are long."""
    folder = pathlib.Path(tempfile.mkdtemp(prefix="armor-foxglove-pictures-"))
    for number in range(30):
        noise = Image.effect_noise((160, 120), 60 + number).resize((640, 480)).convert("RGB")
        noise.save(folder / f"{number:02}.jpg", quality=92)
    sizes = [file.stat().st_size for file in folder.iterdir()]
    print(f"pictures of {sum(sizes) / len(sizes) / 1e3:.0f} kB")
    return folder


def measure_rates(robot, seconds):
    """The mean rate of each watched output by `armor hz`."""
    rates = {}

    def measure(data):
        text = robot.ask("hz", data, "--count", str(seconds), "--format", "json")
        found = [json.loads(line)["rate_hz"] for line in text.splitlines()]
        rates[data] = sum(found) / len(found)

    threads = [threading.Thread(target=measure, args=(data,)) for data in WATCHED]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    return rates


def processor_s(pid):
    fields = open(f"/proc/{pid}/stat").read().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def show(name, robot, seconds):
    pid = robot.pid("foxglove")
    before = processor_s(pid)
    rates = measure_rates(robot, seconds)
    used = (processor_s(pid) - before) / seconds
    clients = robot.echo("foxglove.clients")["value"]["clients"]
    about = "; ".join(f"sent {it['sent']}, dropped {it['dropped']}, waiting "
                      f"{it['waiting_bytes'] / 1e6:.1f} MB" for it in clients) or "no viewer"
    print(f"{name}: " + ", ".join(f"{data} {rate:.2f} Hz" for data, rate in rates.items()))
    print(f"    load {os.getloadavg()[0]:.1f}; {resident_mb(pid):.1f} MB resident, "
          f"{used * 100:.1f} % of a core; {about}", flush=True)


def read_everything(url):
    """The process of a viewer that shows all topics until it is ended."""
    viewer = Viewer(url)
    viewer.receive_for(2)
    viewer.subscribe(*viewer.channels)
    while True:
        viewer.receive(1)
        viewer.messages.clear()


def drive(url):
    viewer = Viewer(url)
    viewer.advertise(1, "/cmd_vel", "geometry_msgs/msg/Twist")
    drive_for(viewer, 1000, (0.0, 0.5))


def start_viewer(what, url):
    return subprocess.Popen([sys.executable, __file__, "--as", what, "--url", url])


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--armor", default=ROOT / "target/release/armor")
    parser.add_argument("--system", default="foxglove-load")
    parser.add_argument("--seconds", type=int, default=15)
    parser.add_argument("--as", dest="role", help=argparse.SUPPRESS)
    parser.add_argument("--url", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.role:
        return {"reader": read_everything, "driver": drive}[options.role](options.url)
    with Robot(options.armor, options.system, pictures=make_pictures()) as robot:
        probe = robot.viewer()
        probe.receive_for(3)
        print(f"{len(probe.channels)} outputs")
        probe.socket.close()
        show("no viewer", robot, options.seconds)
        viewers = [start_viewer("reader", robot.url)]
        try:
            time.sleep(5)
            show("a viewer that reads", robot, options.seconds)
            os.kill(viewers[0].pid, signal.SIGSTOP)
            stopped = time.monotonic()
            show("the viewer stopped", robot, min(options.seconds, 15))
            time.sleep(10)
            show("the viewer stopped for longer", robot, options.seconds)
            end = time.monotonic() + 90
            while "viewer 2 has left" not in robot.read_log() and time.monotonic() < end:
                time.sleep(0.5)
            left = [line for line in robot.read_log().splitlines() if "viewer 2 has left" in line]
            print(f"    {time.monotonic() - stopped:.0f} s after it was stopped: {left[0].split('INFO')[1]}")
            watcher = robot.viewer()
            watcher.subscribe("simulator.odometry", "foxglove.velocity")
            viewers.append(start_viewer("driver", robot.url))
            watcher.wait_for(lambda: len(watcher.messages.get("foxglove.velocity", [])) > 10, "the drive")
            assert speed_seen(watcher) > 0.2
            os.kill(viewers[1].pid, signal.SIGSTOP)
            print(f"a driver stopped: rest after {watch_rest(watcher):.2f} s")
        finally:
            for viewer in viewers:
                viewer.kill()


if __name__ == "__main__":
    main()
