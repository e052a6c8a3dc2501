#!/usr/bin/env python3
"""Messages between two Python processes: Armor, pyzmq, zenoh and dora in turn, in the same run,
and Armor's components in Rust.

    cargo build --release -p armor -p armor-bench
    python3 -m venv /tmp/venv && . /tmp/venv/bin/activate
    pip install numpy pyzmq eclipse-zenoh dora-rs dora-rs-cli && pip install armor --find-links WHEELS
    python3 bench/python_peers.py [--rounds 3] [--seconds 2] [--same-core] [--only NAME]
    python3 bench/python_peers.py --memory 10000000     resident memory while so many messages pass
    python3 bench/python_peers.py --start               time and memory of the import

One process is on core 0, the other on core 1, or both on core 0. Armor and pyzmq use Unix sockets (Armor shared
memory for large messages), zenoh TCP on loopback between two peers, dora its daemon and shared memory. A flood with Armor is sent within one
call of `exec`, with `keep="all"`; with pyzmq by PUSH and PULL without a limit on the waiting messages that
matters; with zenoh with `CongestionControl.BLOCK`; with dora with the policy `backpressure`. Each image is
a numpy array, and is read at the other end: the sum of every 4096th byte; in Rust it is not read. The
tables are medians of the rounds.
"""

import argparse
import functools
import json
import os
import pathlib
import resource
import shutil
import statistics
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parent.parent
SMALL = 100
IMAGE = 8 << 20
REGISTRY = "127.0.0.1:7663"
WARM_UP = 200


class Pings:
    """Measures round trips; `send` sends a message, `answered` is called with each answer."""

    def __init__(self, seconds, send):
        self.seconds, self.send, self.took, self.begun = seconds, send, [], None

    def begin(self):
        self.begun = self.sent = time.perf_counter()
        self.send()

    def answered(self):
        now = time.perf_counter()
        self.took.append(now - self.sent)
        if now - self.begun > self.seconds and len(self.took) > 2 * WARM_UP:
            took = sorted(self.took[WARM_UP:])
            finish({"p50_us": took[len(took) // 2] * 1e6, "p99_us": took[len(took) * 99 // 100] * 1e6})
        self.sent = time.perf_counter()
        self.send()


class Sink:
    """Counts messages until the time is over; `checked` is read from each image."""

    def __init__(self, seconds):
        self.seconds, self.count, self.begun, self.checked, self.rss = seconds, 0, None, 0, []
        self.most = int(os.environ.get("PEERS_MEMORY", 0))

    def received(self):
        if self.begun is None:
            self.begun = time.perf_counter()
            return
        self.count += 1
        if self.most:
            return self.watch_memory()
        if self.count % 1000 and not self.checked:
            return
        took = time.perf_counter() - self.begun
        if took > self.seconds:
            finish({"per_s": self.count / took, "peak_kb": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss})

    def watch_memory(self):
        if self.count % (self.most // 10) == 0:
            self.rss.append(resident_kb())
            if len(self.rss) == 10:
                finish({"resident_kb": self.rss})


def resident_kb():
    return int(pathlib.Path("/proc/self/status").read_text().split("VmRSS:")[1].split()[0])


FIRST = """
import armor, time, os
from armor.messages import Flag
class First(armor.Component):
    'Ends after its first message.'
    def __init__(self): self.provide("out", Flag)
    def exec(self, call):
        self.send_data("out", Flag(data=True))
        os._exit(0)
armor.run(First)
"""


def measure_first():
    """From the start of a process until it has published, without a bare interpreter's time."""
    arguments = ["--alone", "--registry", REGISTRY]

    def seconds(code):
        begun = time.perf_counter()
        command = [sys.executable, "-c", code, *arguments]
        subprocess.run(command, check=True, stderr=subprocess.DEVNULL)
        return time.perf_counter() - begun

    pairs = [(seconds("import os; os._exit(0)"), seconds(FIRST)) for _ in range(21)]
    return statistics.median(first - bare for bare, first in pairs) * 1e3


def measure_start():
    """What the import adds to the interpreter: time of whole processes, and resident memory."""

    def seconds(code):
        begun = time.perf_counter()
        subprocess.run([sys.executable, "-c", code], check=True)
        return time.perf_counter() - begun

    end = "; import os; os._exit(0)"
    added = "import armor, armor.messages" + end
    pairs = [(seconds("pass" + end), seconds(added)) for _ in range(21)]
    took = statistics.median(with_armor - bare for bare, with_armor in pairs)
    print(f"import of armor and its messages: {took * 1e3:.1f} ms beyond the interpreter's start")
    print(f"start to the first message: {measure_first():.1f} ms beyond the interpreter's start")
    code = "import {}; print([l for l in open('/proc/self/status') if 'VmRSS' in l][0].split()[1])"
    for before in ("sys", "numpy"):
        values = [
            int(subprocess.check_output([sys.executable, "-c", code.format(it)]))
            for it in (before, before + ", armor, armor.messages")
        ]
        print(f"resident: {before} {values[0]} kB, with armor {values[1]} kB: + {values[1] - values[0]} kB")


def finish(result):
    print(json.dumps(result), flush=True)
    # A node of dora has its output in a log.
    if where := os.environ.get("PEERS_RESULT"):
        pathlib.Path(where + ".new").write_text(json.dumps(result))
        os.rename(where + ".new", where)
    os._exit(0)


def run_armor(role, seconds, size):
    import armor
    import numpy as np

    if size == IMAGE:
        from armor.messages import Image as Payload

        image = np.zeros(size, np.uint8)
        make = lambda: Payload(data=image)
    else:

        @armor.message
        class Payload:
            data: bytes

        small = Payload(bytes(size - 8))
        make = lambda: small

    class Role(armor.Component):
        """A role."""

        kind = role

        def __init__(self):
            self.provide("out", Payload)
            self.subscribe("in", Payload, optional=True)
            self.sink = Sink(seconds)
            self.pings = Pings(seconds, lambda: self.send_data("out", make()))
            if role == "ping":
                self.data_received = lambda header, data: self.pings.answered()
            elif role == "echo":
                self.data_received = lambda header, data: self.send_data("out", data)
            elif role == "sink":
                self.data_received = self.take

        def take(self, header, data):
            if size == IMAGE:
                self.sink.checked += int(data.data[::4096].sum()) + 1
            self.sink.received()

        def exec(self, call):
            if role == "ping" and not self.pings.took and call == armor.Call.TICK:
                self.pings.begin()
            if role == "flood" and call == armor.Call.TICK:
                while True:
                    self.send_data("out", make())

    other = {"ping": "echo", "echo": "ping", "sink": "flood", "flood": "none"}[role]
    arguments = ["--alone", "--name", role, "--registry", REGISTRY]
    arguments += ["--link", f"in={other}.out,keep=all"] if role != "flood" else []
    # The first tick comes when the links are there.
    arguments += ["--rate", "2Hz"] if role in ("ping", "flood") else []
    sys.argv[1:] = arguments
    armor.run(Role)


def run_zmq(role, seconds, size):
    import numpy as np
    import zmq

    context = zmq.Context()
    path = f"ipc://{os.environ['PEERS_FOLDER']}/zmq"
    image = np.zeros(size, np.uint8)
    small = bytes(size)
    if role in ("ping", "echo"):
        socket = context.socket(zmq.PAIR)
        socket.bind(path) if role == "echo" else socket.connect(path)
        if role == "echo":
            while True:
                socket.send(socket.recv())
        pings = Pings(seconds, lambda: socket.send(small))
        pings.begin()
        while True:
            socket.recv()
            pings.answered()
    socket = context.socket(zmq.PUSH if role == "flood" else zmq.PULL)
    socket.bind(path) if role == "sink" else socket.connect(path)
    if role == "flood":
        while True:
            if size == IMAGE:
                socket.send(image, copy=False)
            else:
                socket.send(small)
    sink = Sink(seconds)
    while True:
        if size == IMAGE:
            frame = socket.recv(copy=False)
            sink.checked += int(np.frombuffer(frame.buffer, np.uint8)[::4096].sum()) + 1
        else:
            socket.recv()
        sink.received()


def run_zenoh(role, seconds, size):
    import numpy as np
    import zenoh

    config = zenoh.Config()
    config.insert_json5("scouting/multicast/enabled", "false")
    where = '["tcp/127.0.0.1:7664"]'
    listens = role in ("echo", "sink")
    config.insert_json5("listen/endpoints" if listens else "connect/endpoints", where)
    session = zenoh.open(config)
    block = {"congestion_control": zenoh.CongestionControl.BLOCK, "express": role in ("ping", "echo")}
    publisher = session.declare_publisher("out/" + role, **block)
    small, image = bytes(size), np.zeros(size, np.uint8)
    if role == "echo":
        session.declare_subscriber("out/ping", lambda sample: publisher.put(sample.payload))
    elif role == "ping":
        pings = Pings(seconds, lambda: publisher.put(small))
        session.declare_subscriber("out/echo", lambda sample: pings.answered())
        while not pings.took:
            time.sleep(0.5)
            pings.begin()
    elif role == "flood":
        time.sleep(0.5)
        while True:
            publisher.put(image.tobytes() if size == IMAGE else small)
    else:
        sink = Sink(seconds)

        def take(sample):
            if size == IMAGE:
                sink.checked += int(np.frombuffer(sample.payload.to_bytes(), np.uint8)[::4096].sum()) + 1
            sink.received()

        session.declare_subscriber("out/flood", take)
    time.sleep(3600)


def run_dora(role, seconds, size):
    import dora
    import numpy as np
    import pyarrow as pa

    node = dora.Node()
    image, small = np.zeros(size, np.uint8), bytes(size)
    make = lambda: pa.array(image) if size == IMAGE else small
    send = lambda: node.send_output("out", make())
    if role == "flood":
        time.sleep(1)
        while True:
            send()
    sink, pings = Sink(seconds), Pings(seconds, send)
    if role == "ping":
        time.sleep(1)
        pings.begin()
    for event in node:
        if event["type"] != "INPUT":
            continue
        value = event["value"]
        if role == "ping":
            pings.answered()
        elif role == "echo":
            node.send_output("out", value)
        else:
            if size == IMAGE:
                sink.checked += int(value.to_numpy()[::4096].sum()) + 1
            sink.received()


RUN = {"armor": run_armor, "pyzmq": run_zmq, "zenoh": run_zenoh, "dora": run_dora}


def start(library, role, seconds, size, core):
    command = [sys.executable, __file__, "--role", f"{library} {role} {seconds} {size} {core}"]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)


def measure(library, roles, seconds, size, cores):
    """The result of the first role; the other one is ended."""
    others = [start(library, role, seconds, size, core) for role, core in zip(roles[1:], cores[1:])]
    first = start(library, roles[0], seconds, size, cores[0])
    try:
        text, _ = first.communicate(timeout=seconds + 20)
        return json.loads(text.decode().splitlines()[-1])
    except (subprocess.TimeoutExpired, IndexError, json.JSONDecodeError):
        first.kill()
        return None
    finally:
        for other in others:
            other.kill()
            other.wait()
        time.sleep(0.3)


def measure_dora(roles, seconds, size, cores):
    """The same with dora, whose program starts both processes."""
    folder = pathlib.Path(tempfile.mkdtemp(dir=os.environ["PEERS_FOLDER"]))
    result, graph = folder / "result", {"nodes": []}
    for role, other, core in zip(roles, reversed(roles), cores):
        arguments = f"{__file__} --role 'dora {role} {seconds} {size} {core}'"
        node = {"id": role, "path": sys.executable, "args": arguments, "outputs": ["out"]}
        if role != "flood":
            link = {"source": f"{other}/out", "queue_size": 100, "queue_policy": "backpressure"}
            node["inputs"] = {"in": link}
        if role == roles[0]:
            node["env"] = {"PEERS_RESULT": str(result)}
        graph["nodes"].append(node)
    # JSON is YAML.
    (folder / "dataflow.yml").write_text(json.dumps(graph))
    command = [str(pathlib.Path(sys.executable).with_name("dora")), "run", "dataflow.yml"]
    program = subprocess.Popen(
        command, cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True
    )
    try:
        end = time.monotonic() + seconds + 20
        while not result.exists() and program.poll() is None and time.monotonic() < end:
            time.sleep(0.05)
        return json.loads(result.read_text()) if result.exists() else None
    finally:
        os.killpg(program.pid, 9)
        program.wait()
        # The nodes are not in its session.
        subprocess.run(["pkill", "-9", "-f", "--", "--role dora "], check=False)
        time.sleep(0.3)


def measure_rust(roles, seconds, size, cores):
    """The same between two components in Rust, which `armor-bench` has."""
    bench = ROOT / "target/release/armor-bench"

    def start_role(role, core, more):
        command = [bench, "role", str(core), "armor", role, "--alone", "--name", role, "--registry", REGISTRY]
        command += ["--set", f"len={size}", *more]
        quiet = os.environ | {"ARMOR_LOG": "error"}
        return subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=quiet)

    window, flood = ["--set", f"window={seconds}s"], ["--set", "subscribers=1", "--set", "paced=false"]
    first = {"ping": ["--link", "pong=echo.pong", *window], "sink": ["--link", "data=flood.data,keep=all", *window]}
    second = {"echo": ["--link", "ping=ping.ping"], "flood": [*flood, "--rate", "100Hz", *window]}
    answering = start_role(roles[1], cores[1], second[roles[1]])
    asking = start_role(roles[0], cores[0], first[roles[0]])
    try:
        for line in asking.stdout:
            values = dict(pair.split("=") for pair in line.split()[1:] if "=" in pair)
            if "p50_us" in values:
                return {name: float(values[name]) for name in ("p50_us", "p99_us")}
            if line.startswith("window "):
                return {"per_s": float(values["rate_hz"])}
    finally:
        for process in (asking, answering):
            process.kill()
            process.wait()
        time.sleep(0.3)


MEASURE = {"dora": measure_dora, "rust": measure_rust}

JOBS = {
    "round trip 100 B": (("ping", "echo"), SMALL, ("p50_us", "p99_us"), "us"),
    "flood 100 B": (("sink", "flood"), SMALL, ("per_s",), "messages/s"),
    "image 8 MiB": (("sink", "flood"), IMAGE, ("per_s",), "images/s"),
}


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--role", help=argparse.SUPPRESS)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--seconds", type=float, default=2)
    parser.add_argument("--same-core", action="store_true")
    parser.add_argument("--memory", type=int)
    parser.add_argument("--start", action="store_true")
    parser.add_argument("--only", choices=list(JOBS))
    parser.add_argument("--libraries", nargs="+", default=["armor", "rust", *list(RUN)[1:]])
    parser.add_argument("--armor", default=ROOT / "target/release/armor")
    options = parser.parse_args()
    if options.role:
        library, role, seconds, size, core = options.role.split()
        os.sched_setaffinity(0, {int(core)})
        return RUN[library](role, float(seconds), int(size))
    if options.memory:
        os.environ["PEERS_MEMORY"] = str(options.memory)
        options.libraries, options.only, options.rounds, options.seconds = ["armor"], "flood 100 B", 1, 600
    cores = [0, 0] if options.same_core else [0, 1]
    folder = tempfile.mkdtemp()
    os.environ["PEERS_FOLDER"] = folder
    registry = subprocess.Popen([options.armor, "registry", "--listen", REGISTRY], stderr=subprocess.DEVNULL)
    time.sleep(0.5)
    try:
        if options.start:
            return measure_start()
        for name in [options.only] if options.only else JOBS:
            roles, size, keys, unit = JOBS[name]
            found = {library: [] for library in options.libraries}
            for _ in range(options.rounds):
                for library in options.libraries:
                    by = MEASURE.get(library, functools.partial(measure, library))
                    result = by(roles, options.seconds, size, cores)
                    if result:
                        found[library].append(result)
            if options.memory:
                print("resident kB at each tenth:", *found["armor"][0]["resident_kb"])
                return
            for library, results in found.items():
                for key in keys:
                    values = [result[key] for result in results]
                    middle = statistics.median(values) if values else float("nan")
                    print(f"| {name}, {key} | {library} | {middle:,.1f} | {unit} |", flush=True)
    finally:
        registry.terminate()
        registry.wait()
        shutil.rmtree(folder, ignore_errors=True)


if __name__ == "__main__":
    main()
