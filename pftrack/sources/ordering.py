"""Natural order: the order in which people number their files, `2.png` before `10.png`."""

import re

__all__ = ["natural_order"]


def natural_order(name: str) -> tuple[tuple[int, str], ...]:
    """Return a sorting key under which runs of digits count as numbers, and letters' case does not matter."""
    parts = re.split(r"(\d+)", name.casefold(), flags=re.ASCII)
    return (*((int(part), "") if part.isdecimal() else (-1, part) for part in parts), (-2, name))
