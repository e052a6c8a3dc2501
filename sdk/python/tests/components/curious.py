#!/usr/bin/env python3
"""Reads data to which no link leads, and does not declare it."""

from noter import Noter

import armor


class Curious(Noter):
    """The noter without its declaration."""

    reads_all = False


if __name__ == "__main__":
    armor.run(Curious)
