"""Numbers that are too long: where in a body one stands that has more digits than Python reads."""

import json
import sys
from typing import Any

TOO_LONG = object()


def field_of_long_number(body: bytes) -> str | None:
    """Return the name of the first field whose whole number has too many digits; None if there is none."""
    most = sys.get_int_max_str_digits()

    def read(digits: str) -> object:
        return TOO_LONG if most and len(digits.lstrip("-")) > most else 0

    try:
        found = _find(json.loads(body, parse_int=read), ())
    except (ValueError, RecursionError):
        return None
    return None if found is None else ".".join(found)


def _find(value: Any, place: tuple[str, ...]) -> tuple[str, ...] | None:  # noqa: ANN401 - any JSON
    if value is TOO_LONG:
        return place
    members = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    below = (_find(member, (*place, str(name))) for name, member in members)
    return next((found for found in below if found is not None), None)
