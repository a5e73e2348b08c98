"""Secrets: what a program is told by its environment, and no other process may see."""

import os
import sys
from contextlib import suppress

PIPE = "_PIPE"
"""Ends the name of the variable that tells the program that begins anew from which descriptor to read."""


def take_secret(name: str) -> str | None:
    """Return a variable of the environment, from which it is gone then; None if there is none.

    Processes of the same user can read with which environment a program has begun, and a fork has it as well. So where
    the variable is set, the program begins anew without it, and reads it from a pipe. Call this before anything else.
    """
    secret = os.environ.pop(name, None)
    if secret is not None:
        reading, writing = os.pipe()
        os.set_blocking(writing, False)
        with suppress(BlockingIOError):  # longer than a pipe takes at once, and than any secret is
            os.write(writing, secret.encode())
        os.close(writing)
        os.set_inheritable(reading, True)
        os.environ[name + PIPE] = str(reading)
        os.execv(sys.executable, [sys.executable, *sys.orig_argv[1:]])  # noqa: S606 - this very program
    pipe = os.environ.pop(name + PIPE, None)
    if pipe is None:
        return None
    with os.fdopen(int(pipe), encoding="utf-8") as reading_end:
        return reading_end.read()
