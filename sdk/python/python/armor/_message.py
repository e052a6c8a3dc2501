"""Message classes: their annotations are the schema."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, Any, Dict, Optional, Tuple, Type, TypeVar, Union

from armor import _armor
from armor._armor import MessageError

if TYPE_CHECKING:
    from typing_extensions import Annotated, dataclass_transform

    u8 = int
    i8 = int
    u16 = int
    i16 = int
    u32 = int
    i32 = int
    u64 = int
    i64 = int
    f32 = float
    f64 = float
else:
    from typing import Annotated

    def dataclass_transform(**_):
        return lambda decorated: decorated


M = TypeVar("M")


class _Primitive:
    """The type of a number, where `int` and `float` (i64 and f64) are not meant."""

    __slots__ = ("name",)

    def __init__(self, name: str) -> None:
        self.name = name


if not TYPE_CHECKING:
    u8 = Annotated[int, _Primitive("u8")]
    i8 = Annotated[int, _Primitive("i8")]
    u16 = Annotated[int, _Primitive("u16")]
    i16 = Annotated[int, _Primitive("i16")]
    u32 = Annotated[int, _Primitive("u32")]
    i32 = Annotated[int, _Primitive("i32")]
    u64 = Annotated[int, _Primitive("u64")]
    i64 = Annotated[int, _Primitive("i64")]
    f32 = Annotated[float, _Primitive("f32")]
    f64 = Annotated[float, _Primitive("f64")]


class unit:
    """The unit of a number, as part of its annotation: `Annotated[float, armor.unit("m/s")]`."""

    __slots__ = ("name",)

    def __init__(self, name: str) -> None:
        if not isinstance(name, str):
            raise MessageError(f"a unit is a text such as armor.unit(\"m/s\"), not {name!r}")
        self.name = _armor.check_unit(name)


class fixed:
    """The count of a list that always has so many values: `Annotated[list[float], armor.fixed(36)]`."""

    __slots__ = ("count",)

    def __init__(self, count: int) -> None:
        if not (isinstance(count, int) and 0 < count <= 65536):
            raise MessageError(f"a list has a count of 1 to 65536: armor.fixed(36), not {count!r}")
        self.count = count


class Message:
    """A standard message: `==`, `repr`, and attributes that can be changed."""

    __slots__: Tuple[str, ...] = ()
    #: Each attribute with its name in the schema, its unit, and its value, for the native part.
    _fields: Tuple[Tuple[str, str, Optional[str], Any], ...] = ()

    def __eq__(self, other: object) -> bool:
        if other.__class__ is not self.__class__:
            return NotImplemented
        return all(_is_equal(getattr(self, it), getattr(other, it)) for it in self.__slots__)

    __hash__ = None  # type: ignore[assignment]

    def __repr__(self) -> str:
        parts = ", ".join(f"{it}={getattr(self, it, None)!r}" for it in self.__slots__)
        return f"{type(self).__name__}({parts})"

    def __getstate__(self) -> Dict[str, Any]:
        return {it: getattr(self, it) for it in self.__slots__}

    def __setstate__(self, state: Dict[str, Any]) -> None:
        for name, value in state.items():
            setattr(self, name, value)


def _array(values: Any, dtype: str, of: str = "") -> Any:
    """An array of `values`; those that are an array already as they are. `of` names the field."""
    if hasattr(values, "__array_interface__"):
        return values
    import numpy

    if isinstance(values, (bytes, bytearray, memoryview)):
        return numpy.frombuffer(values, dtype)
    array = numpy.asarray(() if values is None else values)
    if array.size == 0:
        return array.astype(dtype)
    # numpy would make 1 of 1.9.
    kind = numpy.dtype(dtype).kind
    converted = None
    if array.dtype.kind in ("iuf" if kind == "f" else "iub"):
        with numpy.errstate(over="ignore"):
            converted = array.astype(dtype)
    elif array.dtype.kind not in "iufbcSU":
        raise MessageError(f"{of}: an array needs numbers, all of the same kind and in range")
    if converted is None:
        raise MessageError(f"{of}: {array.dtype} values are no {numpy.dtype(dtype)}; convert them first")
    lost = converted != array if kind != "f" else numpy.isinf(converted) & numpy.isfinite(array)
    if lost.any():
        raise MessageError(f"{of}: {array[lost][0]} is out of range for {numpy.dtype(dtype)}")
    return converted


def _is_equal(a: Any, b: Any) -> bool:
    """Whether two values are equal; arrays are if all of their numbers are."""
    if hasattr(a, "__array_interface__") or hasattr(b, "__array_interface__"):
        import numpy

        return bool(numpy.array_equal(a, b))
    return bool(a == b)


@dataclass_transform()
def message(cls: Type[M]) -> Type[M]:
    """Makes a class a message: a dataclass whose annotations are its schema.

    Fields are `float`, `int`, `bool`, `str`, `bytes`, lists, numpy arrays
    (`numpy.typing.NDArray[numpy.float32]`), other messages, enums and `Optional` of these; `armor.u8`
    … `armor.f32` are the other numbers. `Annotated[float, armor.unit("m")]` has a unit.
    """
    import dataclasses

    made = _with_slots(dataclasses.dataclass(eq=False)(cls))
    names = [field.name for field in dataclasses.fields(made)]  # type: ignore[arg-type]

    def __eq__(self: Any, other: object) -> bool:
        if other.__class__ is not self.__class__:
            return NotImplemented
        return all(_is_equal(getattr(self, name), getattr(other, name)) for name in names)

    made.__eq__ = __eq__  # type: ignore[method-assign]
    made.__hash__ = None  # type: ignore[assignment]
    # Local classes, as in tests, are found in the frame of the one who decorates.
    layout = _read_class(made, sys._getframe(1).f_locals)
    setattr(made, "__armor_layout__", layout)
    return made


def _with_slots(cls: Type[M]) -> Type[M]:
    """The same class with its fields as the only attributes: a misspelt one is refused."""
    import dataclasses

    inherited = {name for base in cls.__mro__[1:] for name in getattr(base, "__slots__", ())}
    body = dict(cls.__dict__)
    names = [field.name for field in dataclasses.fields(cls)]  # type: ignore[arg-type]
    for name in names:
        # The default is in `__init__`; of the class it would be in the way of the slot.
        body.pop(name, None)
    for name in ("__dict__", "__weakref__"):
        body.pop(name, None)
    body["__slots__"] = tuple(name for name in names if name not in inherited)
    made: Any = type(cls)(cls.__name__, cls.__bases__, body)  # type: ignore[misc]
    made.__qualname__ = cls.__qualname__
    return made  # type: ignore[no-any-return]


def layout_of(cls: type) -> _armor.Layout:
    """The layout of a message class, made at its first use."""
    if not isinstance(cls, type):
        what = f"an instance of {type(cls).__name__}"
        raise MessageError(
            f"{cls!r} is {what}, not a message class; for example: self.provide(\"scan\", LaserScan)"
        )
    if cls is _armor.AnyMessage:
        return _layout_of_any()
    layout = cls.__dict__.get("__armor_layout__")
    if layout is not None:
        return layout  # type: ignore[no-any-return]
    if issubclass(cls, Message) and cls._fields:
        fields = [(a, name, unit, _describe(value)) for a, name, unit, value in cls._fields]
        layout = _armor.Layout.of_fields(cls, cls.__name__, fields)
    elif _is_enum(cls):
        if issubclass(cls, sys.modules["enum"].Flag):
            why = "its combinations have no schema; use an enum.Enum, or a bool for each flag"
            raise MessageError(f"`{cls.__name__}` is an enum.Flag: {why}")
        if not len(cls):  # type: ignore[arg-type]
            raise MessageError(f"the enum `{cls.__name__}` has no members; a message needs at least one")
        members = [(member.name.rstrip("_"), member) for member in cls]  # type: ignore[attr-defined]
        layout = _armor.Layout.of_members(cls, cls.__name__, members)
    else:
        raise MessageError(f"`{cls.__name__}` is not a message: decorate it with @armor.message")
    setattr(cls, "__armor_layout__", layout)
    return layout


_any: Optional[_armor.Layout] = None


def _layout_of_any() -> _armor.Layout:
    """The layout of ports that pass on messages of any type."""
    global _any
    if _any is None:
        _any = _armor.Layout.of_any(_armor.AnyMessage)
    return _any


def _is_enum(cls: Any) -> bool:
    enum = sys.modules.get("enum")
    return enum is not None and isinstance(cls, type) and issubclass(cls, enum.Enum)


def _describe(value: Any) -> Any:
    """Puts layouts where a standard message names classes."""
    if isinstance(value, type):
        return layout_of(value)
    if isinstance(value, tuple):
        return (value[0], _describe(value[1]), *value[2:])
    return value


def schema_of(cls: type) -> str:
    """The schema of a message class in its canonical form, as `armor data info` shows it."""
    return layout_of(cls).schema


def encode(data: object) -> bytes:
    """The bytes of a message, as it is sent."""
    return _armor.encode(layout_of(type(data)), data)


def decode(cls: Type[M], data: bytes) -> M:
    """The message of this class that has these bytes."""
    return _armor.decode(layout_of(cls), data)  # type: ignore[no-any-return]


def _read_class(cls: type, local: Dict[str, Any]) -> _armor.Layout:
    import typing

    names = dict(vars(sys.modules[cls.__module__])) if cls.__module__ in sys.modules else {}
    try:
        hints = typing.get_type_hints(cls, names, dict(local), include_extras=True)
    except Exception as error:
        raise MessageError(f"the annotations of `{cls.__name__}` cannot be read: {error}") from error
    fields = []
    for attribute, field in cls.__dataclass_fields__.items():  # type: ignore[attr-defined]
        if isinstance(field.default, unit):
            right = f"{attribute}: Annotated[float, armor.unit({field.default.name!r})]"
            raise MessageError(f"{cls.__name__}.{attribute}: a unit is no value; write {right}")
        try:
            value, of_unit = _read_annotation(hints[attribute])
        except MessageError as error:
            raise MessageError(f"{cls.__name__}.{attribute}: {error}") from None
        fields.append((attribute, attribute.rstrip("_"), of_unit, value))
    return _armor.Layout.of_fields(cls, cls.__name__, fields)


_PLAIN = {float: "f64", int: "i64", bool: "bool", str: "string", bytes: ("bytes", "u8")}


def _read_annotation(hint: Any) -> Tuple[Any, Optional[str]]:
    """How the value of an annotation is described, and its unit."""
    import typing

    if hint in _PLAIN:
        return _PLAIN[hint], None
    origin, parts = typing.get_origin(hint), typing.get_args(hint)
    if origin is Annotated:
        return _read_annotated(parts)
    # A name for a type, as NDArray is of some versions of numpy.
    if hasattr(hint, "__value__") and not parts:
        return _read_annotation(hint.__value__)
    if hasattr(origin, "__value__"):
        return _read_annotation(origin.__value__[parts])
    if origin in (list, tuple) and parts:
        if origin is tuple and (len(parts) != 2 or parts[1] is not Ellipsis):
            raise MessageError("a tuple has no schema; use a list or a message of your own")
        item, of_unit = _read_annotation(parts[0])
        return ("list", item), of_unit
    if origin is Union or getattr(origin, "__name__", "") == "UnionType":
        some = [part for part in parts if part is not type(None)]
        if len(some) != 1 or len(some) == len(parts):
            raise MessageError("a union has no schema, except Optional of one type")
        item, of_unit = _read_annotation(some[0])
        return ("optional", item), of_unit
    number = _number_of(hint)
    if number is not None:
        return number, None
    if getattr(origin, "__name__", "") == "ndarray":
        number = _number_of(next(iter(typing.get_args(parts[-1])), None))
        if number is None:
            raise MessageError("the array needs the type of its numbers: NDArray[numpy.float32]")
        return ("array", number), None
    if getattr(hint, "__name__", "") == "ndarray":
        raise MessageError("the array needs the type of its numbers: NDArray[numpy.float32]")
    if hint is _armor.AnyMessage:
        raise MessageError("armor.AnyMessage is the type of a port, and no field of a message")
    if getattr(hint, "__module__", "") == "numpy":
        raise MessageError(f"{hint!r} has no schema; of numpy use int8 to uint64, float32 and float64")
    if isinstance(hint, type) and hint not in (list, tuple, dict, set, object):
        return layout_of(hint), None
    known = "float, int, bool, str, bytes, list[…], NDArray[…], Optional[…], an enum or a message"
    raise MessageError(f"{hint!r} has no schema; use {known}")


def _read_annotated(parts: Tuple[Any, ...]) -> Tuple[Any, Optional[str]]:
    value, of_unit = _read_annotation(parts[0])
    for part in parts[1:]:
        if isinstance(part, str):
            raise MessageError(f"a unit is written armor.unit({part!r}), not {part!r} alone")
        if isinstance(part, _Primitive):
            value = part.name
        elif isinstance(part, unit):
            of_unit = part.name
        elif isinstance(part, fixed):
            if not (isinstance(value, tuple) and value[0] in ("list", "array")):
                raise MessageError("armor.fixed is for lists and arrays")
            value = ("fixed", value[1], part.count)
    if of_unit is not None and not _is_of_numbers(value):
        raise MessageError("only a number, or a list or an array of them, has a unit")
    return value, of_unit


def _is_of_numbers(value: Any) -> bool:
    """Whether it is a number, or a list, an array or an `Optional` of one."""
    while isinstance(value, tuple):
        value = value[1]
    return isinstance(value, str) and value not in ("bool", "string")


def _number_of(hint: Any) -> Optional[str]:
    """The number type of a numpy scalar class such as `numpy.float32`."""
    kinds = {"uint": "u", "int": "i", "float": "f"}
    if getattr(hint, "__module__", "") != "numpy" or not isinstance(hint, type):
        return None
    name = hint.__name__
    for kind, letter in kinds.items():
        bits = name[len(kind) :]
        if name.startswith(kind) and bits in ("8", "16", "32", "64") and name not in ("float8", "float16"):
            return letter + bits
    return None
