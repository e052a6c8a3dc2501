"""Components for Armor, a robot framework: twelve functions, in Python.

    import armor
    from armor.messages import LaserScan, Twist, Vector3


    class Follower(armor.Component):
        \"\"\"Follows the nearest thing that the laser sees.\"\"\"

        speed = armor.parameter(0.3, unit="m/s", range=(0.0, 1.0), live=True, doc="forward speed")

        def __init__(self) -> None:
            self.provide("velocity", Twist)
            self.subscribe("scan", LaserScan)

        def exec(self, call: armor.Call) -> None:
            self.send_data("velocity", Twist(linear=Vector3(x=self.speed)))


    if __name__ == "__main__":
        armor.run(Follower)

The standard messages are in `armor.messages`, tests by hand in `armor.testing`.
"""

from armor._armor import (
    ArmorError,
    Call,
    DeclareError,
    Header,
    MessageError,
    Outcome,
    SendError,
    TestError,
)
from armor._component import (
    CARRY_ON,
    DONE,
    Component,
    DeclaredEvent,
    describe,
    event,
    failed,
    parameter,
    run,
)
from armor._message import (
    Message,
    decode,
    encode,
    f32,
    f64,
    fixed,
    i8,
    i16,
    i32,
    i64,
    message,
    schema_of,
    u8,
    u16,
    u32,
    u64,
    unit,
)

__all__ = [
    "CARRY_ON",
    "DONE",
    "ArmorError",
    "Call",
    "Component",
    "DeclareError",
    "DeclaredEvent",
    "Header",
    "Message",
    "MessageError",
    "Outcome",
    "SendError",
    "TestError",
    "decode",
    "describe",
    "encode",
    "event",
    "f32",
    "f64",
    "failed",
    "fixed",
    "i16",
    "i32",
    "i64",
    "i8",
    "message",
    "parameter",
    "run",
    "schema_of",
    "u16",
    "u32",
    "u64",
    "u8",
    "unit",
]
