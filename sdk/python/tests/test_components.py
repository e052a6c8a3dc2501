"""Components under test: the twelve functions, faults, parameters and events."""

from __future__ import annotations

import contextlib
import io
import json
import pathlib
import threading
import unittest
from typing import Any, Dict, List, Optional

import numpy as np

import armor
from armor.messages import Count, Image, Number, Text
from armor.testing import START_S, Report, TestedComponent


class Relay(armor.Component):
    """Passes on what it receives, and the first message again at each tick."""

    def __init__(self) -> None:
        self.subscribe("in", armor.AnyMessage, many=True)
        self.provide("out", armor.AnyMessage)
        self.provide("first", armor.AnyMessage, latched=True)
        self.received: List[armor.AnyMessage] = []
        self.past: List[Any] = []

    def data_received(self, header: armor.Header, data: armor.AnyMessage) -> None:
        self.received.append(data)
        self.past = [past.data for past in self.history("in")]
        self.send_data("out", data)

    def exec(self, call: armor.Call) -> None:
        if call == armor.Call.TICK:
            self.send_data("first", self.received[0] if self.received else Count(count=1))


class Doubler(armor.Component):
    """Doubles numbers.

    More lines are not part of the summary.
    """

    factor = armor.parameter(2.0, range=(0.0, 10.0), live=True, doc="what is multiplied")
    limit = armor.parameter(1, range=(1, 5))
    speed = armor.parameter(0.5, unit="m/s")
    name = armor.parameter("x")
    side = armor.parameter("left", choices=("left", "right"))
    loud = armor.parameter(False)
    route = armor.parameter("1,2 3,4", format="points")
    log = armor.parameter(pathlib.Path("log.txt"), written=True)
    events = [armor.DeclaredEvent("large", "the number is large", value=float, unit="m")]

    def __init__(self) -> None:
        self.provide("whole", Number, doc="twice the half")
        self.subscribe("half", Number)
        self.subscribe("more", Image, optional=True)
        self.at_start = self.factor
        self.calls: List[armor.Call] = []
        self.taken: List[str] = []
        self.images: List[Any] = []
        self.outcome: Any = None

    def data_received(self, header: armor.Header, data: Any) -> None:
        if header.id == "more":
            self.images.append(data)
            return
        self.header = header
        if data.data < 0:
            raise ValueError("no negative numbers")
        self.send_data("whole", Number(data=self.factor * data.data))

    def parameter_received(self, name: str, value: Any) -> None:
        if name == "factor" and value == 7.0:
            raise ValueError("not seven")
        self.taken.append(name)

    def exec(self, call: armor.Call) -> Optional[armor.Outcome]:
        self.calls.append(call)
        return self.outcome if call is armor.Call.TICK or call == armor.Call.TICK else None


def started(**parameters: Any) -> TestedComponent[Doubler]:
    tested = TestedComponent(Doubler, **parameters)
    tested.start()
    return tested


def quiet() -> Any:
    return contextlib.redirect_stderr(io.StringIO())


class TestMessagesOfAnyType(unittest.TestCase):
    def test_they_are_passed_on_at_once_and_later(self) -> None:
        relay = TestedComponent(Relay)
        relay.start()
        self.assertEqual(relay.outputs("out"), [])
        for count in (7, 8):
            relay.send("in", Count(count=count))
        relay.tick()
        self.assertEqual(relay.outputs("out"), [Count(count=7), Count(count=8)])
        self.assertEqual(relay.outputs("first"), [Count(count=7)])
        message = relay.component.received[1]
        self.assertEqual((message.type_name, message.schema), ("Count", armor.schema_of(Count)))
        self.assertEqual((message.stamp_s, len(message)), (START_S, 8))
        self.assertEqual(armor.decode(Count, bytes(message)), Count(count=8))
        self.assertEqual([bytes(past) for past in relay.component.past], [b"\x08" + bytes(7), b"\x07" + bytes(7)])
        with self.assertRaisesRegex(armor.TestError, "is a Number, which input `in` does not take"):
            relay.send("in", Number(data=1.0))

    def test_a_large_one_is_the_same(self) -> None:
        relay = TestedComponent(Relay)
        relay.start()
        image = Image(width=3, height=1, data=np.arange(100_000, dtype=np.uint8))
        relay.send("in", image)
        self.assertEqual(relay.outputs("out"), [image])

    def test_nothing_else_is_sent_there_and_it_is_no_field(self) -> None:
        relay = TestedComponent(Relay)
        relay.start()
        with self.assertRaisesRegex(armor.TestError, "`first` is declared as Any, but a Count is sent"):
            relay.tick()
        with self.assertRaisesRegex(armor.MessageError, "AnyMessage is the type of a port"):

            @armor.message
            class Wrapped:
                inner: armor.AnyMessage

    def test_its_manifest_has_ports_of_any_type(self) -> None:
        manifest = json.loads(armor.describe(Relay))
        ports = [*manifest["inputs"], *manifest["outputs"]]
        self.assertEqual({(port["type"], port["schema"]) for port in ports}, {("Any", "Any{}")})


class TestFunctions(unittest.TestCase):
    def test_data_go_in_and_out(self) -> None:
        tested = started()
        tested.send("half", Number(data=1.5))
        tested.pass_time(2.5)
        tested.send("half", Number(data=4.0))
        self.assertEqual(tested.outputs("whole"), [Number(data=3.0), Number(data=8.0)])
        header = tested.component.header
        self.assertEqual((header.id, header.data, header.sequence), ("half", "test.half", 1))
        self.assertEqual((header.stamp_s, header.lost), (START_S + 2.5, 0))
        self.assertEqual(tested.timestamp(), START_S + 2.5)
        component = tested.component
        self.assertEqual(component.timestamp(), START_S + 2.5)
        self.assertEqual(component.provided_data("whole"), "doubler.whole")
        self.assertEqual(component.subscribed_data("half"), "test.half")
        self.assertIsNone(component.provided_data("other"))

    def test_calls_and_states(self) -> None:
        tested = TestedComponent(Doubler)
        self.assertEqual(tested.state, "frozen")
        tested.start()
        tested.tick()
        tested.execute_on_data()
        tested.send("half", Number(data=1.0))
        tested.stop()
        calls = [armor.Call.STARTED, armor.Call.TICK, armor.Call.DATA, armor.Call.STOPPING]
        self.assertEqual(tested.component.calls, calls)
        self.assertEqual((tested.state, tested.reports), ("frozen", []))
        with self.assertRaisesRegex(armor.TestError, "it is frozen; start it first"):
            tested.tick()

    def test_parameters_have_their_values_in_the_constructor(self) -> None:
        component = started(factor=3.0, limit=4, speed="36km/h", side="right", loud=True).component
        self.assertEqual((component.at_start, component.limit), (3.0, 4))
        self.assertEqual((component.speed, component.side, component.loud), (10.0, "right", True))
        self.assertEqual(component.route, [(1.0, 2.0), (3.0, 4.0)])
        self.assertIsInstance(component.log, pathlib.Path)
        self.assertEqual(len(component.taken), 8)
        for wrong, why in [
            ({"factor": 11.0}, "out of range, 0 to 10"),
            ({"limit": 1.5}, "not a whole number"),
            ({"side": "up"}, "none of left, right"),
            ({"volume": 1}, "volume"),
        ]:
            with self.assertRaisesRegex(armor.TestError, why):
                TestedComponent(Doubler, **wrong)

    def test_a_live_parameter_changes_and_a_refused_value_leaves_the_last_one(self) -> None:
        tested = started()
        tested.set_parameter("factor", 5.0)
        self.assertEqual(tested.component.factor, 5.0)
        with quiet(), self.assertRaisesRegex(armor.TestError, "ValueError: not seven"):
            tested.set_parameter("factor", 7.0)
        self.assertEqual((tested.component.factor, tested.state), (5.0, "active"))
        with self.assertRaisesRegex(armor.TestError, "not live"):
            tested.set_parameter("limit", 2)

    def test_an_exception_is_a_failure_with_its_line_and_its_traceback(self) -> None:
        tested = started()
        log = io.StringIO()
        with contextlib.redirect_stderr(log), self.assertRaises(armor.TestError) as raised:
            tested.send("half", Number(data=-1.0))
        text = str(raised.exception)
        self.assertRegex(
            text,
            r"`doubler` has failed: ValueError: no negative numbers \(test_components.py, line \d+, "
            r"in data_received\)",
        )
        self.assertIn("Traceback (most recent call last)", log.getvalue())
        self.assertEqual((tested.state, tested.reports[0].kind), ("failed", "failed"))
        with self.assertRaisesRegex(armor.TestError, "it has failed: ValueError"):
            tested.tick()

    def test_outcomes(self) -> None:
        tested = started()
        tested.component.outcome = armor.event("large", 7.5)
        tested.tick()
        self.assertEqual(tested.reports, [Report("event", "large", 7.5)])
        tested.component.outcome = armor.CARRY_ON
        tested.tick()
        self.assertEqual(len(tested.reports), 1)
        tested.component.outcome = armor.DONE
        tested.tick()
        self.assertEqual((tested.reports[-1], tested.state), (Report("done"), "done"))
        for outcome, why in [
            (armor.failed("no way"), "no way"),
            (armor.event("small"), "`small` is not declared, only: large; add armor.DeclaredEvent"),
            (7, "exec returned a value of type int"),
        ]:
            tested = started()
            tested.component.outcome = outcome
            with quiet(), self.assertRaisesRegex(armor.TestError, why):
                tested.tick()

    def test_sending_what_is_not_declared_is_an_error_with_the_remedy(self) -> None:
        component = started().component
        handle = component
        with self.assertRaisesRegex(TypeError, "declared as Number, but a Text is sent"):
            handle.send_data("whole", Text(data="x"))
        with self.assertRaises(armor.MessageError):
            handle.send_data("whole", Number(data="x"))  # type: ignore[arg-type]
        tested = started()
        tested.component.exec = lambda call: tested.component.send_data("hole", Number())  # type: ignore
        with self.assertRaisesRegex(armor.SendError, "no output `hole`, only: whole; correct"):
            tested.component.send_data("hole", Number())
        with self.assertRaisesRegex(armor.DeclareError, "declare all ports in `__init__`"):
            component.provide("late", Number)

    def test_received_arrays_are_kept_without_a_copy(self) -> None:
        tested = started()
        for value in (1, 2):
            tested.send("more", Image(data=np.full(100_000, value, np.uint8)))
        first, second = tested.component.images
        self.assertEqual((first.data.max(), second.data.min()), (1, 2))
        self.assertFalse(first.data.flags.writeable or first.data.flags.owndata)

    def test_a_thread_that_raises_is_a_failure(self) -> None:
        tested = started()
        component = tested.component
        component._handle.report_thread_failure("the thread `x` has raised ValueError: y")
        with self.assertRaisesRegex(armor.TestError, "the thread `x` has raised"):
            tested.tick()

    def test_only_the_thread_of_a_call_may_publish_while_frozen(self) -> None:
        tested = TestedComponent(Doubler)
        refused: List[BaseException] = []

        def publish() -> None:
            try:
                tested.component.send_data("whole", Number())
            except armor.SendError as error:
                refused.append(error)

        thread = threading.Thread(target=publish)
        thread.start()
        thread.join()
        self.assertIn("not active", str(refused[0]))


class TestManifest(unittest.TestCase):
    def test_it_reads_all_if_its_class_states_so(self) -> None:
        class Recorder(armor.Component):
            """Records."""

            reads_all = True

        self.assertTrue(json.loads(armor.describe(Recorder))["reads_all"])
        self.assertFalse(json.loads(armor.describe(Doubler)).get("reads_all", False))

    def test_it_has_all_that_is_declared(self) -> None:
        manifest = json.loads(armor.describe(Doubler))
        self.assertEqual((manifest["kind"], manifest["summary"]), ("doubler", "Doubles numbers."))
        whole = manifest["outputs"][0]
        self.assertEqual((whole["id"], whole["type"], whole["doc"]), ("whole", "Number", "twice the half"))
        self.assertEqual([it["required"] for it in manifest["inputs"]], [True, False])
        types = {it["name"]: (it["type"], it["default"]) for it in manifest["parameters"]}
        self.assertEqual(
            types,
            {
                "factor": ("number", "2.0"),
                "limit": ("integer", "1"),
                "speed": ("number", "0.5m/s"),
                "name": ("text", "x"),
                "side": ("choice", "left"),
                "loud": ("flag", "false"),
                "route": ("text", "1,2 3,4"),
                "log": ("path", "log.txt"),
            },
        )
        self.assertEqual(manifest["events"][0]["unit"], "m")

    def test_the_name_of_a_class_is_that_of_its_kind(self) -> None:
        class WallFollower2D(armor.Component):
            """x"""

        self.assertEqual(json.loads(armor.describe(WallFollower2D))["kind"], "wall-follower2-d")

    def test_a_failure_has_a_reason_and_late_decisions_are_refused(self) -> None:
        class Silent(armor.Component):
            """x"""

            def exec(self, call: armor.Call) -> Optional[armor.Outcome]:
                return armor.failed("")

        with self.assertRaisesRegex(armor.TestError, "gives no reason"):
            TestedComponent(Silent).start()

        class Late(armor.Component):
            """x"""

            def exec(self, call: armor.Call) -> None:
                self.set_non_controllable()

        with quiet(), self.assertRaisesRegex(armor.TestError, "DeclareError.*call it in `__init__`"):
            TestedComponent(Late).start()

    def test_faults_of_a_class_are_named_with_the_remedy(self) -> None:
        class Twice(armor.Component):
            """x"""

            def __init__(self) -> None:
                self.provide("light", Count)
                self.provide("light", Count)

        class Eager(armor.Component):
            """x"""

            def __init__(self) -> None:
                open("/no/such/device")

        class Odd(armor.Component):
            """x"""

            speed = armor.parameter(0.5, unit="furlong")

        for cls, why in [
            (Twice, "the port `light` is declared twice"),
            (Eager, "FileNotFoundError.*`__init__` runs for --describe too and opens no hardware"),
            (Odd, "no unit called `furlong`"),
        ]:
            with quiet(), self.assertRaisesRegex(armor.ArmorError, why):
                armor.describe(cls)
        # What could not run is refused in a test, too.
        for name, why in [("a b", "`a b` is not a name"), ("done", "reports of their own")]:
            named = type("Named", (armor.Component,), {"events": [armor.DeclaredEvent(name)]})
            with self.assertRaisesRegex(armor.TestError, why):
                TestedComponent(named)
        with self.assertRaisesRegex(TypeError, "is not a class of components"):
            armor.describe(int)  # type: ignore[type-var]
        with self.assertRaisesRegex(TypeError, "a parameter has a default or a type"):
            armor.parameter()


class TestRefusals(unittest.TestCase):
    """What would fail only in a call, or would have no effect, is refused with the class."""

    def refused(self, body: Dict[str, Any], *parts: str) -> None:
        with self.assertRaises(TypeError) as caught:
            armor.describe(type("Wrong", (armor.Component,), body))
        for part in parts:
            self.assertIn(part, str(caught.exception))

    def test_functions_that_take_other_arguments(self) -> None:
        async def late(self: Any, call: Any) -> None:
            pass

        self.refused({"exec": lambda self: None}, "def exec(self, call)")
        self.refused({"exec": late}, "async")
        self.refused({"data_received": lambda self, data: None}, "(self, header, data)")
        self.refused({"parameter_received": lambda self: None}, "(self, name, value)")
        armor.describe(type("Right", (armor.Component,), {"exec": lambda self, *_: None}))

    def test_a_list_without_its_form(self) -> None:
        with self.assertRaisesRegex(TypeError, 'format="numbers"'):
            armor.parameter([1, 2])

    def test_attributes_of_another_type(self) -> None:
        self.refused({"events": ["near"]}, "'near'", "armor.DeclaredEvent(")
        self.refused({"needs_rate": "yes"}, "needs_rate = True")
        self.refused({"reads_all": 1}, "reads_all = True")
        self.refused({"stale_after": {"scan": 1.0}}, '{"velocity": "0.5s"}')
        self.refused({"provide": armor.parameter(1)}, "`provide`", "another one")

    def test_a_call_of_the_class_is_refused_with_what_to_do(self) -> None:
        with self.assertRaisesRegex(armor.ArmorError, "armor.testing.TestedComponent"):
            Doubler()

    def test_ranges_and_choices_that_cannot_be_meant(self) -> None:
        for wrong in ({"range": (0, 1, 2)}, {"range": 3}):
            with self.assertRaisesRegex(TypeError, "the smallest and the largest"):
                armor.parameter(0.5, **wrong)  # type: ignore[call-overload]
        with self.assertRaisesRegex(ValueError, "is larger than the largest"):
            armor.parameter(0.5, range=(1, 0))
        with self.assertRaisesRegex(TypeError, "a range is for numbers"):
            armor.parameter("left", range=(0, 1))
        with self.assertRaisesRegex(TypeError, "choices are several texts"):
            armor.parameter("left", choices="left")  # type: ignore[arg-type]

    def test_a_reading_of_no_messages_or_of_no_time_is_refused(self) -> None:
        from armor._observe import _check_reading

        _check_reading(None, None, 1)
        _check_reading(0, 0.0, 65536)
        for count, timeout, keep, why in [
            (-1, None, 1, "count is the number of messages"),
            ("a", None, 1, "count is the number of messages"),
            (None, -1.0, 1, "timeout is a time in seconds"),
            (None, float("nan"), 1, "timeout is a time in seconds"),
            (None, None, 0, "keep is 1 to 65536 messages"),
            (None, None, 10**12, "keep is 1 to 65536 messages"),
        ]:
            with self.assertRaisesRegex(ValueError, why):
                _check_reading(count, timeout, keep)  # type: ignore[arg-type]

    def test_numbers_of_numpy_are_numbers(self) -> None:
        class Numpy(armor.Component):
            """x"""

            speed = armor.parameter(np.float32(0.5), unit="m/s")
            count = armor.parameter(np.int64(3))
            route = armor.parameter(np.array([[1.0, 2.0]]), format="points")
            weights = armor.parameter([np.float64(0.25)], format="numbers")

        tested = TestedComponent(Numpy, route=[[1, 2], [3, 4]], weights=np.array([0.5, 1.0]))
        component = tested.component
        self.assertEqual((component.speed, component.count), (0.5, 3))
        self.assertEqual(component.route, [(1.0, 2.0), (3.0, 4.0)])
        self.assertEqual(component.weights, [0.5, 1.0])

    def test_a_parameter_without_a_default_has_a_value_in_a_description(self) -> None:
        class Needs(armor.Component):
            length = armor.parameter(type=float, unit="m", range=(0.5, 2.0))
            count = armor.parameter(type=int)
            route = armor.parameter(type=str, format="points")
            side = armor.parameter(type=str, choices=("left", "right"))

            def __init__(self) -> None:
                self.twice = self.length * 2 + self.count
                self.first = [*self.route, self.side][0]

        parameters = json.loads(armor.describe(Needs))["parameters"]
        self.assertTrue(all("default" not in it for it in parameters), parameters)
        given = {"length": "1m", "count": "3", "route": "1,2", "side": "right"}
        self.assertEqual(TestedComponent(Needs, **given).component.twice, 5.0)

    def test_an_exception_of_the_library_names_the_line_of_the_component(self) -> None:
        class Sends(armor.Component):
            def __init__(self) -> None:
                self.provide("text", Text)

            def exec(self, call: armor.Call) -> None:
                self.send_data("text", Text(data=3))  # type: ignore[arg-type]

        with contextlib.redirect_stderr(io.StringIO()), self.assertRaises(armor.ArmorError) as caught:
            TestedComponent(Sends).start()
        self.assertIn("test_components.py, line", str(caught.exception))


class Stepper(armor.Component):
    """Reads a history."""

    def __init__(self) -> None:
        self.subscribe("steps", Count)
        self.subscribe("other", Count)
        self.seen: List[List[int]] = []

    def data_received(self, header: armor.Header, data: Count) -> None:
        self.seen.append([past.data.count for past in self.history("steps")])


class TestHistory(unittest.TestCase):
    def setUp(self) -> None:
        self.stepper = TestedComponent(Stepper)
        self.stepper.start()
        for count in (1, 2, 3):
            self.stepper.send("steps", Count(count=count))
            self.stepper.pass_time(1.0)

    def test_the_newest_message_is_the_first_and_is_the_one_that_is_received(self) -> None:
        self.assertEqual(self.stepper.component.seen, [[1], [2, 1], [3, 2, 1]])
        history = self.stepper.component.history("steps")
        self.assertEqual(len(history), 3)
        self.assertEqual([past.header.sequence for past in history], [2, 1, 0])
        self.assertEqual(history[-1].data.count, 1)
        self.assertFalse(history[0].follows_gap)
        with self.assertRaises(IndexError):
            history[3]

    def test_a_time_finds_the_nearest_message_and_those_around_it(self) -> None:
        history = self.stepper.component.history("steps")
        nearest = history.nearest(1000.9)
        self.assertEqual(nearest and nearest.data.count, 2)
        for stamp_s, counts in ((1000.5, [1, 2]), (1001.0, [2, 2]), (999.0, None), (1003.0, None)):
            around = history.around(stamp_s)
            self.assertEqual(around and [past.data.count for past in around], counts, stamp_s)

    def test_an_activation_forgets_the_history_and_a_wrong_input_is_named(self) -> None:
        self.stepper.stop()
        self.stepper.start()
        self.assertEqual(len(self.stepper.component.history("steps")), 0)
        self.assertIsNone(self.stepper.component.history("other").nearest(1000.0))
        with self.assertRaisesRegex(armor.ArmorError, "no input `step`.*steps, other"):
            self.stepper.component.history("step")


if __name__ == "__main__":
    unittest.main()
