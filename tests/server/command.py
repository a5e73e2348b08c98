"""The command `serve` in a process of its own, for tests of what happens to whole processes."""

import json
import os
import re
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).parents[2]
PATH = os.pathsep.join(map(str, (ROOT, ROOT / "server")))
PROGRAM = """
import os
from pathlib import Path
from pftrack_server.command import serve
from pftrack_server.core.processes import FORK_SERVER
FORK_SERVER.preload = "tests.server.few_ready"
{}
serve({})
"""

REFUSING = """
import json, os, signal, sys
from pathlib import Path
from pftrack_server.web import serving
from pftrack_server.command import serve
for arguments, first, _ in json.load(sys.stdin):
    ours, theirs = os.pipe()
    child = os.fork()
    if not child:
        os.dup2(theirs, 1)
        os.dup2(theirs, 2)
        signal.alarm(200)
        try:
            exec(first)
            exec(f"serve({arguments})")
        finally:
            ended = sys.exception()
            sys.stderr.flush()
            os._exit(ended.code if isinstance(ended, SystemExit) else 99)
    os.close(theirs)
    with os.fdopen(ours) as said:
        words = said.read()
    # At once: what waits in a buffer would be written by the next child as well.
    print(json.dumps([os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), words]), flush=True)
"""


@contextmanager
def serving(arguments: str, first: str = "pass", **variables: str) -> Iterator[subprocess.Popen[str]]:
    """Run `pftrack serve` with these arguments and environment variables for as long as the context lasts.

    Its workers are quick to begin with the ball, and with little else.

    Args:
        arguments: As Python.
        first: Python that is carried out in the process before.
        variables: Environment variables.
    """
    environment = {**os.environ, "PYTHONPATH": PATH, **variables}
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


class Wish(NamedTuple):
    """A server that cannot start.

    Attributes:
        arguments: Of `serve`, as Python.
        first: Python that is carried out in the process before.
        status: With which it ends.
    """

    arguments: str
    first: str = "pass"
    status: int = 1


def refused(*wishes: Wish) -> list[str]:
    """Return what servers say that cannot start, one line each; each runs in a fork of one process."""
    told = subprocess.run(
        [sys.executable, "-c", REFUSING],
        input=json.dumps(wishes),
        capture_output=True,
        text=True,
        timeout=280,
        check=True,
        env={**os.environ, "PYTHONPATH": PATH},
    )
    answers = [json.loads(line) for line in told.stdout.splitlines()]
    ends = [(status, len(words.strip().splitlines())) for status, words in answers]
    assert ends == [(wish.status, 1) for wish in wishes], told
    return [words for _, words in answers]


def link(process: subprocess.Popen[str]) -> str:
    """Return the address that a server prints when it can be reached."""
    line = process.stdout.readline()
    found = re.search(r"http://\S+", line)
    assert found, line
    return found.group()
