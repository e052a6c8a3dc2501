#!/usr/bin/env python3
"""What it costs a system to be observed: 200 components, 1,000 links, with and without a tool.

    cargo build --release -p armor --bin armor --example probe
    python3 bench/observers.py [--rounds 5] [--seconds 10] [--rate 1] [--count 200] [--profile release]

Two equal systems run at the same time, and a tool observes one of them, in turn: what else the machine does
is the same for both, and the difference is the tool's. Each component is a process with five inputs, which
five others feed; one more publishes at 100 Hz. The processor time of all processes is read from /proc in
nanoseconds (/proc/PID/task/*/schedstat); the tool's own time is listed for itself. Then the rate that
`armor hz` reports is compared with the number of messages that the component has published in the same
time, by its own count. Needs no root.
"""

import argparse
import json
import os
import pathlib
import shutil
import signal
import statistics
import subprocess
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parent.parent
FAST_HZ = 100
INPUTS = "abcde"


def write_system(folder, count, rate, profile):
    lines = ['<armor version="1">', '<system name="observed">']
    for number in range(count):
        lines.append(f'<component name="c{number}" kind="probe" rate="{rate}Hz"/>')
    lines.append(f'<component name="fast" kind="probe" rate="{FAST_HZ}Hz"/>')
    lines.append('<component name="reader" kind="probe"/>')
    lines.append('<link from="fast.numbers" to="reader.a"/>')
    for number in range(count):
        for step, port in enumerate(INPUTS, 1):
            source = (number + step) % count
            lines.append(f'<link from="c{source}.numbers" to="c{number}.{port}"/>')
    lines += ["</system>", "</armor>", ""]
    file = folder / "observed.xml"
    file.write_text("\n".join(lines))
    (folder / "components").mkdir()
    (folder / "components/probe").symlink_to(ROOT / f"target/{profile}/examples/probe")
    return file


def children(pid):
    found = [pid]
    for parent in found:
        for task in pathlib.Path(f"/proc/{parent}/task").glob("*/children"):
            found += [int(child) for child in task.read_text().split()]
    return found


def cpu_ns(pids):
    total = 0
    for pid in pids:
        for task in pathlib.Path(f"/proc/{pid}/task").glob("*/schedstat"):
            try:
                total += int(task.read_text().split()[0])
            except (OSError, IndexError):
                pass
    return total


class System:
    def __init__(self, count, rate, profile):
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="armor-observers-"))
        self.armor = ROOT / f"target/{profile}/armor"
        file = write_system(self.folder, count, rate, profile)
        self.environment = dict(os.environ, XDG_RUNTIME_DIR=str(self.folder))
        self.run = subprocess.Popen(
            [self.armor, "run", file, "--headless", "--out", self.folder / "out"],
            cwd=self.folder, env=self.environment, stdout=subprocess.DEVNULL,
        )
        deadline = time.monotonic() + 120
        while True:
            links = self.lines("graph")
            if len(links) == count * len(INPUTS) + 1 and all(link["received"] > 0 for link in links):
                break
            if time.monotonic() > deadline:
                raise SystemExit(f"only {len(links)} links are up")
            time.sleep(1)
        self.pids = children(self.run.pid)

    def command(self, *arguments):
        return [self.armor, *arguments, "--system", "observed"]

    def lines(self, *arguments):
        done = subprocess.run(
            [*self.command(*arguments), "--format", "json"],
            env=self.environment, capture_output=True, text=True,
        )
        return [json.loads(line) for line in done.stdout.splitlines()]

    def start_tool(self, arguments):
        return subprocess.Popen(
            [*self.command(*arguments), "--format", "json"],
            env=self.environment, stdout=subprocess.DEVNULL,
        )

    def published(self):
        for process in self.lines("ps", "fast"):
            status = process["status"]
            return status["uptime_s"], status["outputs"][0]["published"]

    def rate_error(self, seconds):
        """Percent by which the rate of `armor hz` differs from the component's own count."""
        (from_s, first) = self.published()
        # The first window begins before the link is up.
        windows = self.lines("hz", "fast.numbers", "-n", str(seconds + 1))[1:]
        (to_s, last) = self.published()
        truth = (last - first) / (to_s - from_s)
        shown = statistics.mean(window["rate_hz"] for window in windows)
        lost = sum(window["lost"] for window in windows)
        return truth, shown, lost

    def end(self):
        self.run.send_signal(signal.SIGINT)
        self.run.wait()
        shutil.rmtree(self.folder)


def compare(watched, other, arguments, seconds):
    """Percent of a core that each system and the tool use in the same time."""
    tool = watched.start_tool(arguments)
    time.sleep(2)
    groups = [watched.pids, other.pids, [tool.pid]]
    start, before = time.monotonic(), [cpu_ns(pids) for pids in groups]
    time.sleep(seconds)
    passed = time.monotonic() - start
    used = [(cpu_ns(pids) - first) / passed / 1e7 for pids, first in zip(groups, before)]
    if tool.poll() is not None:
        raise SystemExit(f"{arguments} has ended with {tool.returncode}")
    tool.send_signal(signal.SIGTERM)
    tool.wait()
    return used


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=200)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--seconds", type=int, default=10)
    parser.add_argument("--rate", type=float, default=1)
    parser.add_argument("--profile", default="release")
    options = parser.parse_args()
    tools = {
        "`armor top`": ("top",),
        "`armor echo fast.numbers`": ("echo", "fast.numbers"),
        "`armor hz fast.numbers`": ("hz", "fast.numbers"),
        "`armor trace`": ("trace",),
    }
    systems = []
    try:
        for _ in range(2):
            systems.append(System(options.count, options.rate, options.profile))
        alone, more, own = [], {tool: [] for tool in tools}, {tool: [] for tool in tools}
        for round_number in range(options.rounds):
            for tool, arguments in tools.items():
                both = [compare(*pair, arguments, options.seconds)
                        for pair in (systems, systems[::-1])]
                # Each system is once the observed one, so that what they differ in is taken away.
                more[tool].append(statistics.mean(with_ - without for with_, without, _ in both))
                own[tool].append(statistics.mean(used for _, _, used in both))
                alone += [without for _, without, _ in both]
                print(f"[{round_number + 1}] {tool}: {more[tool][-1]:+.2f} % of a core", flush=True)
        print(f"\nload average {os.getloadavg()[0]:.1f}; a system alone: median "
              f"{statistics.median(alone):.1f} % of a core, {min(alone):.1f} to {max(alone):.1f} %\n")
        print("| tool | % of a core more in the system: median (range) | of the tool itself |")
        print("| --- | ---: | ---: |")
        for tool in tools:
            low, high = min(more[tool]), max(more[tool])
            print(f"| {tool} | {statistics.median(more[tool]):+.2f} ({low:+.2f} to {high:+.2f}) "
                  f"| {statistics.median(own[tool]):.2f} |")
        for _ in range(options.rounds):
            truth, shown, lost = systems[0].rate_error(options.seconds)
            print(f"hz: {shown:.3f} Hz shown, {truth:.3f} Hz published, "
                  f"{(shown / truth - 1) * 100:+.3f} %, {lost} lost", flush=True)
    finally:
        for system in systems:
            system.end()


if __name__ == "__main__":
    main()
