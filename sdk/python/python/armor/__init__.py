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

The standard messages are in `armor.messages`, tests by hand in `armor.testing`; `armor.observe` is for scripts
and notebooks that look at a running system.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from armor._armor import (
    AnyMessage,
    ArmorError,
    Call,
    DeclareError,
    EndedError,
    Header,
    History,
    MessageError,
    Outcome,
    Past,
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
from armor._parameter import parameter

if TYPE_CHECKING:
    from armor._observe import Observer


def observe(address: str = "") -> Observer:
    """Connects to a running system: its name, or the address of its registry, `"127.0.0.1:7411"`. Empty: in
    a component, its own system; else that of `ARMOR_REGISTRY`, or the only one that runs on this host.

        with armor.observe("office") as system:
            for header, odometry in system.read("simulator.odometry", 10):
                print(header.stamp_s, odometry.pose.pose.position.x)
    """
    # A component does not need it, and starts without it.
    from armor._observe import Observer

    return Observer(address)


__all__ = [
    "CARRY_ON",
    "DONE",
    "AnyMessage",
    "ArmorError",
    "Call",
    "Component",
    "DeclareError",
    "DeclaredEvent",
    "EndedError",
    "Header",
    "History",
    "Message",
    "MessageError",
    "Outcome",
    "Past",
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
    "observe",
    "parameter",
    "run",
    "schema_of",
    "u16",
    "u32",
    "u64",
    "u8",
    "unit",
]
