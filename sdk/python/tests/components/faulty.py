#!/usr/bin/env python3
"""Does what no component should: it raises, hangs, dies or floods its log."""

import ctypes
import os
import pathlib
import sys
import threading

import armor
from armor.messages import Count


class Faulty(armor.Component):
    """Goes wrong in one way."""

    way = armor.parameter(
        "raise",
        choices=("raise", "hang", "hold", "abort", "segfault", "print", "thread", "exit", "long", "fork"),
    )
    mark = armor.parameter(pathlib.Path("mark"), written=True)

    def __init__(self) -> None:
        self.provide("count", Count)
        self.count = 0

    def exec(self, call: armor.Call) -> None:
        self.count += 1
        self.send_data("count", Count(count=self.count))
        if self.count == 5:
            getattr(self, f"do_{self.way}")()

    def do_raise(self) -> None:
        raise RuntimeError("on purpose")

    def do_hang(self) -> None:
        while True:
            pass

    def do_hold(self) -> None:
        # A call by PyDLL keeps Python's lock: no other thread of Python runs meanwhile.
        ctypes.PyDLL(None).sleep(4)
        print("the lock was held")

    def do_abort(self) -> None:
        if self.is_first_time():
            os.abort()

    def do_segfault(self) -> None:
        # In the C code of an extension of Python.
        if self.is_first_time():
            ctypes.string_at(1)

    def is_first_time(self) -> bool:
        """Whether the process was not started again; components share the folder of the run."""
        mark = self.mark.with_name(self.way)
        is_first = not mark.exists()
        mark.touch()
        return is_first

    def do_print(self) -> None:
        line = "x" * 99
        for _ in range(1_000_000):
            print(line)

    def do_thread(self) -> None:
        def work() -> None:
            raise RuntimeError("in a thread")

        threading.Thread(target=work, name="worker").start()

    def do_long(self) -> None:
        raise RuntimeError("so long " * 500_000)

    def do_fork(self) -> None:
        child = os.fork()
        if child == 0:
            try:
                self.send_data("count", Count(count=0))
            except armor.ArmorError as error:
                print("the fork:", error, flush=True)
            sys.exit(7)
        print("the fork ended with", os.waitpid(child, 0)[1] >> 8)
        child = os.fork()
        if child == 0:
            return
        print("the second fork ended with", os.waitpid(child, 0)[1] >> 8)

    def do_exit(self) -> None:
        sys.exit(3)


if __name__ == "__main__":
    armor.run(Faulty)
