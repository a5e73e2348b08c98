"""Calls of the command line, a clip, and the check of a failure."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

Call = Callable[..., tuple[int, str, str]]
"""Arguments -> status, standard output, standard error."""

Ask = Callable[..., Any]
"""Arguments -> the JSON value of a successful call."""

FRAMES = 12
"""Number of frames of the clip of a red square."""


def on_clip(clip: Path, *more: object) -> tuple[object, ...]:
    return "run", "ball", "--video", clip, "--box", "20,30,10,8", *more


def refused(result: tuple[int, str, str], status: int, *parts: str) -> None:
    """Check a failure: its status, nothing on standard output, one line without a traceback on standard error."""
    code, out, err = result
    assert (code, out) == (status, ""), err
    assert err.startswith("pftrack: ")
    assert err.count("\n") == 1, err
    for part in parts:
        assert part in err
