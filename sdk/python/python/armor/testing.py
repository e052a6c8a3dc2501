"""Tests of a component without a system: called with time by hand, its outputs and reports read.

    from armor.messages import LaserScan
    from armor.testing import TestedComponent
    from follower import Follower


    def test_it_stops_at_a_wall() -> None:
        follower = TestedComponent(Follower, speed="0.5m/s")
        follower.start()
        follower.send("scan", LaserScan(ranges=[0.1]))
        follower.tick(0.1)
        assert follower.last_output("velocity").linear.x == 0.0

A step in which the component fails raises `armor.TestError` with the reason. No process, socket or
thread is used, so a test takes microseconds.

`python -m armor.testing SCRIPT` does the same from the command line, without a test.
"""

from __future__ import annotations

from typing import Any, Generic, List, NamedTuple, Type, TypeVar, Union

from armor import _armor
from armor._armor import TestError
from armor._component import Component, _Constructor, _Declaration
from armor._message import layout_of

C = TypeVar("C", bound=Component)

#: System time when a component is built.
START_S = 1000.0


class Report(NamedTuple):
    """What a component has reported: `done`, `failed` with the reason in `name`, or an `event`."""

    kind: str
    name: str = ""
    value: float = 0.0


class TestedComponent(Generic[C]):
    """A component under test, frozen until `start`. Parameters are given by name, as in a file
    (`speed="0.5m/s"`) or as values (`speed=0.5`); the others have their defaults.

    Time begins at `START_S` and passes only in `tick` and `pass_time`. Each input counts as fed.
    """

    #: The name is for people, not for pytest.
    __test__ = False

    def __init__(self, of: Type[C], **parameters: Any) -> None:
        declaration, constructor = _Declaration(of), _Constructor(of)
        self._parameters = {declared.name: declared for declared in declaration.parameters}
        given = [(name, self._write(name, value)) for name, value in parameters.items()]
        self._tested = _armor.Tested(declaration, constructor, given)
        instance = constructor.instance
        if instance is None:
            raise TestError("the component was not constructed")
        #: The instance of the component's class.
        self.component: C = instance

    def _write(self, name: str, value: object) -> str:
        declared = self._parameters.get(name)
        return declared.write(value) if declared is not None else str(value)

    def execute_on_data(self) -> None:
        """Calls `exec` after each message from now on, as in a file that gives it no rate."""
        self._tested.execute_on_data()

    def start(self) -> None:
        """Activates it: `exec(Call.STARTED)`."""
        self._tested.start()

    def stop(self) -> None:
        """Freezes it: `exec(Call.STOPPING)`."""
        self._tested.stop()

    def tick(self, after_s: float = 0.1) -> None:
        """Lets time pass, then calls `exec(Call.TICK)`."""
        self._tested.tick_after(after_s)

    def pass_time(self, time_s: float) -> None:
        """Lets time pass without a call."""
        self._tested.pass_time(time_s)

    def timestamp(self) -> float:
        """System time, in seconds."""
        return self._tested.timestamp()

    def link_from(self, input: str, source: str) -> None:
        """Adds a link from the data `source`, `component.output`, to an input that takes several."""
        self._tested.link_from(input, source)

    def send(self, input: str, data: object, *, source: Union[str, None] = None) -> None:
        """Hands a message, created now, to the component."""
        self._tested.send(layout_of(type(data)), input, data, source)

    def set_parameter(self, name: str, value: object) -> None:
        """Changes a live parameter, as an edit of the file does in a running system."""
        self._tested.set_parameter(name, self._write(name, value))

    def outputs(self, output: str) -> List[Any]:
        """All messages that have been published on an output, in order."""
        return self._tested.outputs(output)

    def last_output(self, output: str) -> Any:
        """The message that was published last on an output."""
        published = self.outputs(output)
        if not published:
            failures = [report.name for report in self.reports if report.kind == "failed"]
            why = f": it has failed: {failures[-1]}" if failures else ""
            raise TestError(f"nothing has been published on output `{output}`{why}")
        return published[-1]

    @property
    def reports(self) -> List[Report]:
        """Everything that the component has reported, in order."""
        return [Report(*report) for report in self._tested.reports()]

    @property
    def state(self) -> str:
        """`frozen`, `active`, `done` or `failed`."""
        return self._tested.state()


if __name__ == "__main__":
    import sys

    from armor._trial import main

    sys.exit(main(sys.argv[1:]))
