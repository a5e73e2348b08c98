"""What the tests of the command line share: a call's type, the clip's length, and how a failure is checked."""

from collections.abc import Callable

Call = Callable[..., tuple[int, str, str]]
"""Arguments -> status, standard output, standard error."""

FRAMES = 12
"""Of the clip of a red square."""


def refused(result: tuple[int, str, str], status: int, *parts: str) -> None:
    """Check a failure: its status, nothing on standard output, one line without a traceback on standard error."""
    code, out, err = result
    assert (code, out) == (status, ""), err
    assert err.startswith("pftrack: ")
    assert err.count("\n") == 1, err
    for part in parts:
        assert part in err
