"""Components in Python as processes: their command line, and systems in which some go wrong.

`ARMOR` names the program `armor`; without it, it is looked for in PATH.
"""

from __future__ import annotations

import json
import os
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
import unittest
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Callable, Dict, Iterator, List, Sequence

HERE = Path(__file__).parent
COMPONENTS = HERE / "components"
FOLLOWER = HERE.parent / "examples" / "follower.py"
ARMOR = os.environ.get("ARMOR") or shutil.which("armor") or ""
if ARMOR:
    ARMOR = os.path.abspath(ARMOR)
#: Only a hang takes longer.
LIMIT_S = 60.0

SYSTEM = """<armor version="1">
  <system name="python-tests">
    <component name="talker" kind="talker" rate="50Hz"/>
    <component name="listener" kind="listener" rate="10Hz"/>
    <component name="raise" kind="faulty" rate="20Hz"><parameter name="way" value="raise"/></component>
    <component name="hang" kind="faulty" rate="20Hz"><parameter name="way" value="hang"/></component>
    <component name="hold" kind="faulty" rate="20Hz"><parameter name="way" value="hold"/></component>
    <component name="abort" kind="faulty" rate="20Hz"><parameter name="way" value="abort"/></component>
    <component name="segfault" kind="faulty" rate="20Hz"><parameter name="way" value="segfault"/></component>
    <component name="print" kind="faulty" rate="20Hz"><parameter name="way" value="print"/></component>
    <component name="thread" kind="faulty" rate="20Hz"><parameter name="way" value="thread"/></component>
    <component name="exit" kind="faulty" rate="20Hz"><parameter name="way" value="exit"/></component>
    <component name="long" kind="faulty" rate="20Hz"><parameter name="way" value="long"/></component>
    <component name="fork" kind="faulty" rate="20Hz"><parameter name="way" value="fork"/></component>
    <link from="talker.count" to="listener.count" keep="all"/>
    <link from="talker.picture" to="listener.picture" keep="all"/>
  </system>
</armor>
"""

TWO_HOSTS = """<armor version="1">
  <system name="python-hosts">
    <host name="arm" at="127.0.0.1:{port}"/>
    <component name="talker" kind="talker" rate="50Hz"/>
    <component name="reader" kind="{kind}" rate="5Hz" host="arm"/>
  </system>
</armor>
"""

WORLD = HERE.parents[2] / "missions" / "worlds" / "office.svg"
DRIVE = f"""<armor version="1">
  <system name="python-drive">
    <frame name="laser" in="base_link" x="0m" z="0m"/>
    <component name="simulator" kind="simulator" rate="50Hz">
      <parameter name="world" value="{WORLD}"/>
    </component>
    <component name="follower" kind="follower" rate="20Hz">
      <parameter name="distance" value="0.1m"/>
    </component>
    <link from="simulator.scan" to="follower.scan"/>
    <link from="follower.velocity" to="simulator.velocity"/>
  </system>
</armor>
"""


def environment() -> Dict[str, str]:
    """That of these tests, with their Python first and no memory of other runs."""
    here = os.path.dirname(sys.executable)
    path = here + os.pathsep + os.environ.get("PATH", "")
    return {**os.environ, "PATH": path, "ARMOR_NO_CACHE": "1"}


def free_port() -> int:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        port: int = taken.getsockname()[1]
    return port


class TestCommandLine(unittest.TestCase):
    def run_script(self, script: Path, *arguments: str) -> "subprocess.CompletedProcess[str]":
        command = [sys.executable, str(script), *arguments]
        return subprocess.run(command, capture_output=True, text=True, timeout=LIMIT_S)

    def write_script(self, text: str) -> Path:
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        script = Path(folder.name) / "script.py"
        script.write_text(text)
        return script

    def test_only_the_manifest_is_on_stdout(self) -> None:
        described = self.run_script(COMPONENTS / "listener.py", "--describe")
        self.assertEqual((described.returncode, described.stderr), (0, ""))
        self.assertEqual(json.loads(described.stdout)["outputs"][0]["type"], "Tally")

    def test_a_constructor_that_prints_is_named(self) -> None:
        script = self.write_script(
            "import armor\n"
            "class Loud(armor.Component):\n"
            "    'x'\n"
            "    def __init__(self): print('hello')\n"
            "armor.run(Loud)\n"
        )
        described = self.run_script(script, "--describe")
        self.assertEqual((described.returncode, described.stdout), (1, ""))
        self.assertIn("the constructor prints on stdout", described.stderr)

    def test_a_constructor_that_raises_is_named_in_the_last_line(self) -> None:
        script = self.write_script(
            "import armor\n"
            "class Eager(armor.Component):\n"
            "    'x'\n"
            "    def __init__(self): open('/no/such/device')\n"
            "armor.run(Eager)\n"
        )
        described = self.run_script(script, "--describe")
        self.assertEqual(described.returncode, 1)
        last = described.stderr.splitlines()[-1]
        self.assertIn("eager: its constructor failed: FileNotFoundError", last)
        self.assertIn("(script.py, line 4, in __init__)", last)

    def test_help_and_mistakes(self) -> None:
        helped = self.run_script(COMPONENTS / "talker.py", "--help")
        self.assertEqual(helped.returncode, 0)
        self.assertTrue(helped.stdout.startswith("talker: Counts and publishes pictures."))
        wrong = self.run_script(COMPONENTS / "talker.py", "--no-such-option")
        self.assertEqual(wrong.returncode, 2)


class RunningSystem:
    """A system of its own, until the end of the `with` block."""

    def __init__(self, text: str, *folders: Path, arguments: Sequence[str] = ()) -> None:
        self.folder = tempfile.TemporaryDirectory()
        self.out = Path(self.folder.name) / "out"
        file = Path(self.folder.name) / "system.xml"
        file.write_text(text)
        self.name = f"python-{os.getpid()}-{id(self) % 10_000}"
        command = [ARMOR, "run", str(file), "--headless", "--quiet", "--system", self.name]
        command += ["--out", str(self.out), *arguments]
        for folder in folders:
            command += ["--components", str(folder)]
        self.log = Path(self.folder.name) / "run.log"
        with self.log.open("w") as log:
            self.process = subprocess.Popen(command, stdout=log, stderr=log, env=environment())

    def __enter__(self) -> "RunningSystem":
        return self

    def __exit__(self, *error: object) -> None:
        if self.process.poll() is None:
            self.process.kill()
            self.process.wait()
        if any(error):
            print(self.log.read_text()[-4000:], file=sys.stderr)
        self.folder.cleanup()

    def wait_for(self, what: str, condition: Callable[[], Any]) -> Any:
        """What the condition returns, as soon as that is true; it fails early if the run has ended."""
        end = time.monotonic() + LIMIT_S
        while not (found := condition()):
            if time.monotonic() > end or self.process.poll() is not None:
                raise AssertionError(f"this did not happen: {what}")
            time.sleep(0.1)
        return found

    def ask(self, *arguments: str) -> List[Dict[str, Any]]:
        command = [ARMOR, *arguments, "--format", "json", "--system", self.name]
        asked = subprocess.run(
            command, capture_output=True, text=True, timeout=LIMIT_S, env=environment()
        )
        return [json.loads(line) for line in asked.stdout.splitlines()]

    def components(self) -> Dict[str, Dict[str, Any]]:
        return {it["name"]: it for it in self.ask("ps") if it.get("status")}

    def read_log(self, name: str) -> str:
        file = self.out / "logs" / f"{name}.log"
        return file.read_text() if file.exists() else ""

    def end(self) -> int:
        self.process.send_signal(signal.SIGINT)
        return self.process.wait(timeout=LIMIT_S)


@unittest.skipUnless(ARMOR, "the program `armor` is in ARMOR or PATH")
class TestSystems(unittest.TestCase):
    def test_faults_stay_with_their_component(self) -> None:
        with RunningSystem(SYSTEM, COMPONENTS) as system:

            def failed(name: str) -> Callable[[], Any]:
                def is_failed() -> Any:
                    found = system.components().get(name, {})
                    status = found.get("status") or {}
                    return status if status.get("state") == "failed" else None

                return is_failed

            for name, why in [
                ("raise", "RuntimeError: on purpose (faulty.py, line"),
                ("thread", "the thread `worker` has raised RuntimeError: in a thread"),
                ("exit", "SystemExit: 3"),
                ("long", "RuntimeError: so long so long"),
            ]:
                status = system.wait_for(f"{name} fails", failed(name))
                self.assertIn(why, status["last_error"])
            self.assertIn("Traceback (most recent call last)", system.read_log("raise"))
            hanging = system.wait_for("a call of hang is noticed", lambda: self.find_call(system, "hang"))
            # It was alive for longer than a dead process would be taken for one.
            time.sleep(3)
            still = self.find_call(system, "hang")
            self.assertEqual((still["pid"], still["status"]["state"]), (hanging["pid"], "active"))
            # So was one that kept Python's lock: no beat was late, and its process is the first one.
            system.wait_for("hold comes back", lambda: "the lock was held" in system.read_log("hold"))
            hold = system.components()["hold"]["status"]
            self.assertEqual((hold["state"], hold["last_error"]), ("active", ""))
            self.assertNotIn("starts again", system.read_log("hold"))
            for name, error in [("abort", "Aborted"), ("segfault", "Segmentation fault")]:
                system.wait_for(
                    f"{name} is started again",
                    lambda: "starts again" in system.read_log(name),
                )
                self.assertIn(f"Fatal Python error: {error}", system.read_log(name))
                self.assertIn(f"in do_{name}", system.read_log(name))

            def prints_on() -> Any:
                return system.components()["print"]["status"]["exec_calls"] > 10

            def forks() -> Any:
                return "the second fork ended with 1" in system.read_log("fork")

            system.wait_for("the forks end", forks)
            log = system.read_log("fork")
            self.assertIn("the fork: this process is a fork of the component's", log)
            self.assertIn("the fork ended with 7", log)
            self.assertIn("has left `exec` and must not go on as the component", log)
            fork = system.components()["fork"]["status"]
            self.assertEqual((fork["state"], fork["last_error"]), ("active", ""))
            system.wait_for("print has printed 100 MB and goes on", prints_on)
            before = self.tally(system)
            after = system.wait_for("pictures arrive", lambda: self.tally_after(system, before["counts"] + 20))
            self.assertEqual((after["lost"], after["spoilt"]), (0, 0))
            self.assertGreater(after["pictures"], before["pictures"])
            system.end()
            listener = system.read_log("listener")
            self.assertIn("it begins", listener)
            self.assertIn("stopped in order", listener)

    def find_call(self, system: RunningSystem, name: str) -> Any:
        found = system.components().get(name, {})
        return found if (found.get("status") or {}).get("call") else None

    def tally(self, system: RunningSystem) -> Dict[str, int]:
        value: Dict[str, int] = system.ask("echo", "listener.tally", "--once")[0]["value"]
        return value

    def tally_after(self, system: RunningSystem, counts: int) -> Any:
        tally = self.tally(system)
        return tally if tally["counts"] >= counts else None

    def test_a_component_in_python_drives_a_robot_of_rust(self) -> None:
        with tempfile.TemporaryDirectory() as folder:
            shutil.copy(FOLLOWER, folder)
            with RunningSystem(DRIVE, Path(folder)) as system:

                def has_moved() -> Any:
                    seen = system.ask("echo", "simulator.odometry", "--once")
                    twist = seen[0]["value"]["twist"]["twist"] if seen else None
                    return twist and abs(twist["linear"]["x"]) > 0.05

                system.wait_for("the robot moves", has_moved)
                changed = [ARMOR, "param", "set", "follower.speed", "0", "--system", system.name]
                subprocess.run(changed, check=True, capture_output=True, env=environment())

                def stands() -> Any:
                    seen = system.ask("echo", "follower.velocity", "--once")
                    return seen and seen[0]["value"]["linear"]["x"] == 0.0

                system.wait_for("a live parameter arrives", stands)
                system.end()

    def test_the_office_with_a_planner_in_python_drives_home(self) -> None:
        """The example, in simulated time; the page about it promises at most 80 lines."""
        examples = FOLLOWER.parent
        lines = (examples / "planner.py").read_text().splitlines()
        self.assertLessEqual(len(lines), 80)
        text = (examples / "office.xml").read_text()
        world = "../../../missions/worlds/office.svg"
        clock = '<system name="office-in-python">\n    <clock source="simulator.clock"/>'
        speed = f'rate="100Hz">\n      <parameter name="speed" value="3"/>\n      <parameter name="world" value="{WORLD}"/>'
        for before, after in (
            ('<system name="office-in-python">', clock),
            (f'rate="20Hz">\n      <parameter name="world" value="{world}"/>', speed),
        ):
            self.assertEqual(text.count(before), 1, before)
            text = text.replace(before, after)
        with tempfile.TemporaryDirectory() as folder:
            (Path(folder) / "office.xml").write_text(text)
            command = [ARMOR, "run", "office.xml", "--components", str(examples), "--headless", "--quiet"]
            done = subprocess.run(
                [*command, "--system", f"python-office-{os.getpid()}", "--out", "out"],
                cwd=folder,
                capture_output=True,
                text=True,
                timeout=5 * LIMIT_S,
                env=environment(),
            )
        log = done.stdout + done.stderr
        self.assertEqual(done.returncode, 0, log)
        self.assertIn("the mission reached its goal", log)

    @contextmanager
    def run_on_two_hosts(self, folder: Path, kind: str) -> Iterator[Callable[[str], Any]]:
        """A talker here and a reader on the host arm, whose log is searched by what this yields."""
        gate, agent = free_port(), free_port()
        out = folder / f"arm-{kind}"
        command = [ARMOR, "host", "--from", "robot", "--listen", f"127.0.0.1:{agent}"]
        command += ["--keys", str(folder / "arm"), "--out", str(out), "--components", str(COMPONENTS)]
        quiet = subprocess.DEVNULL
        running = subprocess.Popen(command, stdout=quiet, stderr=quiet, env=environment())
        text = TWO_HOSTS.format(port=agent, kind=kind)
        arguments = ["--gate", f"127.0.0.1:{gate}", "--keys", str(folder / "robot")]
        try:
            with RunningSystem(text, COMPONENTS, arguments=arguments) as system:

                def wait_for_log(words: str) -> Any:
                    def find() -> Any:
                        logs = [it.read_text() for it in out.glob("*/logs/reader.log")]
                        return [log for log in logs if words in log]

                    return system.wait_for(f"{words!r} in the log of {kind}", find)

                yield wait_for_log
                system.end()
        finally:
            running.terminate()
            running.wait(timeout=LIMIT_S)

    def test_a_recorder_in_python_reads_all_data_from_another_host(self) -> None:
        """Also what no link leads to it; the same component without `reads_all` is refused."""
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            for words in (["init"], ["add", "robot", "--role", "host"], ["add", "arm", "--role", "host"]):
                made = self.run_armor("keys", *words, "--keys", "authority", cwd=name)
                self.assertEqual(made.returncode, 0, made.stderr)
            for host in ("robot", "arm"):
                (folder / host).mkdir(mode=0o700)
                for file in (f"{host}.key", "revoked"):
                    shutil.copy(folder / "authority" / file, folder / host)
            with self.run_on_two_hosts(folder, "noter") as wait_for_log:
                wait_for_log("noted")
            with self.run_on_two_hosts(folder, "curious") as wait_for_log:
                refused = wait_for_log("is not for the host arm: no link of the file leads it")
            self.assertNotIn("noted", refused[0])

    def run_armor(self, *arguments: str, cwd: str) -> "subprocess.CompletedProcess[str]":
        command = [ARMOR, *arguments]
        return subprocess.run(
            command, capture_output=True, text=True, timeout=LIMIT_S, cwd=cwd, env=environment()
        )

    def test_a_new_project_passes_its_tests_and_the_check(self) -> None:
        with tempfile.TemporaryDirectory() as folder:
            made = self.run_armor("new", "wall-counter", "--python", cwd=folder)
            self.assertEqual(made.returncode, 0, made.stderr)
            project = Path(folder) / "wall-counter"
            tested = subprocess.run(
                [sys.executable, "-m", "unittest"], cwd=project, capture_output=True, text=True
            )
            self.assertEqual(tested.returncode, 0, tested.stderr)
            self.assertIn("Ran 2 tests", tested.stderr)
            # The system of its README, with the script in a component directory.
            text = (project / "README.md").read_text()
            (project / "system.xml").write_text(text.split("<<'XML'\n")[1].split("XML\n")[0])
            (project / "components").mkdir()
            shutil.copy(project / "wall_counter.py", project / "components")
            checked = self.run_armor("check", "system.xml", cwd=str(project))
            self.assertEqual(checked.returncode, 0, checked.stderr)
            again = self.run_armor("new", "random", "--python", cwd=folder)
            self.assertIn("Python has a module", again.stderr)

    def test_a_missing_module_is_a_finding_with_the_remedy(self) -> None:
        with tempfile.TemporaryDirectory() as folder:
            components = Path(folder) / "components"
            components.mkdir()
            script = components / "arm.py"
            script.write_text("#!/usr/bin/env python3\nimport no_such_module\n")
            script.chmod(0o755)
            named = components / "leg.py"
            block = '# /// script\n# dependencies = ["armor", "legs<2"]\n# ///\n'
            named.write_text(f"#!/usr/bin/env python3\n{block}from json import no_such_name\n")
            named.chmod(0o755)
            component = '<component name="a" kind="arm"/>'
            text = f'<armor version="1"><system name="x">{component}</system></armor>'
            (Path(folder) / "system.xml").write_text(text)
            checked = self.run_armor("check", "system.xml", cwd=folder)
            found = " ".join((checked.stdout + checked.stderr).split())
            self.assertIn("W0119", found)
            self.assertIn("has no module `no_such_module`", found)
            self.assertIn("activate the environment", found)
            self.assertIn("has a module `json` without `no_such_name`: another version", found)
            self.assertIn("-m pip install 'legs<2'", found)

    def test_a_script_is_asked_again_when_another_python_runs_it(self) -> None:
        with tempfile.TemporaryDirectory() as folder:
            components = Path(folder) / "components"
            components.mkdir()
            shutil.copy(COMPONENTS / "talker.py", components)
            text = '<armor version="1"><system name="x">{}</system></armor>'
            component = '<component name="a" kind="talker" rate="1Hz"/>'
            (Path(folder) / "system.xml").write_text(text.format(component))
            bare = Path(folder) / "bare"
            bare.mkdir()
            # A Python that knows only its own library.
            (bare / "python3").write_text(f'#!/bin/sh\nexec "{sys.executable}" -S "$@"\n')
            (bare / "python3").chmod(0o755)
            variables = {**environment(), "XDG_CACHE_HOME": str(Path(folder) / "cache")}
            del variables["ARMOR_NO_CACHE"]
            for path, code in [("", 0), (f"{bare}:", 1), ("", 0)]:
                checked = subprocess.run(
                    [ARMOR, "check", "system.xml"],
                    capture_output=True,
                    text=True,
                    cwd=folder,
                    env={**variables, "PATH": path + variables["PATH"]},
                )
                self.assertEqual(checked.returncode, code, checked.stderr)
            self.assertNotIn("W0119", checked.stderr)


if __name__ == "__main__":
    unittest.main()
