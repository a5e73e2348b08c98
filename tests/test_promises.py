"""What versions 1 promise stays: formats, columns, REST, the interface of experiments, commands and their answers."""

import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from tests import promises

PROMISED = json.loads((Path(__file__).parent / "data" / "promises.json").read_text())
DEMANDS = {"required"}
"""More of these would refuse what a client sends today."""


def test_all_that_is_promised_is_there() -> None:
    """Nothing that is stored is missing or different; additions are allowed, and are stored with a release."""
    now = json.loads(json.dumps(promises.promises()))
    assert list(broken(PROMISED, now)) == []


def test_a_broken_promise_is_found() -> None:
    """What is missing, of another value, or demanded in addition, is told with its place."""
    before = {"a": {"x": 1, "y": [1, 2]}, "required": {"S": ["f"]}}
    assert list(broken(before, {**before, "b": 2})) == []
    found = [
        *broken(before, {"a": {"x": 2, "y": [2]}, "required": {"S": ["f", "g"]}}),
        *broken(before, {"a": before["a"]}),
    ]
    assert found == ["a/x was 1, is 2", "a/y has lost 1", "required/S demands g", "required is gone"]


def broken(before: Any, after: Any, place: str = "") -> Iterator[str]:
    """Yield each promise that is not kept, in words."""
    if isinstance(before, Mapping):
        for name, value in before.items():
            inner = f"{place}/{name}".lstrip("/")
            if not isinstance(after, Mapping) or name not in after:
                yield f"{inner} is gone"
            else:
                yield from broken(value, after[name], inner)
    elif isinstance(before, list) and isinstance(after, list):
        yield from (f"{place} has lost {each}" for each in before if each not in after)
        if place.split("/", maxsplit=1)[0] in DEMANDS:
            yield from (f"{place} demands {each}" for each in after if each not in before)
    elif before != after:
        yield f"{place} was {before}, is {after}"
