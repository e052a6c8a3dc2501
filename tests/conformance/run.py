"""One table of behaviours, run against components in all languages: behaviours.json, and a system of
probes that do the same in Rust, Python, C and C++.

    python3 run.py --armor ARMOR --source EXECUTABLE --probe LANGUAGE=EXECUTABLE… [--path FOLDER]

A behaviour that a language does not show is a failure, unless the table states why it cannot.
`--document FILE` compares the table in the documentation; with `ARMOR_BLESS=1` it is written.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any, Dict, List, Optional

HERE = Path(__file__).parent
BEHAVIOURS: List[Dict[str, Any]] = json.loads((HERE / "behaviours.json").read_text())
LANGUAGES = {"rust": "Rust", "python": "Python", "c": "C", "cpp": "C++"}
BEGIN, END = "<!-- begin behaviours -->\n", "<!-- end behaviours -->\n"
#: Only a hang takes longer.
LIMIT_S = 30.0


class Run:
    """The systems of one language."""

    def __init__(self, armor: Path, source: Path, language: str, probe: Path, path: str) -> None:
        self.armor, self.language = armor, language
        self.folder = Path(tempfile.mkdtemp(prefix=f"conformance-{language}-"))
        components = self.folder / "components"
        components.mkdir()
        shutil.copy(source, components / "conformance-source")
        shutil.copy(probe, components / ("probe.py" if probe.suffix == ".py" else "probe"))
        for file in ("system.xml", "mission.xml", "constructors.xml"):
            shutil.copy(HERE / file, self.folder / file)
        (self.folder / "folder").mkdir()
        self.system = f"conformance-{language}-{os.getpid()}"
        self.environment = {**os.environ, "PATH": path + os.pathsep + os.environ["PATH"]}
        self.environment["ARMOR_NO_CACHE"] = "1"
        self.commands: Dict[str, str] = {}
        self.manifest = json.loads(self.execute("describe", "probe", "--format", "json"))

    def execute(self, *arguments: str) -> str:
        """Runs a command to its end; returns what it prints."""
        command = [str(self.armor), *arguments]
        done = subprocess.run(
            command, cwd=self.folder, env=self.environment, capture_output=True, text=True, timeout=LIMIT_S
        )
        return done.stdout + done.stderr

    def read_log(self, component: str) -> str:
        for out in ("system", "mission", "constructors"):
            log = self.folder / out / "logs" / f"{component}.log"
            if log.exists():
                return log.read_text(errors="replace")
        return ""

    def run_constructors(self) -> None:
        name = self.system + "-constructors"
        command = ["run", "constructors.xml", "--headless", "--quiet", "--system", name]
        self.execute(*command, "--for", "20s", "--out", "constructors")

    def start_run(self, file: str, name: str) -> "subprocess.Popen[bytes]":
        command = [str(self.armor), "run", f"{file}.xml", "--headless", "--quiet", "--system", name]
        with (self.folder / f"{file}.txt").open("w") as log:
            return subprocess.Popen(
                [*command, "--out", file], cwd=self.folder, env=self.environment, stdout=log, stderr=log
            )

    def run_systems(self) -> None:
        """One without a mission, which a failing component would end, and one with."""
        running = [self.start_run("system", self.system), self.start_run("mission", self.system + "-mission")]
        try:
            self.await_text("live", "seen: call started", running[0])
            self.give_orders()
            deadline = time.monotonic() + LIMIT_S
            while time.monotonic() < deadline and all(run.poll() is None for run in running):
                self.commands["journal"] = self.execute("mission", "journal", "mission")
                self.commands["status"] = self.execute("ps", "--system", self.system)
                self.commands["graph"] = self.execute("graph", "slow", "--system", self.system, "--format", "json")
                # What ends a run is shown only after it.
                waits = [row for row in BEHAVIOURS if "last" not in row["name"]]
                if all(self.explain_missing(row) is None for row in waits):
                    break
                time.sleep(0.5)
        finally:
            for run in running:
                run.send_signal(signal.SIGINT)
            for run in running:
                run.wait(LIMIT_S)

    def give_orders(self) -> None:
        """What the behaviours of `live`, `restarted` and `stopped` are shown by."""

        def set_parameter(name: str, value: str) -> str:
            return self.execute("param", "set", name, value, "--system", self.system)

        set_parameter("live.number", "0.7m/s")
        self.await_text("live", "seen: parameter number=0.7", None)
        self.commands["refused"] = set_parameter("live.number", "0.9m/s")
        self.commands["range"] = set_parameter("live.number", "3m/s")
        set_parameter("live.whole", "8")
        self.execute("restart", "restarted", "--system", self.system)
        self.execute("stop", "stopped", "--system", self.system)

    def await_text(self, component: str, text: str, running: Optional["subprocess.Popen[bytes]"]) -> None:
        deadline = time.monotonic() + LIMIT_S
        while text not in self.read_log(component) and time.monotonic() < deadline:
            if running is not None and running.poll() is not None:
                raise SystemExit((self.folder / "system.txt").read_text())
            time.sleep(0.1)

    def read_shown(self, component: str) -> str:
        """The log of a component, or what a command of the test has printed."""
        is_command = component.startswith("COMMAND ")
        return self.commands.get(component[8:], "") if is_command else self.read_log(component)

    def explain_failure(self, row: Dict[str, Any]) -> Optional[str]:
        """Why a behaviour is not as the table states; None if it is."""
        for unexpected in row.get("absent", []):
            if re.search(unexpected, self.read_shown(row["component"]), re.MULTILINE):
                return f"`{unexpected}` is in what {row['component']} shows"
        return self.explain_missing(row)

    def explain_missing(self, row: Dict[str, Any]) -> Optional[str]:
        """What of a behaviour has not been seen yet."""
        if "manifest" in row:
            return None
        component, at = row["component"], 0
        text = self.read_shown(component)
        for expected in row["seen"]:
            if expected.split(" ")[0] in CHECKS:
                why = CHECKS[expected.split(" ")[0]](text, *expected.split(" ")[1:])
                if why is not None:
                    return why
                continue
            found = re.compile(expected, re.MULTILINE).search(text, at)
            if found is None:
                return f"`{expected}` is not in what {component} shows"
            at = found.end()
        return None


def read_counts(text: str, port: str) -> List[int]:
    return [int(count) for count in re.findall(rf"seen: data {port} count=(\d+)", text)]


def check_order(text: str, port: str, least: str) -> Optional[str]:
    counts = read_counts(text, port)
    if len(counts) < int(least):
        return f"only {len(counts)} messages have arrived"
    steps = {later - earlier for earlier, later in zip(counts, counts[1:])}
    lost = re.search(rf"seen: data {port} .*lost=[1-9]", text)
    return None if steps == {1} and lost is None else f"the messages are {counts}"


def check_gap(text: str, port: str, least: str) -> Optional[str]:
    counts = read_counts(text, port)
    gaps = [later - earlier for earlier, later in zip(counts, counts[1:])]
    return None if gaps and max(gaps) >= int(least) else f"the messages are {counts}"


def check_sources(text: str, port: str, *sources: str) -> Optional[str]:
    for source in sources:
        if re.search(rf"seen: data {port} .*from={re.escape(source)}$", text, re.MULTILINE) is None:
            return f"nothing has arrived from {source}"
    return None


CHECKS = {"ORDERED": check_order, "GAP": check_gap, "SOURCES": check_sources}


def compare_manifests(row: Dict[str, Any], runs: Dict[str, Run]) -> Dict[str, Optional[str]]:
    """The manifests of all languages are the same, but for the texts of ports."""

    def part(run: Run) -> Any:
        keys = row["manifest"].split(" ")
        return json.dumps([run.manifest.get(key) for key in keys], sort_keys=True)

    reference = part(runs["rust"])
    found = {language: part(run) for language, run in runs.items()}
    return {it: None if text == reference else f"{text} is not {reference}" for it, text in found.items()}


def format_table() -> str:
    lines = ["| behaviour | what is done | |\n", "| --- | --- | --- |\n"]
    for row in BEHAVIOURS:
        missing = row.get("unavailable", {})
        reasons = "; ".join(f"not in {LANGUAGES[it]}: {why}" for it, why in missing.items())
        lines.append(f"| {row['name']} | {row['done']} | {reasons or 'in all'} |\n")
    return "".join(lines)


def check_document(path: Path) -> bool:
    page = path.read_text()
    before, rest = page.split(BEGIN)
    after = rest.split(END)[1]
    expected = before + BEGIN + format_table() + END + after
    if os.environ.get("ARMOR_BLESS"):
        path.write_text(expected)
        return True
    if page != expected:
        print(f"{path}: its table is not that of behaviours.json; ARMOR_BLESS=1 writes it", file=sys.stderr)
    return page == expected


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--armor", type=Path)
    parser.add_argument("--source", type=Path)
    parser.add_argument("--probe", action="append", default=[], metavar="LANGUAGE=EXECUTABLE")
    parser.add_argument("--path", default="", help="folder that is first in PATH, for `python3`")
    parser.add_argument("--document", type=Path)
    parser.add_argument("--keep", action="store_true", help="the folders of the runs stay")
    arguments = parser.parse_args()
    is_right = arguments.document is None or check_document(arguments.document)
    probes = dict(it.split("=", 1) for it in arguments.probe)
    if not probes:
        return 0 if is_right else 1
    runs: Dict[str, Run] = {}
    for language, probe in probes.items():
        armor, source = arguments.armor.resolve(), arguments.source.resolve()
        run = runs[language] = Run(armor, source, language, Path(probe).resolve(), arguments.path)
        start = time.monotonic()
        run.run_constructors()
        run.run_systems()
        print(f"{LANGUAGES[language]}: {time.monotonic() - start:.1f} s", flush=True)
    failures = 0
    for row in BEHAVIOURS:
        if "manifest" in row:
            results = compare_manifests(row, runs)
        else:
            results = {language: run.explain_failure(row) for language, run in runs.items()}
        for language, why in results.items():
            reason = row.get("unavailable", {}).get(language)
            if why is not None and reason is None:
                failures += 1
                print(f"{row['name']}: {LANGUAGES[language]}: {why}")
            elif why is None and reason is not None:
                failures += 1
                print(f"{row['name']}: {LANGUAGES[language]}: it is there, though the table states: {reason}")
    for run in runs.values():
        (run.folder / "commands.json").write_text(json.dumps(run.commands, indent=2))
    if not arguments.keep:
        for run in runs.values():
            shutil.rmtree(run.folder, ignore_errors=True)
    print(f"{len(BEHAVIOURS)} behaviours in {len(runs)} languages, {failures} not as in the table")
    return 0 if failures == 0 and is_right else 1


if __name__ == "__main__":
    sys.exit(main())
