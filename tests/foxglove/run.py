#!/usr/bin/env python3
"""Checks the component `foxglove` as a viewer sees it, with the mission missions/foxglove.xml.

Each check prints a line; the exit code is 1 if one fails. See README.md for what it needs.
"""

import argparse
import json
import math
import os
import pathlib
import random
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import time
import traceback

from websockets.exceptions import InvalidStatus

from viewer import ConnectionClosed, Viewer, boolean, twist

ROOT = pathlib.Path(__file__).resolve().parents[2]
# What each panel of the layout shows, and the type that it expects.
PANELS = {
    "mapper.map": "nav_msgs/msg/OccupancyGrid",
    "simulator.scan": "sensor_msgs/msg/LaserScan",
    "camera.image": "sensor_msgs/msg/CompressedImage",
    "planner.path": "nav_msgs/msg/Path",
    "mapper.pose": "geometry_msgs/msg/PoseWithCovarianceStamped",
    "mapper.transforms": "tf2_msgs/msg/TFMessage",
    "simulator.transforms": "tf2_msgs/msg/TFMessage",
    "foxglove.transforms": "tf2_msgs/msg/TFMessage",
    "simulator.odometry": "nav_msgs/msg/Odometry",
    "simulator.battery": "sensor_msgs/msg/BatteryState",
    "simulator.imu": "sensor_msgs/msg/Imu",
    "simulator.gps": "sensor_msgs/msg/NavSatFix",
}


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


class Robot:
    """A run of the mission, which ends with it."""

    def __init__(self, program, system, *options, pictures=None, mission="foxglove.xml"):
        self.program, self.system = program, system
        self.out = tempfile.mkdtemp(prefix="armor-foxglove-")
        port = free_port()
        self.url = f"ws://127.0.0.1:{port}"
        self.file = pathlib.Path(self.out, "foxglove.xml")
        # A copy: the test sets parameters, which changes the file.
        text = pathlib.Path(ROOT, "missions", mission).read_text()
        worlds = f'value="{ROOT}/missions/worlds/'
        if 'kind="foxglove"' not in text:
            ours = '<component name="foxglove" kind="foxglove" rate="10Hz" controllable="false"/>'
            text = text.replace('<component name="writer"', f'{ours}<component name="writer"', 1)
        if pictures:
            link = '<link from="simulator.camera" to="camera.raw"/>'
            camera = 'kind="camera" rate="10Hz"'
            assert link in text and camera in text
            text = text.replace(link, "").replace(camera, camera.replace("10Hz", "30Hz"))
            options = [*options, "--set", f"camera.files={pictures}"]
        self.file.write_text(text.replace('value="worlds/', worlds))
        self.log = open(f"{self.out}/log", "w")
        arguments = ["run", self.file, "--system", system, "--headless", "--quiet",
                     "--set", f"foxglove.listen=127.0.0.1:{port}", "--out", f"{self.out}/run"]
        self.run = subprocess.Popen([program, *arguments, *options], stdout=self.log,
                                    stderr=self.log, cwd=ROOT)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.run.send_signal(signal.SIGINT)
        self.run.wait(timeout=30)

    def viewer(self, **options):
        """Connects; waits for the server."""
        end = time.monotonic() + 60
        while True:
            try:
                return Viewer(self.url, **options)
            except (OSError, ConnectionError):
                assert time.monotonic() < end and self.run.poll() is None, self.read_log()
                time.sleep(0.2)

    def ask(self, *arguments):
        command = [self.program, *arguments, "--system", self.system]
        done = subprocess.run(command, capture_output=True, text=True, timeout=60)
        assert done.returncode == 0, f"{command}: {done.stderr}"
        return done.stdout

    def echo(self, data):
        """The newest value of an output."""
        return json.loads(self.ask("echo", data, "--once", "--format", "json").splitlines()[-1])

    def pid(self, name):
        listed = [json.loads(line) for line in self.ask("ps", "--format", "json").splitlines()]
        flat = [it for line in listed for it in (line if isinstance(line, list) else [line])]
        return next(it["pid"] for it in flat if it.get("name") == name)

    def read_log(self):
        return pathlib.Path(self.out, "log").read_text()[-3000:]


def speed(odometry):
    velocity = odometry.twist.twist
    return math.hypot(velocity.linear.x, velocity.angular.z)


def check_data(robot):
    viewer = robot.viewer()
    assert "clientPublish" in viewer.info["capabilities"], viewer.info
    viewer.wait_for(lambda: set(PANELS) <= set(viewer.channels), "all channels")
    assert "simulator.camera" not in viewer.channels, "it is hidden"
    viewer.subscribe(*viewer.channels)
    viewer.wait_for(lambda: set(PANELS) <= set(viewer.messages), "data of every panel")
    viewer.receive_for(3)
    for topic, schema in PANELS.items():
        assert viewer.channels[topic]["schemaName"] == schema, viewer.channels[topic]
    count = 0
    for topic, messages in viewer.messages.items():
        for _, payload in messages:
            viewer.decode(topic, payload)
            count += 1
    grid = viewer.last("mapper.map")
    assert grid.info.width * grid.info.height == len(grid.data) > 0
    assert grid.header.frame_id == "map" and {-1, 0, 100} & set(grid.data)
    scan = viewer.last("simulator.scan")
    assert len(scan.ranges) > 100 and scan.header.frame_id == "laser"
    image = viewer.last("camera.image")
    assert image.format == "jpeg" and bytes(image.data[:2]) == b"\xff\xd8"
    frames = {(it.header.frame_id, it.child_frame_id)
              for topic in ("mapper.transforms", "simulator.transforms", "foxglove.transforms")
              for it in viewer.last(topic).transforms}
    assert {("map", "odom"), ("odom", "base_link"), ("base_link", "laser")} <= frames, frames
    assert viewer.last("planner.path").header.frame_id == "map"
    return f"{count} messages of {len(viewer.messages)} topics decoded; transforms {sorted(frames)}"


def check_time(robot):
    viewer = robot.viewer()
    viewer.subscribe("simulator.odometry")
    viewer.wait_for(lambda: len(viewer.messages.get("simulator.odometry", [])) > 20, "odometry")
    assert viewer.times == sorted(viewer.times) and len(viewer.times) > 20
    stamps = [stamp for stamp, _ in viewer.messages["simulator.odometry"]]
    assert stamps == sorted(stamps)
    age_s = (viewer.times[-1] - stamps[-1]) / 1e9
    assert 0 <= age_s < 5, age_s
    assert abs(viewer.times[-1] / 1e9 - time.time()) < 5, "the system's time is the host's here"
    return f"{len(viewer.times)} times, the newest data {age_s * 1e3:.0f} ms old"


def check_simulated_time(robot):
    """The same in a mission whose time is simulated, four times as fast."""
    with Robot(robot.program, f"{robot.system}-simulated", mission="explore-and-map.xml") as other:
        viewer = other.viewer()
        viewer.subscribe("simulator.odometry")
        viewer.wait_for(lambda: len(viewer.messages.get("simulator.odometry", [])) > 20, "odometry")
        begin, begun_ns = time.monotonic(), viewer.times[-1]
        viewer.receive_for(4)
        speed = (viewer.times[-1] - begun_ns) / 1e9 / (time.monotonic() - begin)
        stamp_ns, payload = viewer.messages["simulator.odometry"][-1]
        stamp = viewer.decode("simulator.odometry", payload).header.stamp
    assert viewer.times == sorted(viewer.times) and speed > 1.5, speed
    age_s = stamp_ns / 1e9 - (stamp.sec + stamp.nanosec / 1e9)
    assert 0 <= age_s < 1 and 0 <= viewer.times[-1] - stamp_ns < 1e9, (age_s, viewer.times[-1], stamp_ns)
    return f"time passes {speed:.1f} times as fast as the host's, odometry is {age_s * 1e3:.0f} ms old"


def check_late_viewer(robot):
    """A latched output that is not published again reaches a viewer that comes later."""
    first = robot.viewer()
    first.subscribe("configuration.state", "executive.marking")
    first.wait_for(lambda: len(first.messages) == 2, "the first viewer's values")
    late = robot.viewer()
    late.subscribe("configuration.state", "executive.marking")
    late.wait_for(lambda: len(late.messages) == 2, "the late viewer's values")
    return f"{late.last('executive.marking').places[0]}"[:60]


def check_parameters(robot):
    viewer, other = robot.viewer(), robot.viewer()
    viewer.send({"op": "getParameters", "parameterNames": [], "id": "all"})
    viewer.wait_for(lambda: viewer.parameters, "parameters")
    assert viewer.parameters["driver.speed"] == 0.9, viewer.parameters
    paths = [name for name in viewer.parameters if "world" in name or name.endswith(".files")]
    assert not paths, f"paths are shown: {paths}"
    other.send({"op": "subscribeParameterUpdates", "parameterNames": ["driver.speed"]})
    other.receive_for(2.5)
    change = [{"name": "driver.speed", "value": 0.8, "type": "float64"}]
    viewer.send({"op": "setParameters", "parameters": change, "id": "set"})
    viewer.wait_for(lambda: viewer.parameters["driver.speed"] == 0.8, "the new value")
    other.wait_for(lambda: other.parameters.get("driver.speed") == 0.8, "the update")
    assert 'value="0.8m/s"' in robot.file.read_text(), "it is in the file"
    for name, value in [("simulator.world", "/etc/passwd"), ("driver.speed", 1e9), ("no.such", 1),
                        ("driver.speed", [1])]:
        viewer.statuses.clear()
        change = [{"name": name, "value": value}]
        viewer.send({"op": "setParameters", "parameters": change, "id": "bad"})
        viewer.wait_for(lambda: viewer.statuses, f"the refusal of {name}={value}")
    assert "/etc/passwd" not in robot.file.read_text()
    return f"{len(viewer.parameters)} parameters; refused: {viewer.statuses[-1][:50]}"


def check_graph(robot):
    viewer = robot.viewer()
    viewer.send({"op": "subscribeConnectionGraph"})
    links = viewer.graph["subscribed"]
    viewer.wait_for(lambda: "driver" in links.get("simulator.scan", []), "the links")
    assert set(links["simulator.scan"]) >= {"driver", "mapper"}, links["simulator.scan"]
    assert viewer.graph["published"]["mapper.map"] == ["mapper"]
    assert viewer.graph["services"]["/mission/pause"] == ["foxglove"]
    return f"{len(viewer.graph['published'])} topics, {sum(map(len, links.values()))} subscribers"


def drive_for(viewer, seconds, velocity=(0.25, 0.0), encoding="cdr"):
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        if encoding == "json":
            zero = {"x": 0, "y": 0, "z": 0}
            message = {"linear": zero | {"x": velocity[0]}, "angular": zero | {"z": velocity[1]}}
            viewer.publish(1, json.dumps(message).encode())
        else:
            viewer.publish(1, twist(*velocity))
        viewer.receive_for(0.1)


def watch_rest(watcher, seconds=10):
    """Time until the odometry shows that the robot is at rest."""
    begin = time.monotonic()
    watcher.messages.clear()
    watcher.wait_for(lambda: "simulator.odometry" in watcher.messages
                     and speed(watcher.last("simulator.odometry")) < 0.01, "rest", seconds)
    return time.monotonic() - begin


def check_driving(robot):
    watcher = robot.viewer()
    watcher.subscribe("simulator.odometry", "foxglove.velocity")
    times = []
    for encoding, end in [("cdr", "silence"), ("json", "close"), ("cdr", "reset")]:
        driver, other = robot.viewer(), robot.viewer()
        for viewer in (driver, other):
            viewer.advertise(1, "/cmd_vel", "geometry_msgs/msg/Twist", encoding)
        drive_for(driver, 2.0, (0.0, 0.5), encoding)
        watcher.messages.clear()
        drive_for(driver, 0.3, (0.0, 0.5), encoding)
        other.publish(1, twist(0.25, 0) if encoding == "cdr" else b'{"linear":{"x":0.25}}')
        other.wait_for(lambda: any("another client" in it for it in other.statuses), "the refusal")
        drive_for(driver, 0.3, (0.0, 0.5), encoding)
        if end == "close":
            driver.socket.close()
        elif end == "reset":
            linger = struct.pack("ii", 1, 0)
            driver.socket.socket.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, linger)
            driver.socket.socket.close()
        assert speed_seen(watcher) > 0.2, f"it has turned; {driver.statuses[-3:]}"
        times.append(f"{end} {watch_rest(watcher):.2f} s")
        driver.socket.close()
        other.socket.close()
    return "rest after " + ", ".join(times)


def speed_seen(watcher):
    """The highest speed that the watcher has received."""
    watcher.receive_for(0.1)
    seen = [speed(watcher.decode("simulator.odometry", it))
            for _, it in watcher.messages.get("simulator.odometry", [])]
    return max(seen, default=0)


def check_stop(robot):
    viewer, other = robot.viewer(), robot.viewer()
    viewer.advertise(1, "/cmd_vel", "geometry_msgs/msg/Twist")
    for it in (viewer, other):
        it.advertise(2, "/stop", "std_msgs/msg/Bool")
    viewer.subscribe("foxglove.stop", "simulator.odometry")
    drive_for(viewer, 1.0, (0.0, 0.5))
    other.publish(2, boolean(True))
    stopped = lambda: "foxglove.stop" in viewer.messages and viewer.last("foxglove.stop").data
    viewer.wait_for(stopped, "STOP")
    rest = watch_rest(viewer)
    viewer.publish(1, twist(0.2, 0))
    viewer.wait_for(lambda: any("STOP is in force" in it for it in viewer.statuses), "a refusal")
    other.publish(2, boolean(False))
    other.wait_for(lambda: any("another client" in it for it in other.statuses), "a refusal")
    viewer.publish(2, boolean(False))
    viewer.wait_for(lambda: "foxglove.stop" in viewer.messages
                    and not viewer.last("foxglove.stop").data, "the release")
    return f"rest {rest:.2f} s after STOP"


def check_goal(robot):
    viewer = robot.viewer()
    viewer.subscribe("mapper.pose", "foxglove.goal", "planner.path")
    viewer.wait_for(lambda: "mapper.pose" in viewer.messages, "a pose")
    place = viewer.last("mapper.pose").pose.pose.position
    viewer.advertise(3, "/goal_pose", "geometry_msgs/msg/PoseStamped", "json")
    pose = {"position": {"x": place.x, "y": place.y + 0.6, "z": 0},
            "orientation": {"x": 0, "y": 0, "z": 0, "w": 1}}
    header = {"stamp": {"sec": 0, "nanosec": 0}, "frame_id": "map"}
    viewer.publish(3, json.dumps({"header": header, "pose": pose}).encode())
    viewer.wait_for(lambda: len(viewer.messages.get("foxglove.goal", [])) > 5, "repeated goals")
    assert viewer.last("foxglove.goal").header.frame_id == "map"
    viewer.socket.close()
    watcher = robot.viewer()
    watcher.receive_for(0.5)
    watcher.subscribe("foxglove.goal")
    watcher.receive_for(1.5)
    assert "foxglove.goal" not in watcher.messages, "the goal ends with its client"
    return "sent again at every tick, and ended with its client"


def check_services(robot):
    viewer = robot.viewer()
    assert viewer.call("/mission/pause", 1, b"{}")["success"]
    assert viewer.call("/mission/resume", 2, b"{}")["success"]
    answer = viewer.call("/mission/pause", 3, b"\0\1\0\0", "cdr")
    assert answer[4] == 1, answer
    assert viewer.call("/mission/resume", 4, b"\0\1\0\0", "cdr")[4] == 1
    wrong = viewer.call("/mission/fire", 5, b'{"transition":"nowhere"}')
    assert not wrong["success"] and "nowhere" in wrong["message"], wrong
    assert "cdr or json" in viewer.call("/mission/fire", 6, b"", "protobuf")
    viewer.services["/no"] = {"id": 99}
    assert "no service 99" in viewer.call("/no", 7, b"")
    journal = robot.ask("mission", "show")
    return f"orders accepted; refused: {wrong['message'][:60]}; {len(journal)} bytes of state"


def check_strangers(robot):
    for origin, host in [("https://evil.example", None), ("null", None), (None, "evil.example")]:
        headers = {"Host": host} if host else {}
        try:
            Viewer(robot.url, origin=origin, additional_headers=headers)
        except InvalidStatus as refused:
            assert refused.response.status_code == 403
        else:
            raise AssertionError(f"{origin} {host} was accepted")
    for origin in ["https://app.foxglove.dev", "file://"]:
        Viewer(robot.url, origin=origin, protocols=("foxglove.websocket.v1",))
    try:
        Viewer(robot.url, protocols=("soap",))
    except InvalidStatus as refused:
        assert refused.response.status_code == 403
    return "pages of strangers and other protocols get 403"


def check_damage(robot, count=20_000):
    """Requests with random damage: none ends the server, and the robot continues."""
    dice, opened = random.Random(7), 0
    requests = [
        json.dumps({"op": "subscribe", "subscriptions": [{"id": 1, "channelId": 2}]}),
        json.dumps({"op": "unsubscribe", "subscriptionIds": [1]}),
        json.dumps({"op": "advertise", "channels": [{"id": 1, "topic": "/cmd_vel", "encoding": "json",
                                                     "schemaName": "geometry_msgs/msg/Twist"}]}),
        json.dumps({"op": "getParameters", "parameterNames": ["a.b"], "id": "x"}),
        json.dumps({"op": "subscribeParameterUpdates", "parameterNames": []}),
        json.dumps({"op": "subscribeConnectionGraph"}), json.dumps({"op": "fetchAsset", "uri": "x"}),
        struct.pack("<BI", 1, 1) + twist(0, 0), struct.pack("<BIII", 2, 3, 9, 4) + b"json{}",
        struct.pack("<BIII", 2, 3, 9, 0xFFFFFFFF), bytes([9]), b"",
    ]
    pid = robot.pid("foxglove")
    viewer = None
    for number in range(count):
        if viewer is None:
            viewer, opened = robot.viewer(), opened + 1
        request = dice.choice(requests)
        data = bytearray(request.encode() if isinstance(request, str) else request)
        for _ in range(dice.randrange(4)):
            if data:
                data[dice.randrange(len(data))] = dice.randrange(256)
        if dice.random() < 0.1:
            data = data[:dice.randrange(len(data) + 1)]
        try:
            as_text = isinstance(request, str) and dice.random() < 0.9
            viewer.socket.send(data.decode("utf-8", "replace") if as_text else bytes(data))
            while number % 16 == 0 and viewer.receive(0):
                pass
        except ConnectionClosed:
            viewer = None
    # Damage below the WebSocket, too: bytes of any kind.
    address = tuple(robot.url.removeprefix("ws://").split(":"))
    for number in range(300):
        with socket.create_connection((address[0], int(address[1]))) as raw:
            head = (f"GET / HTTP/1.1\r\nHost: {address[0]}:{address[1]}\r\nConnection: Upgrade\r\n"
                    "Upgrade: websocket\r\nSec-WebSocket-Version: 13\r\n"
                    "Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n"
                    "Sec-WebSocket-Protocol: foxglove.sdk.v1\r\n\r\n").encode()
            raw.sendall(dice.randbytes(200) if number % 3 == 0 else head + dice.randbytes(200))
    assert robot.pid("foxglove") == pid, "it has died"
    check = robot.viewer()
    check.subscribe("simulator.odometry")
    check.wait_for(lambda: "simulator.odometry" in check.messages, "data after the damage")
    return f"{count} requests on {opened} connections, {resident_mb(pid):.0f} MB resident"


def resident_mb(pid):
    status = pathlib.Path(f"/proc/{pid}/status").read_text()
    line = next(line for line in status.splitlines() if line.startswith("VmRSS"))
    return int(line.split()[1]) / 1024


CHECKS = [check_data, check_time, check_simulated_time, check_late_viewer, check_parameters,
          check_graph, check_strangers, check_services, check_driving, check_stop, check_goal,
          check_damage]


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--armor", default=ROOT / "target/release/armor")
    parser.add_argument("--system", default="foxglove-check")
    parser.add_argument("checks", nargs="*", help="only these, such as driving")
    options = parser.parse_args()
    chosen = [it for it in CHECKS if not options.checks or it.__name__[6:] in options.checks]
    failed = 0
    with Robot(options.armor, options.system) as robot:
        for check in chosen:
            name = check.__name__.removeprefix("check_").replace("_", " ")
            try:
                print(f"{name}: {check(robot)}", flush=True)
            except Exception:
                failed += 1
                print(f"{name}: FAILED\n{traceback.format_exc()}", flush=True)
        if failed:
            print(robot.read_log())
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    main()
