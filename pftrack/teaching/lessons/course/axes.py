"""Ends of axes that seldom change while a slider is turned."""

import math


def ceiling(value: float) -> float:
    """Return the next of 1, 1.5, 2, 3, 5, 7 and their powers of ten that is no less than a positive value."""
    power = 10.0 ** math.floor(math.log10(value))
    return next(factor * power for factor in (1.0, 1.5, 2.0, 3.0, 5.0, 7.0, 10.0) if value <= factor * power)
