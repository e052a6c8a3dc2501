#!/usr/bin/env python3
"""Measures the server of the operator's page, with the mission missions/web.xml.

Prints the time from a command of a page to its arrival as data, and the rates of the robot without
clients, with fifty, and with one that reads nothing; and the memory of the server.
"""

import argparse
import base64
import json
import os
import pathlib
import socket
import struct
import subprocess
import threading
import time
import urllib.request

from run import ROOT, Robot, wait_for

LAYERS = ["mapper.pose", "simulator.scan", "simulator.odometry", "planner.path", "driver.progress",
          "system", "mission"]
WATCHED = ["simulator.scan", "simulator.odometry", "mapper.pose", "driver.velocity"]


class Live:
    """A WebSocket of the standard library alone."""

    def __init__(self, robot, path):
        host, port = robot.url.removeprefix("http://").split(":")
        self.socket = socket.create_connection((host, int(port)))
        self.socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        key = base64.b64encode(os.urandom(16)).decode()
        self.socket.sendall((f"GET {path} HTTP/1.1\r\nHost: {host}:{port}\r\nConnection: Upgrade\r\n"
                             f"Upgrade: websocket\r\nSec-WebSocket-Version: 13\r\n"
                             f"Sec-WebSocket-Key: {key}\r\n\r\n").encode())
        self.file = self.socket.makefile("rb")
        status = self.file.readline()
        assert b" 101 " in status, status
        while self.file.readline() != b"\r\n":
            pass

    def send(self, message):
        text = json.dumps(message).encode()
        head = bytes([0x81]) + (bytes([0x80 | len(text)]) if len(text) < 126
                                else bytes([0xFE]) + struct.pack(">H", len(text)))
        self.socket.sendall(head + bytes(4) + text)

    def read(self):
        while True:
            kind, length = self.file.read(2)
            if length == 126:
                length, = struct.unpack(">H", self.file.read(2))
            elif length == 127:
                length, = struct.unpack(">Q", self.file.read(8))
            payload = self.file.read(length)
            if kind == 0x81:
                return json.loads(payload)
            if kind == 0x89:
                self.socket.sendall(b"\x8a\x80" + bytes(4))


def percentile(times, share):
    return sorted(times)[min(int(len(times) * share), len(times) - 1)] * 1e3


def measure_commands(robot, count):
    """Returns the times from a velocity of a page to its arrival at a second client."""
    live, control = Live(robot, "/api/live"), Live(robot, "/api/control")
    control.read()
    live.send({"subscribe": [{"name": "web.velocity", "max_hz": 100}]})
    time.sleep(1)
    times = []
    for number in range(count):
        # A turn by itself, so that each command is known by its number.
        turn = 0.001 * (number % 300 + 1)
        begin = time.monotonic()
        control.send({"drive": {"forward_mps": 0, "turn_radps": turn}})
        while True:
            message = live.read()
            value = message.get("value")
            if value and abs(value["angular"]["z"] - turn) < 1e-9:
                break
        times.append(time.monotonic() - begin)
        time.sleep(0.02)
    return times


def measure_stop(robot, count):
    """Returns the times from STOP to its answer, which follows its publication."""
    stop, times = Live(robot, "/api/stop/live"), []
    for number in range(count):
        begin = time.monotonic()
        stop.send({"stop": True, "id": number})
        assert stop.read()["stopped"]
        times.append(time.monotonic() - begin)
        time.sleep(0.005)
    return times


def measure_rates(armor, robot, seconds):
    rates = {}

    def measure(data):
        command = [armor, "hz", data, "--count", str(seconds), "--registry", robot.registry,
                   "--format", "json"]
        lines = subprocess.run(command, capture_output=True, text=True).stdout.splitlines()
        counts = [json.loads(line)["received"] for line in lines]
        # The first window begins with the link.
        rates[data] = sum(counts[1:]) / max(len(counts) - 1, 1)

    threads = [threading.Thread(target=measure, args=[data]) for data in WATCHED]
    [thread.start() for thread in threads]
    [thread.join() for thread in threads]
    return "  ".join(f"{data} {rates[data]:.2f}" for data in WATCHED)


def memory_kb(robot):
    pid = next(it["pid"] for it in robot.get("/api/system")["processes"] if it["name"] == "web")
    status = pathlib.Path(f"/proc/{pid}/status").read_text()
    stat = pathlib.Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()
    resident = next(line for line in status.splitlines() if line.startswith("VmRSS"))
    return int(resident.split()[1]), (int(stat[11]) + int(stat[12])) / 100


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--out", type=pathlib.Path, default=pathlib.Path("out/web-load"))
    parser.add_argument("--seconds", type=int, default=10)
    arguments = parser.parse_args()
    out = arguments.out.resolve()
    out.mkdir(parents=True, exist_ok=True)
    armor = os.path.abspath(os.environ.get("ARMOR", ROOT / "target/release/armor"))
    robot = Robot(armor, out, "127.0.0.1:17422", "127.0.0.1:18082")
    try:
        wait_for("the page", lambda: robot.places() == ["explore"])
        time.sleep(5)
        print("rates without clients:   ", measure_rates(armor, robot, arguments.seconds))
        print("memory, processor time:  ", "%d kB, %.1f s" % memory_kb(robot))
        lazy = Live(robot, "/api/live")
        lazy.send({"subscribe": [{"name": name, "max_hz": 100} for name in
                                 ["simulator.scan", "mapper.map", "mapper.particles", "simulator.odometry"]]})
        print("with one that reads nothing:", measure_rates(armor, robot, arguments.seconds))
        print("memory, processor time:  ", "%d kB, %.1f s" % memory_kb(robot))
        clients = [Live(robot, "/api/live") for _ in range(50)]
        counts = [0] * len(clients)

        def drain(index):
            try:
                while clients[index].read():
                    counts[index] += 1
            except ValueError:
                pass  # The connection has ended.

        for index, client in enumerate(clients):
            client.send({"subscribe": [{"name": name, "max_hz": 10} for name in LAYERS]})
            threading.Thread(target=drain, args=[index], daemon=True).start()
        begin, before = time.monotonic(), memory_kb(robot)[1]
        print("with fifty clients:      ", measure_rates(armor, robot, arguments.seconds))
        passed = time.monotonic() - begin
        memory, after = memory_kb(robot)
        print(f"memory, processor:        {memory} kB, {(after - before) / passed * 100:.0f} % of a core; "
              f"{sum(counts) / passed:.0f} values/s to all")
        for client in clients:
            client.socket.shutdown(socket.SHUT_RDWR)
        time.sleep(1)
        for what, times in [("a velocity to its arrival", measure_commands(robot, 500)),
                            ("STOP to its answer", measure_stop(robot, 1000))]:
            shares = "  ".join(f"p{share * 100:g} {percentile(times, share):.2f} ms"
                               for share in (0.5, 0.99, 1.0))
            print(f"{what}: {shares} ({len(times)})")
        with urllib.request.urlopen(robot.url + "/metrics") as response:
            for line in response.read().decode().splitlines():
                if line.startswith(("armor_web_dropped", "armor_web_refused", "armor_web_connections")):
                    print(line)
    finally:
        robot.end()


if __name__ == "__main__":
    main()
