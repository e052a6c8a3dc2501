"""Messages: their schemas, and their bytes in both directions."""

from __future__ import annotations

import enum
import importlib.util
import math
import pickle
import unittest
from pathlib import Path
from typing import List, Optional

import numpy as np
from numpy.typing import NDArray
from typing import Annotated

import armor
from armor import messages
from armor.messages import Image, LaserScan, Odometry, PowerSupplyStatus, Quaternion, Twist, Vector3

SCHEMAS = Path(__file__).parents[2] / "tests" / "sdk" / "standard_messages.txt"
# What `armor message export` writes of one message.
KEPT = Path(__file__).parents[2] / "definitions" / "tests" / "kept"


class Side(enum.Enum):
    Left = "l"
    Right = "r"


@armor.message
class Spot:
    x: Annotated[float, armor.unit("m")]
    side: Side = Side.Left


@armor.message
class Everything:
    flag: bool
    whole: int
    small: armor.u8
    number: float
    single: armor.f32
    text: str
    raw: bytes
    spots: List[Spot]
    array: NDArray[np.int16]
    three: Annotated[List[float], armor.fixed(3)]
    maybe: Optional[Spot] = None
    from_: str = "here"


def everything() -> Everything:
    return Everything(
        flag=True,
        whole=-7,
        small=255,
        number=math.pi,
        single=0.5,
        text="größe",
        raw=b"\x00\xff",
        spots=[Spot(1.0), Spot(2.0, Side.Right)],
        array=np.array([1, -2], np.int16),
        three=[1.0, 2.0, 3.0],
        maybe=Spot(4.0),
    )



class TestSchemas(unittest.TestCase):
    def test_a_module_of_message_export_has_the_schema_that_it_was_written_from(self) -> None:
        spec = importlib.util.spec_from_file_location("reading", KEPT / "reading.py")
        assert spec is not None and spec.loader is not None
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
        self.assertEqual(armor.schema_of(module.Reading), (KEPT / "reading.schema").read_text().strip())
        sent = module.Reading(ranges=[1.0], depth=2.0, state=module.State.Busy, names=["a"])
        self.assertEqual(armor.decode(module.Reading, armor.encode(sent)), sent)

    def test_the_standard_messages_have_the_schemas_of_rust(self) -> None:
        expected = SCHEMAS.read_text().split()
        names = [schema.split("{")[0].split("<")[0] for schema in expected]
        given = [armor.schema_of(getattr(messages, name)) for name in names]
        self.assertEqual(given, expected)

    def test_annotations_are_the_schema(self) -> None:
        spot = "Spot{x:f64(m),side:Side<Left,Right>}"
        self.assertEqual(armor.schema_of(Spot), spot)
        self.assertEqual(
            armor.schema_of(Everything),
            f"Everything{{flag:bool,whole:i64,small:u8,number:f64,single:f32,text:string,raw:[u8],"
            f"spots:[{spot}],array:[i16],three:[f64;3],maybe:?{spot},from:string}}",
        )

    def test_what_has_no_schema_is_refused_with_its_name(self) -> None:
        for annotation, why in [
            (dict, "has no schema"),
            (np.ndarray, "NDArray[numpy.float32]"),
            (tuple, "has no schema"),
            (Component, "is not a message: decorate it"),
            (enum.Flag("Lights", "Left Right"), "is an enum.Flag: its combinations have no schema"),
            (enum.Enum("Empty", ""), "has no members"),
            (np.float16, "of numpy use int8 to uint64, float32 and float64"),
            (np.bool_, "of numpy use"),
        ]:
            cls = type("Wrong", (), {"__annotations__": {"field": annotation}})
            with self.assertRaises(armor.MessageError) as raised:
                armor.message(cls)
            self.assertIn("Wrong.field: ", str(raised.exception))
            self.assertIn(why, str(raised.exception))

    def test_a_unit_that_would_have_no_effect_is_refused(self) -> None:
        of_text = Annotated[str, armor.unit("m")]
        alone = Annotated[float, "m/s"]
        for body, why in [
            ({"__annotations__": {"field": of_text}}, "only a number"),
            ({"__annotations__": {"field": alone}}, "armor.unit('m/s')"),
            ({"__annotations__": {"field": float}, "field": armor.unit("m")}, "Annotated[float, "),
        ]:
            with self.assertRaises(armor.MessageError) as raised:
                armor.message(type("Wrong", (), dict(body)))
            self.assertIn(why, str(raised.exception))
        with self.assertRaises(armor.MessageError):
            armor.unit(3)  # type: ignore[arg-type]
        for name in ("furlong", ""):
            with self.assertRaisesRegex(armor.MessageError, f"there is no unit `{name}`; the units are .*m/s"):
                armor.unit(name)
        with self.assertRaisesRegex(armor.MessageError, "did you mean m/s2?"):
            armor.unit("m/s^2")
        self.assertEqual(armor.unit("N·m").name, "N*m", "as schemas have it")
        with self.assertRaises(armor.MessageError) as raised:
            armor.schema_of(3)  # type: ignore[arg-type]
        self.assertIn("not a message class", str(raised.exception))


class TestConversions(unittest.TestCase):
    def test_a_number_that_would_become_another_one_is_refused_with_its_field(self) -> None:
        @armor.message
        class Mixed:
            whole: int = 0
            small: armor.u8 = 0
            number: float = 0.0
            single: armor.f32 = 0.0
            flag: bool = False

        for field, value, why in [
            ("whole", 1.5, "type int is needed, not one of type float"),
            ("whole", math.nan, "not one of type float"),
            ("whole", 2**64, "out of range for int"),
            ("whole", True, "not one of type bool"),
            ("small", 256, "256 is out of range for u8"),
            ("small", -1, "out of range for u8"),
            ("number", True, "type float is needed, not one of type bool"),
            ("number", "1", "not one of type str"),
            ("single", 1e300, "out of range for f32"),
            ("flag", 1, "type bool is needed"),
        ]:
            with self.assertRaises(armor.MessageError, msg=f"{field} = {value}") as raised:
                armor.encode(Mixed(**{field: value}))
            self.assertIn(f"Mixed.{field}: ", str(raised.exception))
            self.assertIn(why, str(raised.exception))
        kept = Mixed(whole=-(2**63), small=np.uint8(255), number=3, single=math.inf)  # type: ignore[arg-type]
        self.assertEqual(armor.decode(Mixed, armor.encode(kept)), kept)

    def test_so_is_one_of_an_array(self) -> None:
        @armor.message
        class Bytes:
            data: NDArray[np.int8]

        for values, why in [
            (np.array([1.5]), "an array of float64 is no array of i8"),
            (np.array([200]), "out of range for i8"),
        ]:
            with self.assertRaises(armor.MessageError) as raised:
                armor.encode(Bytes(values))  # type: ignore[arg-type]
            self.assertIn("Bytes.data: ", str(raised.exception))
            self.assertIn(why, str(raised.exception))
        self.assertEqual(armor.encode(Bytes(np.array([-5])))[8:], b"\xfb")  # type: ignore[arg-type]

    def test_an_array_that_would_lose_numbers_is_refused(self) -> None:
        @armor.message
        class Depths:
            data: NDArray[np.float32]

        masked = np.ma.array([1, 2], mask=[False, True], dtype=np.float32)
        with np.errstate(over="ignore"):
            for values, why in [
                (np.array([1.0, 1e300]), "a number of the array is out of range for f32"),
                (masked, "some numbers of the array are masked; give them a value: array.filled(0)"),
            ]:
                with self.assertRaises(armor.MessageError) as raised:
                    armor.encode(Depths(values))  # type: ignore[arg-type]
                self.assertEqual(str(raised.exception), f"Depths.data: {why}")
        kept = np.array([np.inf, -np.inf, np.nan, 0.5])
        back = armor.decode(Depths, armor.encode(Depths(kept))).data  # type: ignore[arg-type]
        self.assertTrue(np.array_equal(back, kept, equal_nan=True))
        self.assertEqual(list(armor.decode(Depths, armor.encode(Depths(masked.filled(0)))).data), [1, 0])

    def test_a_list_for_an_array_keeps_its_numbers_or_is_refused_with_its_field(self) -> None:
        for values, why in [
            ([300], "OccupancyGrid.data: 300 is out of range for int8"),
            ([1.5], "OccupancyGrid.data: float64 values are no int8"),
            ([math.nan], "OccupancyGrid.data: float64 values are no int8"),
            ([b"1"], "OccupancyGrid.data: |S1 values are no int8"),
        ]:
            with self.assertRaises(armor.MessageError) as raised:
                messages.OccupancyGrid(data=values)
            self.assertIn(why, str(raised.exception))
        with self.assertRaises(armor.MessageError) as raised:
            LaserScan(ranges=[1e300])
        self.assertIn("LaserScan.ranges: 1e+300 is out of range", str(raised.exception))
        with self.assertRaises(armor.MessageError):
            LaserScan(ranges=[True])
        self.assertEqual(list(LaserScan(ranges=[1, 2.5]).ranges), [1.0, 2.5])
        self.assertEqual(LaserScan(ranges=[]).ranges.dtype, np.float32)

    def test_a_misspelt_field_is_refused_with_its_name(self) -> None:
        with self.assertRaisesRegex(TypeError, "'y_m'"):
            Spot(y_m=1.0)  # type: ignore[call-arg]
        spot = Spot(1.0)
        with self.assertRaisesRegex(AttributeError, "xx"):
            spot.xx = 2.0  # type: ignore[attr-defined]
        with self.assertRaisesRegex(AttributeError, "rangs"):
            LaserScan().rangs = []  # type: ignore[attr-defined]

        @armor.message
        class Derived(Spot):
            y: float = 0.0

        derived = Derived(1.0, y=2.0)
        derived.y = 3.0
        with self.assertRaisesRegex(AttributeError, "z"):
            derived.z = 1.0  # type: ignore[attr-defined]
        self.assertEqual(armor.decode(Derived, armor.encode(derived)), derived)
        self.assertEqual(pickle.loads(pickle.dumps(spot)), spot)


class Component:
    """No message."""


class TestBytes(unittest.TestCase):
    def test_a_message_comes_back_as_it_was(self) -> None:
        data = everything()
        back = armor.decode(Everything, armor.encode(data))
        self.assertEqual(back, data)
        data.maybe = None
        back = armor.decode(Everything, armor.encode(data))
        self.assertIsNone(back.maybe)
        self.assertNotEqual(back, everything())

    def test_the_bytes_are_those_of_the_protocol(self) -> None:
        self.assertEqual(armor.encode(Spot(1.0, Side.Right)), b"\0\0\0\0\0\0\xf0\x3f\1\0\0\0")
        scan = LaserScan(ranges=[1.0])
        self.assertEqual(armor.encode(scan)[-12:], b"\1\0\0\0\0\0\0\0\0\0\x80\x3f")

    def test_arrays_are_views_on_the_received_bytes(self) -> None:
        image = armor.decode(Image, armor.encode(Image(data=np.arange(200, dtype=np.uint8))))
        self.assertEqual(image.data.sum(), sum(range(200)))
        self.assertFalse(image.data.flags.writeable)
        self.assertFalse(image.data.flags.owndata)
        with self.assertRaises(ValueError):
            image.data[0] = 1
        kept = image.data[100:]
        del image
        self.assertEqual(kept[0], 100)

    def test_any_array_of_the_numbers_can_be_sent(self) -> None:
        square = np.arange(12, dtype=np.uint8).reshape(3, 4)
        for data, expected in [
            (square, list(range(12))),
            (square.T, list(square.T.reshape(-1))),
            (square[::2], [0, 1, 2, 3, 8, 9, 10, 11]),
            (b"\1\2", [1, 2]),
            (bytearray(b"\1\2"), [1, 2]),
            ([1, 2], [1, 2]),
            (np.zeros(0, np.uint8), []),
            (np.array([True]), [1]),
            (np.arange(9000, dtype=np.uint8), [n % 256 for n in range(9000)]),
        ]:
            image = Image()
            image.data = data  # type: ignore[assignment]
            self.assertEqual(list(armor.decode(Image, armor.encode(image)).data), expected)
        wide = LaserScan()
        wide.ranges = np.array([0.5, 1.5])  # type: ignore[assignment]
        self.assertEqual(list(armor.decode(LaserScan, armor.encode(wide)).ranges), [0.5, 1.5])
        for wrong in (np.array([300]), np.array([0.5]), "text", None, 7):
            image.data = wrong  # type: ignore[assignment]
            with self.assertRaises(armor.MessageError, msg=repr(wrong)) as raised:
                armor.encode(image)
            self.assertTrue(str(raised.exception).startswith("Image.data: "), raised.exception)

    def test_a_wrong_value_is_named_by_its_path(self) -> None:
        data = everything()
        for change, expected in [
            (lambda it: setattr(it, "whole", 1.5), "Everything.whole: a value of type int"),
            (lambda it: setattr(it, "small", 256), "Everything.small: 256 is out of range for u8"),
            (lambda it: setattr(it, "flag", 1), "Everything.flag: a value of type bool is needed"),
            (lambda it: setattr(it, "text", b"x"), "Everything.text: a value of type str is needed"),
            (lambda it: setattr(it.spots[1], "x", "1"), "Everything.spots[1].x: a value of type float"),
            (lambda it: setattr(it, "three", [1.0]), "Everything.three: it has 1 values; 3 are needed"),
            (lambda it: setattr(it.maybe, "side", 0), "Everything.maybe.side: a value of type Side"),
            (lambda it: delattr(it, "number"), "Everything.number: "),
        ]:
            data = everything()
            change(data)
            with self.assertRaises(armor.MessageError) as raised:
                armor.encode(data)
            self.assertIn(expected, str(raised.exception))

    def test_bytes_that_are_no_message_are_refused(self) -> None:
        good = armor.encode(everything())
        for cut in range(len(good)):
            with self.assertRaises(armor.MessageError):
                armor.decode(Everything, good[:cut])
        with self.assertRaises(armor.MessageError):
            armor.decode(Everything, good + b"\0")
        huge = (2**63).to_bytes(8, "little")
        with self.assertRaises(armor.MessageError):
            armor.decode(messages.Text, huge)

    def test_standard_messages_have_defaults_and_can_be_compared_and_pickled(self) -> None:
        self.assertEqual(Twist(), Twist(Vector3(), Vector3()))
        self.assertNotEqual(Twist(), Twist(Vector3(x=1.0)))
        self.assertEqual(Quaternion().w, 1.0)
        self.assertAlmostEqual(Quaternion.from_yaw(1.0).yaw_rad(), 1.0)
        self.assertEqual(len(Odometry().pose.covariance), 36)
        self.assertEqual(messages.BatteryState().power_supply_status, PowerSupplyStatus.Unknown)
        scan = LaserScan(ranges=[1.0, 2.0], frame="laser")
        self.assertEqual(pickle.loads(pickle.dumps(scan)), scan)
        self.assertIn("frame='laser'", repr(scan))


if __name__ == "__main__":
    unittest.main()
