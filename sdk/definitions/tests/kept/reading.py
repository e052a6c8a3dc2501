"""Messages, as `armor message export --lang python` writes them."""

from __future__ import annotations

import enum
from typing import TYPE_CHECKING, List, Optional, Sequence, Union

from armor._message import Message, _array
from armor.messages import Pose2D

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray


class State(enum.Enum):
    """The message State."""

    Idle = 0
    Busy = 1


class Part(Message):
    """The message Part."""

    __slots__ = ("id", "mass",)
    _fields = (
        ("id", "id", None, "i32"),
        ("mass", "mass", "kg", ("optional", "f32")),
    )

    id: int
    mass: Optional[float]
    """Unit: kg."""

    def __init__(
        self,
        id: int = 0,
        mass: Optional[float] = None,
    ) -> None:
        self.id = id
        self.mass = mass


class Reading(Message):
    """The message Reading."""

    __slots__ = ("stamp", "name", "level", "ok", "ranges", "raw", "names", "corner", "depth", "state", "at", "parts",)
    _fields = (
        ("stamp", "stamp", "s", "f64"),
        ("name", "name", None, "string"),
        ("level", "level", None, "u16"),
        ("ok", "ok", None, "bool"),
        ("ranges", "ranges", "m", ("array", "f32")),
        ("raw", "raw", None, ("array", "u8")),
        ("names", "names", None, ("list", "string")),
        ("corner", "corner", "m", ("fixed", "f64", 4)),
        ("depth", "depth", "m", ("optional", "f64")),
        ("state", "state", None, State),
        ("at", "at", None, Pose2D),
        ("parts", "parts", None, ("list", Part)),
    )

    stamp: float
    """Unit: s."""
    name: str
    level: int
    ok: bool
    ranges: NDArray[np.float32]
    """Unit: m."""
    raw: NDArray[np.uint8]
    names: List[str]
    corner: List[float]
    """Unit: m."""
    depth: Optional[float]
    """Unit: m."""
    state: State
    at: Pose2D
    parts: List[Part]

    def __init__(
        self,
        stamp: float = 0.0,
        name: str = "",
        level: int = 0,
        ok: bool = False,
        ranges: Union[NDArray[np.float32], Sequence[float], None] = None,
        raw: Union[NDArray[np.uint8], bytes, Sequence[int], None] = None,
        names: Optional[List[str]] = None,
        corner: Optional[List[float]] = None,
        depth: Optional[float] = None,
        state: State = State.Idle,
        at: Optional[Pose2D] = None,
        parts: Optional[List[Part]] = None,
    ) -> None:
        self.stamp = stamp
        self.name = name
        self.level = level
        self.ok = ok
        self.ranges = _array(ranges, "<f4", "Reading.ranges")
        self.raw = _array(raw, "<u1", "Reading.raw")
        self.names = [] if names is None else names
        self.corner = [0.0] * 4 if corner is None else corner
        self.depth = depth
        self.state = state
        self.at = Pose2D() if at is None else at
        self.parts = [] if parts is None else parts
