"""What `python -m armor.testing` does: a component of a script, called step by step without a system."""

from __future__ import annotations

import importlib.util
import json
import sys
from pathlib import Path
from typing import Any, Dict, List, Sequence, Type

import armor.messages
from armor._armor import TestError
from armor._component import Component, describe
from armor.testing import START_S, TestedComponent

USAGE = """usage: python -m armor.testing SCRIPT [PARAMETER=VALUE]... [STEP]...

Runs the component of a script in this process, without a system, and prints what it publishes and reports.
A step is one of
  SECONDS          so much time passes, then exec(Call.TICK) is called
  INPUT=MESSAGE    a message arrives, written in Python, such as scan='LaserScan(ranges=[0.4])'
  PARAMETER=VALUE  a live parameter changes; before the first other step: its value at the start
It is activated before the first step and frozen after the last one. The names in MESSAGE are those of the
script and of armor.messages. Ends with 1 if the component fails or a step is refused, with 2 on a mistake here.
"""


class _Mistake(Exception):
    """Of the command line."""


def main(arguments: Sequence[str]) -> int:
    if not arguments or arguments[0] in ("-h", "--help"):
        print(USAGE, end="", file=sys.stdout if arguments else sys.stderr)
        return 0 if arguments else 2
    try:
        return _run(Path(arguments[0]), list(arguments[1:]))
    except _Mistake as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    except (TestError, armor.ArmorError) as error:
        print(f"error: {error}", file=sys.stderr)
        return 1


def _run(script: Path, words: List[str]) -> int:
    names = _load(script)
    of = _find_component(script, names)
    manifest = json.loads(describe(of))
    parameters = {declared["name"] for declared in manifest["parameters"]}
    inputs = [port["id"] for port in manifest["inputs"]]
    given: Dict[str, Any] = {}
    while words and words[0].partition("=")[0] in parameters and "=" in words[0]:
        name, _, value = words.pop(0).partition("=")
        given[name] = value
    tested = TestedComponent(of, **given)
    printed: Dict[str, int] = {}
    outputs = [port["id"] for port in manifest["outputs"]]
    steps = [_read_step(word, parameters, inputs, names) for word in words]
    try:
        tested.start()
        _print_new(tested, outputs, printed)
        for step in steps:
            step(tested)
            _print_new(tested, outputs, printed)
        tested.stop()
    finally:
        _print_new(tested, outputs, printed)
    return 0


def _load(script: Path) -> Dict[str, Any]:
    """The names of a script, which is run as a module: it does not call `armor.run`."""
    spec = importlib.util.spec_from_file_location(script.stem, script)
    if spec is None or spec.loader is None or not script.is_file():
        raise _Mistake(f"{script} is no script of Python; name the file of the component")
    module = importlib.util.module_from_spec(spec)
    sys.modules[script.stem] = module
    sys.path.insert(0, str(script.parent))
    spec.loader.exec_module(module)
    return vars(module)


def _find_component(script: Path, names: Dict[str, Any]) -> Type[Component]:
    of = [
        it
        for it in names.values()
        if isinstance(it, type) and issubclass(it, Component) and it.__module__ == script.stem
    ]
    if len(of) != 1:
        found = ", ".join(it.__name__ for it in of) or "none"
        raise _Mistake(f"{script} has to have one class of armor.Component; it has {found}")
    return of[0]


def _read_step(word: str, parameters: Any, inputs: List[str], names: Dict[str, Any]) -> Any:
    name, equals, value = word.partition("=")
    if not equals:
        try:
            seconds = float(word)
        except ValueError:
            raise _Mistake(f"`{word}` is no step: give SECONDS, INPUT=MESSAGE or PARAMETER=VALUE") from None
        return lambda tested: tested.tick(seconds)
    if name in parameters:
        return lambda tested: tested.set_parameter(name, value)
    if name not in inputs:
        known = ", ".join([*inputs, *sorted(parameters)]) or "none"
        raise _Mistake(f"`{name}` is neither an input nor a parameter (there are: {known})")
    try:
        # The reader of the command line wrote it, as they wrote the script.
        message = eval(value, {**vars(armor.messages), **names})
    except Exception as error:
        raise _Mistake(f"{name}: {value}: {type(error).__name__}: {error}") from None
    return lambda tested: tested.send(name, message)


def _print_new(tested: "TestedComponent[Any]", outputs: List[str], printed: Dict[str, int]) -> None:
    """Prints what has been published and reported since the last time."""
    now = f"{tested.timestamp() - START_S:8.3f} s"
    for output in outputs:
        published = tested.outputs(output)
        for message in published[printed.get(output, 0) :]:
            print(f"{now}  {output}  {message!r}")
        printed[output] = len(published)
    for kind, name, value in tested.reports[printed.get("", 0) :]:
        shown = {"event": f"event {name} {value}", "failed": f"failed: {name}"}.get(kind, kind)
        print(f"{now}  reports {shown}")
    printed[""] = len(tested.reports)
