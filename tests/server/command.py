"""The command `serve` in a process of its own, for tests of whole processes."""

import os
import re
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

ROOT = Path(__file__).parents[2]
PATH = os.pathsep.join(map(str, (ROOT, ROOT / "server")))
PROGRAM = """
from pathlib import Path
from pftrack_server.command import serve
{}
serve({})
"""


@contextmanager
def serve(arguments: str, first: str = "pass", **variables: str) -> Iterator[subprocess.Popen[str]]:
    """Run `pftrack serve` with these arguments and environment variables for as long as the context lasts.

    Args:
        arguments: Arguments of `serve` as Python.
        first: Python that the process runs before.
        variables: Environment variables.
    """
    with subprocess.Popen(
        [sys.executable, "-c", PROGRAM.format(first, arguments)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONPATH": PATH, **variables},
    ) as process:
        try:
            yield process
        finally:
            process.kill()


def link(process: subprocess.Popen[str]) -> str:
    """Return the address that a server prints when it can be reached."""
    line = process.stdout.readline()
    found = re.search(r"http://\S+", line)
    assert found, line
    return found.group()
