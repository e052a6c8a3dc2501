"""What a component's class consists of, and how it becomes a process."""

from __future__ import annotations

import math
import os
import re
import sys
from typing import Any, Dict, Generic, List, NoReturn, Optional, Tuple, Type, TypeVar, Union

from armor import _armor
from armor._armor import Call, Header, History, Outcome
from armor._message import layout_of
from armor._parameter import Parameter

C = TypeVar("C", bound="Component")

#: Nothing to report; as `None`.
CARRY_ON: Outcome = Outcome.carry_on()
#: The task is over; no more calls in this activation, except `Call.STOPPING`.
DONE: Outcome = Outcome.done()


def failed(reason: str) -> Outcome:
    """The task cannot be done, and why; no more calls in this activation, except `Call.STOPPING`."""
    return Outcome.failed(reason)


def event(name: str, value: float = 1.0) -> Outcome:
    """Something happened that the mission may wait for: `on="component.name"`."""
    return Outcome.event(name, value)


class DeclaredEvent:
    """An event that a component reports; in the list `events` of its class.

    `value`: `float` or `int` if its value has a meaning, with its `unit`. `named_by`: the words of
    that text parameter are the names of such events.
    """

    __slots__ = ("doc", "name", "named_by", "unit", "value")

    def __init__(
        self,
        name: str,
        doc: str = "",
        *,
        value: Optional[Type[Union[int, float]]] = None,
        unit: str = "",
        named_by: str = "",
    ) -> None:
        words = {None: None, float: "number", int: "integer"}
        if value not in words:
            raise TypeError(f"event `{name}`: its value is float or int, not {value!r}")
        self.name, self.doc, self.unit, self.named_by = name, doc, unit, named_by
        self.value = words[value] or ("number" if unit else None)


class _NoHandle:
    """In the place of the handle of a component that has none: each function is refused with the reason."""

    def __init__(self, why: str) -> None:
        self.__dict__["why"] = why

    def __getattr__(self, name: str) -> NoReturn:
        raise _armor.ArmorError(self.__dict__["why"])


class Component:
    """One task, in one process.

    `exec`, `data_received` and `parameter_received` never run at the same time: no locks are needed.
    A frozen component gets no calls at all. An exception is a failure of the component, which its
    report names; the traceback goes to the log.

    `__init__` declares the ports. It runs for `--describe` too, so it opens no hardware or files: `exec`
    does, at `Call.STARTED`. The parameters have their values in it already.
    """

    #: Name of this kind of component; if empty, the name of the class, as `wall-follower`.
    kind: str = ""
    #: What it does, in one line; if empty, the first line of the class's docstring.
    summary: str = ""
    #: The events that it reports.
    events: List[DeclaredEvent] = []
    #: Whether it ever reports `armor.DONE`.
    reports_done: bool = True
    #: Whether its task comes to an end by itself.
    ends_by_itself: bool = False
    #: Whether it does nothing without a rate.
    needs_rate: bool = False
    #: Whether it reads data of the system to which no link leads, as a recorder does. Where the file places
    #: such a component on another host, that host may read all data.
    reads_all: bool = False
    #: Groups of inputs and parameters of which one must be fed or given.
    needs_one_of: List[List[str]] = []
    #: Inputs, and the age from which on it takes their data for missing: `{"velocity": "0.5s"}`.
    stale_after: Dict[str, str] = {}
    #: Ports whose data are taken in a frame, and the parameter that names it.
    frames: Dict[str, str] = {}

    _handle: _armor.Handle = _NoHandle(  # type: ignore[assignment]
        "a component is not made by a call of its class: armor.run(Follower) runs it, and in a test "
        "armor.testing.TestedComponent(Follower) has it as `component`"
    )

    def provide(self, id: str, message: type, *, latched: bool = False, doc: str = "") -> None:
        """Declares an output; only in `__init__`. `latched`: a late subscriber gets the last message."""
        self._handle.provide(id, layout_of(message), latched, doc)

    def subscribe(
        self,
        id: str,
        message: type,
        *,
        optional: bool = False,
        many: bool = False,
        doc: str = "",
    ) -> None:
        """Declares an input; only in `__init__`. `many`: any number of links may feed it."""
        self._handle.subscribe(id, layout_of(message), not optional, many, doc)

    def provided_data(self, id: str) -> Optional[str]:
        """The system-wide name of what an output publishes, `component.output`."""
        return self._handle.provided_data(id)

    def subscribed_data(self, id: str) -> Optional[str]:
        """The system-wide name of what feeds an input, from the first call of `exec` on."""
        return self._handle.subscribed_data(id)

    def get_parameter(self, name: str) -> None:
        """Requests a parameter; those of the class are requested before `__init__`."""
        self._handle.get_parameter(name)

    def synchronize(self) -> None:
        """Waits until every requested parameter has arrived."""
        self._handle.synchronize()

    def send_data(self, id: str, data: object) -> None:
        """Publishes a message: it is on its way to every subscriber when this returns.

        Waits only for subscribers with `keep="all"`. Arrays are sent from where they are: no other
        thread may write to them meanwhile.
        """
        self._handle.send_data(id, data)

    def history(self, id: str, source: Optional[str] = None) -> History:
        """The last messages of an input since the component was activated, newest first: as many as
        `history="n"` of its link, with the one that is being received. `source`: the data of which it is,
        `component.output`, of an input that takes several.
        """
        return self._handle.history(id, source)

    def timestamp(self) -> float:
        """The current time of the whole system, in seconds since the Unix epoch."""
        return self._handle.timestamp()

    def set_non_controllable(self) -> None:
        """Forbids the executive to freeze this component; only in `__init__`."""
        self._handle.set_non_controllable()

    def exec(self, call: Call) -> Optional[Outcome]:
        """One step of the component's work; returns what the executive should know."""
        return None

    def data_received(self, header: Header, data: Any) -> None:
        """Data of an input have arrived: `data` is an instance of its message class."""

    def parameter_received(self, name: str, value: Any) -> None:
        """A parameter has its value, which the attribute of its name has already."""

    def _take_parameter(self, name: str, value: Any) -> None:
        setattr(self, name, value)
        self.parameter_received(name, value)


class _Declaration:
    """What a class declares, for the native part."""

    def __init__(self, of: Type[Component]) -> None:
        if not (isinstance(of, type) and issubclass(of, Component)):
            name = getattr(of, "__name__", "Name")
            raise TypeError(f"{of!r} is not a class of components: class {name}(armor.Component)")
        _check_class(of)
        self.kind = of.kind or _kind_name(of.__name__)
        self.summary = of.summary or _first_line(of.__doc__ if of.__doc__ != Component.__doc__ else "")
        self.parameters = _list_parameters(of)
        self.events = list(of.events)
        self.reports_done = of.reports_done
        self.ends_by_itself = of.ends_by_itself
        self.needs_rate = of.needs_rate
        self.reads_all = of.reads_all
        self.needs_one_of = [list(group) for group in of.needs_one_of]
        self.stale_after = list(of.stale_after.items())
        self.frames = list(of.frames.items())


#: The attributes of a class, what each is, and how it is written.
_ATTRIBUTES: Dict[str, Tuple[type, str]] = {
    "kind": (str, '"wall-follower"'),
    "summary": (str, '"Follows a wall."'),
    "events": (list, '[armor.DeclaredEvent("near", "a wall is near")]'),
    "reports_done": (bool, "False"),
    "ends_by_itself": (bool, "True"),
    "needs_rate": (bool, "True"),
    "reads_all": (bool, "True"),
    "needs_one_of": (list, '[["scan", "camera"]]'),
    "stale_after": (dict, '{"velocity": "0.5s"}'),
    "frames": (dict, '{"scan": "laser_frame"}'),
}
#: The functions that the system calls, with the number of their arguments after `self`.
_CALLED = {"exec": 1, "data_received": 2, "parameter_received": 2}
_VARIABLE_ARGUMENTS, _GENERATOR, _COROUTINE, _ASYNC_GENERATOR = 0x04, 0x20, 0x80, 0x200


def _check_class(of: Type[Component]) -> None:
    """Refuses what would fail only in a call, or would have no effect."""
    for name, (kind, example) in _ATTRIBUTES.items():
        value = getattr(of, name)
        if not isinstance(value, kind):
            raise TypeError(f"`{name}` of {of.__name__} is {value!r}; write it as {name} = {example}")
    for event in of.events:
        if not isinstance(event, DeclaredEvent):
            right = _ATTRIBUTES["events"][1]
            raise TypeError(f"`events` of {of.__name__} has {event!r}; write it as events = {right}")
    for field, items in (("stale_after", of.stale_after), ("frames", of.frames)):
        for key, value in items.items():
            if not (isinstance(key, str) and isinstance(value, str)):
                right = f"{field} = {_ATTRIBUTES[field][1]}"
                raise TypeError(f"`{field}` of {of.__name__} has {key!r}: {value!r}; write it as {right}")
    for parameter in _list_parameters(of):
        if hasattr(Component, parameter.name):
            raise TypeError(
                f"the parameter `{parameter.name}` of {of.__name__} has the name of a part of "
                "armor.Component; give it another one"
            )
    for name, count in _CALLED.items():
        code = getattr(getattr(of, name), "__code__", None)
        if code is None:
            continue
        if code.co_flags & (_GENERATOR | _COROUTINE | _ASYNC_GENERATOR):
            raise TypeError(f"`{name}` of {of.__name__} is async or a generator; it is a plain function")
        defaults = len(getattr(of, name).__defaults__ or ())
        most = math.inf if code.co_flags & _VARIABLE_ARGUMENTS else code.co_argcount - 1
        if not code.co_argcount - 1 - defaults <= count <= most:
            right = {1: "(self, call)", 2: "(self, header, data)"}[count]
            right = "(self, name, value)" if name == "parameter_received" else right
            raise TypeError(f"`{name}` of {of.__name__} takes other arguments; write def {name}{right}")


def _kind_name(name: str) -> str:
    return re.sub(r"(?<=[a-z0-9])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])", "-", name).lower()


def _first_line(text: Optional[str]) -> str:
    return (text or "").strip().split("\n")[0].strip()


def _list_parameters(of: Type[Component]) -> List[Parameter[Any]]:
    found: Dict[str, Parameter[Any]] = {}
    for cls in reversed(of.__mro__):
        for name, value in vars(cls).items():
            if isinstance(value, Parameter):
                found[name] = value
            else:
                found.pop(name, None)
    return list(found.values())


class _Constructor(Generic[C]):
    """Makes the instance, whose functions work in `__init__` already."""

    def __init__(self, of: Type[C]) -> None:
        self.of = of
        self.instance: Optional[C] = None

    def __call__(self, handle: _armor.Handle, values: Dict[str, Any]) -> C:
        instance = self.of.__new__(self.of)
        instance._handle = handle
        if self.of.send_data is Component.send_data:
            # What is called most, without a frame of Python in between.
            instance.__dict__["send_data"] = handle.send_data
        for parameter in _list_parameters(self.of):
            if parameter.default is None and parameter.name not in values:
                setattr(instance, parameter.name, parameter.stand_in())
        for name, value in values.items():
            setattr(instance, name, value)
        instance.__init__()  # type: ignore[misc]
        self.instance = instance
        return instance


def describe(of: Type[Component]) -> str:
    """The manifest of a class of components, as JSON: what `--describe` prints."""
    return _armor.manifest(_Declaration(of), _Constructor(of))


def run(of: Type[Component]) -> NoReturn:
    """Runs a component as this process, by its command line. Does not return."""
    declaration, constructor = _Declaration(of), _Constructor(of)
    _prepare_process(constructor)
    code = _armor.run(declaration, constructor, sys.argv[1:])
    _end_process(code)


def _prepare_process(constructor: _Constructor[Any]) -> None:
    import faulthandler
    import signal

    # Both end the component in order; a KeyboardInterrupt in its last call would not.
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, signal.SIG_DFL)
    # A crash in an extension names the lines of Python that led there.
    if sys.stderr is not None and not faulthandler.is_enabled():
        faulthandler.enable()
    # What is printed reaches the log line by line.
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(line_buffering=True)
    _report_threads(constructor)
    _disown_forks(constructor)
    if "logging" in sys.modules:
        _forward_logging()


def _report_threads(constructor: _Constructor[Any]) -> None:
    import threading

    previous = threading.excepthook

    def report(args: Any) -> None:
        previous(args)
        instance = constructor.instance
        if instance is not None and not issubclass(args.exc_type, SystemExit):
            name = args.thread.name if args.thread is not None else "?"
            why = f"{args.exc_type.__name__}: {args.exc_value}"
            instance._handle.report_thread_failure(f"the thread `{name}` has raised {why}")

    threading.excepthook = report


def _disown_forks(constructor: _Constructor[Any]) -> None:
    """A fork of the process has its connections: what it published would mix with what the component does."""

    def disown() -> None:
        _armor.mark_fork()
        instance = constructor.instance
        if instance is not None:
            instance.__dict__.pop("send_data", None)
            instance._handle = _NoHandle(
                "this process is a fork of the component's and no part of the system: only the component "
                "itself may call its functions; multiprocessing needs the start method `spawn`"
            )

    os.register_at_fork(after_in_child=disown)


def _end_fork(function: str, error: Optional[BaseException]) -> NoReturn:
    """Ends a fork that leaves a function of the component, as `sys.exit` in it asks."""
    code = 0
    if isinstance(error, SystemExit):
        code = error.code if isinstance(error.code, int) else int(error.code is not None)
    else:
        if error is not None:
            import traceback

            traceback.print_exception(error.__class__, error, error.__traceback__)
        code = 1
        print(
            f"a fork of the component has left `{function}` and must not go on as the component: it ends; "
            "let it end itself with os._exit(0)",
            file=sys.stderr,
        )
    for stream in (sys.stdout, sys.stderr):
        if stream is not None:
            stream.flush()
    os._exit(code)


def _forward_logging() -> None:
    import logging

    class Handler(logging.Handler):
        def emit(self, record: logging.LogRecord) -> None:
            name = "" if record.name == "root" else f"{record.name}: "
            _armor.log(record.levelno, name + self.format(record))

    root = logging.getLogger()
    if not root.handlers:
        root.addHandler(Handler())
        # `armor log NAME debug` decides what is written.
        root.setLevel(logging.DEBUG)


def _end_process(code: int) -> NoReturn:
    """Ends the process as `sys.exit` does, without waiting for threads: some of them may be in a call
    that does not return, and those of links may not enter the interpreter any more."""
    import atexit

    try:
        atexit._run_exitfuncs()
    finally:
        for stream in (sys.stdout, sys.stderr):
            try:
                stream.flush()
            except (OSError, ValueError, AttributeError):
                pass
        os._exit(code)
