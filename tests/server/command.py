"""The command `serve` in a process of its own, for tests of what happens to whole processes."""

import json
import os
import re
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

ROOT = Path(__file__).parents[2]
PROGRAM = "{}; import sys; from server.command import serve; from pathlib import Path; serve({})"

REFUSING = """
import contextlib, io, json
from pathlib import Path
from server.command import serve
for wish in [{}]:
    with contextlib.redirect_stderr(io.StringIO()) as said:
        try:
            status = serve(**wish)
        except SystemExit as end:
            status = end.code
    print(json.dumps([status, said.getvalue()]))
"""


@contextmanager
def serving(arguments: str, first: str = "pass", **variables: str) -> Iterator[subprocess.Popen[str]]:
    """Run `pftrack serve` with these arguments and environment variables for as long as the context lasts.

    Args:
        arguments: As Python.
        first: Python that is carried out in the process before.
        variables: Environment variables.
    """
    environment = {**os.environ, "PYTHONPATH": str(ROOT), **variables}
    with subprocess.Popen(
        [sys.executable, "-c", PROGRAM.format(first, arguments)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env=environment,
    ) as process:
        try:
            yield process
        finally:
            process.kill()


def failing(arguments: str, status: int = 1, first: str = "pass", **variables: str) -> str:
    """Return what a server that cannot start says, which is one line."""
    with serving(arguments, first, **variables) as process:
        out, err = process.communicate(timeout=60)
    assert process.returncode == status
    assert out == ""
    assert len(err.strip().splitlines()) == 1, err
    return err


def refused(*wishes: str, status: int = 1) -> list[str]:
    """Return what servers say that cannot start, one line each; they are tried one after the other in one process.

    Args:
        wishes: The arguments of each, as Python.
        status: With which each ends.
    """
    tried = ", ".join(f"dict({wish})" for wish in wishes)
    told = subprocess.run(
        [sys.executable, "-c", REFUSING.format(tried)],
        capture_output=True,
        text=True,
        timeout=60,
        check=True,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
    )
    answers = [json.loads(line) for line in told.stdout.splitlines()]
    assert [(answer[0], len(answer[1].strip().splitlines())) for answer in answers] == [(status, 1)] * len(wishes), told
    return [said for _, said in answers]


def link(process: subprocess.Popen[str]) -> str:
    """Return the address that a server prints when it can be reached."""
    assert process.stdout is not None
    line = process.stdout.readline()
    found = re.search(r"http://\S+", line)
    assert found, line
    return found.group()
