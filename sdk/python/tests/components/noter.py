#!/usr/bin/env python3
"""Reads data to which no link leads."""

import armor


class Noter(armor.Component):
    """Notes the counts of the talker, as a recorder does."""

    reads_all = True

    def exec(self, call: armor.Call) -> None:
        if call == armor.Call.TICK:
            with armor.observe() as system:
                for _, count in system.read("talker.count", 3, timeout=20.0):
                    print("noted", count.count)


if __name__ == "__main__":
    armor.run(Noter)
