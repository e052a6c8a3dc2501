"""A running system, observed from a script or a notebook."""

from __future__ import annotations

import enum
from types import TracebackType
from typing import (
    TYPE_CHECKING,
    Any,
    AsyncIterator,
    Dict,
    Iterator,
    List,
    NamedTuple,
    Optional,
    Tuple,
    Type,
)

from armor import _armor, messages
from armor._armor import ArmorError, EndedError, Header
from armor._message import Message, layout_of, schema_of

if TYPE_CHECKING:
    from numpy.typing import NDArray


class Output(NamedTuple):
    """What a component publishes."""

    data: str
    type: str
    schema: str
    latched: bool


class Process(NamedTuple):
    """A process of the system; `state` is empty if it does not report one."""

    name: str
    kind: str
    pid: int
    state: str
    last_error: str


class ParameterValue(NamedTuple):
    """A parameter as the file of the system has it."""

    component: str
    name: str
    type: str
    value: str
    unit: str
    origin: str
    live: bool
    range: str
    doc: str


class Received(NamedTuple):
    """A message with its header."""

    header: Header
    data: Any


class Publisher:
    """An output of this process, `NAME.OUTPUT`, until it is closed."""

    def __init__(self, native: _armor.DataPublisher) -> None:
        self._native = native

    def send(self, data: object) -> int:
        """Publishes a message; returns the number of subscribers that it was sent to."""
        return self._native.send(data)

    def close(self) -> None:
        """Leaves the system."""
        self._native.close()

    def __enter__(self) -> Publisher:
        return self

    def __exit__(
        self, kind: Optional[Type[BaseException]], error: Optional[BaseException], place: Optional[TracebackType]
    ) -> None:
        self.close()


class Observer:
    """A running system; see `armor.observe`. Use it in `with`, which ends all that it has opened."""

    def __init__(self, address: str) -> None:
        self._native = _armor.SystemObserver(address)
        self._open: List[Any] = []
        self._is_closed = False

    def __enter__(self) -> Observer:
        return self

    def __exit__(
        self, kind: Optional[Type[BaseException]], error: Optional[BaseException], place: Optional[TracebackType]
    ) -> None:
        self.close()

    def close(self) -> None:
        """Ends all feeds and publishers; iterators that wait end."""
        self._is_closed = True
        for opened in self._open:
            opened.close()
        self._open.clear()

    def timestamp(self) -> float:
        """The current time of the system, in seconds since the Unix epoch."""
        return self._native.timestamp()

    def outputs(self) -> List[Output]:
        """All outputs of the system."""
        return [Output(*entry) for entry in self._native.list_data()]

    def processes(self) -> List[Process]:
        """All processes, with the state that each reports."""
        return [Process(*entry) for entry in self._native.list_processes()]

    def read(
        self, data: str, count: Optional[int] = None, *, timeout: Optional[float] = None, keep: int = 100
    ) -> Iterator[Received]:
        """The messages of an output as they arrive: `count` of them, or all until the system ends or, with
        a `timeout` in seconds, none has arrived within it. At most `keep` wait for a reader that is slow;
        the header counts those that are lost.
        """
        _check_reading(count, timeout, keep)
        feed, layout = self._open_feed(data, keep)
        return self._iterate(feed, layout, count, timeout)

    def _open_feed(self, data: str, keep: int) -> Tuple[_armor.DataFeed, _armor.Layout]:
        feed = self._native.open_feed(data, keep, 3.0)
        self._add_open(feed)
        return feed, layout_of(class_of_schema(feed.schema))

    def _add_open(self, opened: Any) -> None:
        self._open.append(opened)
        # `close` may have come from another thread meanwhile.
        if self._is_closed:
            opened.close()
            raise ArmorError("the observer is closed")

    def _close_feed(self, feed: _armor.DataFeed) -> None:
        feed.close()
        if feed in self._open:
            self._open.remove(feed)

    def _iterate(
        self, feed: _armor.DataFeed, layout: _armor.Layout, count: Optional[int], timeout: Optional[float]
    ) -> Iterator[Received]:
        try:
            while count is None or count > 0:
                received = feed.next(layout, timeout)
                if received is None:
                    return
                count = None if count is None else count - 1
                yield Received(*received)
        except EndedError:
            return
        finally:
            self._close_feed(feed)

    async def stream(
        self, data: str, count: Optional[int] = None, *, timeout: Optional[float] = None, keep: int = 100
    ) -> AsyncIterator[Received]:
        """As `read`, for `async for`: the event loop runs meanwhile."""
        import asyncio

        _check_reading(count, timeout, keep)
        feed, layout = await asyncio.to_thread(self._open_feed, data, keep)
        try:
            while count is None or count > 0:
                received = await asyncio.to_thread(feed.next, layout, timeout)
                if received is None:
                    return
                count = None if count is None else count - 1
                yield Received(*received)
        except EndedError:
            return
        finally:
            # A thread that waits for the next message ends with the feed.
            self._close_feed(feed)

    def arrays(
        self, data: str, *fields: str, count: int, timeout: Optional[float] = 10.0, keep: int = 1000
    ) -> Dict[str, NDArray[Any]]:
        """`count` messages of an output as numpy arrays, one for each field: `twist.linear.x`, and
        `stamp_s`. `pandas.DataFrame(…)` takes the result. Fewer if none arrives for `timeout` seconds.
        """
        import numpy

        columns: Dict[str, List[Any]] = {"stamp_s": [], **{field: [] for field in fields}}
        for header, message in self.read(data, count, timeout=timeout, keep=keep):
            columns["stamp_s"].append(header.stamp_s)
            for field in fields:
                columns[field].append(_read_field(message, field))
        return {name: numpy.array(values) for name, values in columns.items()}

    def publish(self, data: str, message: type, *, latched: bool = False) -> Publisher:
        """An output of this process, `NAME.OUTPUT`, for tools and, if NAME is a component of the file that does
        not run, for the inputs that are linked to it. No process of the system may have the name."""
        publisher = Publisher(self._native.open_publisher(data, layout_of(message), latched))
        self._add_open(publisher)
        return publisher

    def parameters(self, component: Optional[str] = None) -> List[ParameterValue]:
        """The parameters of a component, or of all."""
        return [ParameterValue(*entry) for entry in self._native.parameters(component)]

    def set_parameter(self, name: str, value: Optional[str]) -> List[str]:
        """Writes a value, as in a file (`"0.5m/s"`), into the file of the system; `None` removes it. Returns
        what changed, and when that takes effect. An invalid value raises `armor.ArmorError`.
        """
        component, _, parameter = name.partition(".")
        if not parameter:
            raise ValueError(f"{name!r} is no COMPONENT.PARAMETER")
        return self._native.set_parameter(component, parameter, value)

    def fire(self, transition: str, *, take: bool = False) -> str:
        """Fires a transition of the operator. As all orders, it returns the consequence, and raises
        `armor.ArmorError` if it is refused; `take` takes the command over from another operator."""
        return self._native.order("fire", [transition], take)

    def confirm(self, transition: str, *, take: bool = False) -> str:
        """Lets a transition fire that waits for confirmation."""
        return self._native.order("confirm", [transition], take)

    def decline(self, transition: str, *, take: bool = False) -> str:
        """Does not let it."""
        return self._native.order("decline", [transition], take)

    def pause(self, *, take: bool = False) -> str:
        """Freezes all components, but for those of safety."""
        return self._native.order("pause", [], take)

    def resume(self, *, take: bool = False) -> str:
        """Ends a pause."""
        return self._native.order("resume", [], take)

    def safe(self, *, take: bool = False) -> str:
        """Sends the mission to its safe place."""
        return self._native.order("safe", [], take)

    def move(self, origin: str, to: str, tokens: int = 1, *, take: bool = False) -> str:
        """Moves tokens from one place to another, during a pause."""
        return self._native.order("move", [origin, to, str(tokens)], take)


def _check_reading(count: Optional[int], timeout: Optional[float], keep: int) -> None:
    if count is not None and not (isinstance(count, int) and count >= 0):
        raise ValueError(f"count is the number of messages to read, or None for all, not {count!r}")
    if timeout is not None and not timeout >= 0.0:
        raise ValueError(f"timeout is a time in seconds, or None to wait without limit, not {timeout!r}")
    if not (isinstance(keep, int) and 1 <= keep <= 65536):
        raise ValueError(f"keep is 1 to 65536 messages, not {keep!r}")


def _read_field(message: Any, path: str) -> Any:
    for part in path.split("."):
        try:
            message = message[int(part)] if part.isdigit() else getattr(message, part)
        except (AttributeError, IndexError):
            names = ", ".join(getattr(message, "__slots__", ())) or "none"
            kind = type(message).__name__
            raise ArmorError(f"`{path}`: {kind} has no field `{part}` (there are: {names})") from None
    return message.value if isinstance(message, enum.Enum) else message


_CLASSES: Dict[str, type] = {}
#: Schemas whose classes are kept; a program that sees more makes them again.
_MOST_CLASSES = 1000


def class_of_schema(schema: str) -> type:
    """The message class with this schema: a standard one, or one that is made here."""
    return _class_of_parts(_armor.schema_parts(schema))


def _class_of_parts(parts: Tuple[Any, ...]) -> type:
    word, name, schema, members = parts
    standard = getattr(messages, name, None)
    if isinstance(standard, type) and _has_schema(standard, schema):
        return standard
    if schema in _CLASSES:
        return _CLASSES[schema]
    made: Any
    if word == "enum":
        functional: Any = enum.Enum
        made = functional(name, {member: index for index, member in enumerate(members)})
    else:
        described = tuple((field, field, unit, _describe(value)) for field, unit, value in members)
        body = {"__slots__": tuple(field for field, _, _ in members), "_fields": described}
        made = type(name, (Message,), body)
    if len(_CLASSES) < _MOST_CLASSES:
        _CLASSES[schema] = made
    return made  # type: ignore[no-any-return]


def _has_schema(cls: type, schema: str) -> bool:
    is_message = issubclass(cls, (Message, enum.Enum)) and cls is not Message
    return is_message and schema_of(cls) == schema


def _describe(parts: Any) -> Any:
    """A value of a schema, as `_fields` of a message describes it."""
    if isinstance(parts, str):
        return parts
    if parts[0] in ("struct", "enum"):
        return _class_of_parts(parts)
    item = _describe(parts[1])
    is_numbers = isinstance(item, str) and item not in ("bool", "string")
    word = "array" if parts[0] == "list" and is_numbers else parts[0]
    return (word, item, *parts[2:])
