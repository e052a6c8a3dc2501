"""Parameters as a class of components declares them."""

from __future__ import annotations

import math
import os
from typing import Any, Dict, Generic, List, Optional, Tuple, Type, TypeVar, Union

T = TypeVar("T")


class _Missing:
    """The default of a parameter that the file must assign."""


MISSING = _Missing()


class Parameter(Generic[T]):
    """A parameter as its class declares it; see `armor.parameter`."""

    def __init__(self, kind: str, value: Union[T, _Missing], options: Dict[str, Any]) -> None:
        self.kind = kind
        self.value = value
        self.name = ""
        self.unit: str = options["unit"]
        bounds: Tuple[Optional[float], Optional[float]] = options["range"] or (None, None)
        self.minimum, self.maximum = bounds
        self.choices: List[str] = list(options["choices"])
        self.format: Optional[str] = options["format"]
        self.doc: str = options["doc"]
        self.live: bool = options["live"]
        self.written: bool = options["written"]

    def __set_name__(self, owner: type, name: str) -> None:
        self.name = name

    def __get__(self, instance: object, owner: Optional[type] = None) -> T:
        if instance is None:
            return self  # type: ignore[return-value]
        if isinstance(self.value, _Missing):
            raise AttributeError(f"parameter `{self.name}` has no default and no value yet")
        return self.value

    def stand_in(self) -> Any:
        """A value of its type, for a description: the file, which assigns it, is not there then."""
        if self.kind in ("number", "integer"):
            lowest = -math.inf if self.minimum is None else self.minimum
            highest = math.inf if self.maximum is None else self.maximum
            value = min(max(0.0, lowest), highest)
            return int(value) if self.kind == "integer" else value
        if self.kind == "text":
            return [] if self.format in ("points", "numbers", "names", "frames") else ""
        if self.kind == "path":
            import pathlib

            return pathlib.Path()
        return {"flag": False, "choice": next(iter(self.choices), ""), "colour": "#000000"}[self.kind]

    @property
    def default(self) -> Optional[str]:
        """The default, written as in a file."""
        return None if isinstance(self.value, _Missing) else self.write(self.value)

    def write(self, value: object) -> str:
        """A value, written as in a file: a text as it is, a number with the unit."""
        value = _without_numpy(value)
        if isinstance(value, str):
            return value
        if isinstance(value, bool):
            return "true" if value else "false"
        if isinstance(value, (int, float)):
            return f"{value!r}{self.unit}"
        if isinstance(value, (list, tuple)):
            items = (",".join(map(repr, it)) if isinstance(it, (list, tuple)) else str(it) for it in value)
            return " ".join(items)
        return os.fspath(value)  # type: ignore[call-overload, no-any-return]


def parameter(
    default: Union[T, _Missing] = MISSING,
    *,
    type: Optional[Type[T]] = None,
    unit: str = "",
    range: Optional[Tuple[Optional[float], Optional[float]]] = None,
    choices: Tuple[str, ...] = (),
    format: Optional[str] = None,
    live: bool = False,
    written: bool = False,
    colour: bool = False,
    doc: str = "",
) -> T:
    """A parameter of a component: an attribute of its class, whose value is the file's.

    Its type is that of the default, or `type` if it has none and the file must assign it: `float` (a
    number, in SI if it has a unit), `int`, `bool`, `str` or `pathlib.Path`. `range`: the smallest and
    the largest value, in SI. `choices`: the texts of which it is one. `format`: the form of a text
    (`points`, `numbers`, `names`, `address`, `frame`) or what a path leads to (`file`, `folder`).
    `live`: a change in the file reaches the running component. `written`: the component writes to the
    path. `colour`: the text is a colour, `#rrggbb`.
    """
    default = _without_numpy(default)
    of: type_ = type if type is not None else default.__class__
    if isinstance(choices, str):
        raise TypeError(f"choices are several texts: choices=({choices!r},), not choices={choices!r}")
    kind = _kind_of(of, unit, bool(choices), colour, format)
    if range is not None:
        _check_range(kind, range)
    options = {
        "unit": unit,
        "range": range,
        "choices": choices,
        "format": format,
        "doc": doc,
        "live": live,
        "written": written,
    }
    return Parameter(kind, default, options)  # type: ignore[return-value]


type_ = type


def _without_numpy(value: Any) -> Any:
    """A number or an array of numpy as numbers of Python, which are written as in a file."""
    if isinstance(value, (list, tuple)):
        return value.__class__(map(_without_numpy, value))
    return value.tolist() if hasattr(value, "__array_interface__") else value


def _check_range(kind: str, bounds: Any) -> None:
    right = "range=(0.0, 1.0), with None for no limit"
    if not isinstance(bounds, (list, tuple)) or len(bounds) != 2:
        raise TypeError(f"a range is the smallest and the largest value: {right}; not {bounds!r}")
    if kind not in ("number", "integer"):
        raise TypeError(f"a range is for numbers; the parameter is a {kind}")
    smallest, largest = bounds
    if smallest is not None and largest is not None and smallest > largest:
        raise ValueError(f"the smallest value of the range {bounds!r} is larger than the largest one")


def _kind_of(of: type_, unit: str, is_choice: bool, is_colour: bool, form: Optional[str]) -> str:
    if is_choice:
        return "choice"
    if is_colour:
        return "colour"
    if form in ("file", "folder") or hasattr(of, "__fspath__"):
        return "path"
    if issubclass(of, bool):
        return "flag"
    if issubclass(of, int) and not unit:
        return "integer"
    if issubclass(of, (int, float)):
        return "number"
    if issubclass(of, (list, tuple)) and form is None:
        raise TypeError(
            'a list needs the form of its text: armor.parameter([1, 2], format="numbers"); or "points", '
            '"names"'
        )
    if issubclass(of, (str, list, tuple)):
        return "text"
    if issubclass(of, _Missing):
        raise TypeError("a parameter has a default or a type: armor.parameter(type=float)")
    raise TypeError(f"a parameter is a float, int, bool, str or pathlib.Path, not {of.__name__}")
