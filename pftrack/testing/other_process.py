"""Another process, which computes saved runs: one for all checks, since a fresh interpreter takes a second."""

import atexit
import json
import os
import subprocess
import sys
from collections.abc import Sequence
from functools import cache

from pftrack.testing.check import CheckError

__all__ = ["hashes_elsewhere"]

CHILD = """
import json, os, sys
from pathlib import Path
from pftrack.runs.record import load
answers = os.fdopen(os.dup(1), "w")
os.dup2(os.open(os.devnull, os.O_WRONLY), 1)  # what an experiment prints is no answer
for line in sys.stdin:
    told = {"hashes": [], "problem": ""}
    try:
        for name in json.loads(line):
            run = load(Path(name))
            run.finish()
            told["hashes"].append(run.estimates_sha256)
    except Exception as error:
        told["problem"] = f"{type(error).__name__}: {error}"
    print(json.dumps(told), file=answers, flush=True)
"""


def hashes_elsewhere(paths: Sequence[str]) -> list[str]:
    """Return the hashes of the estimates that saved runs come to in another process.

    Args:
        paths: Of the files.

    Raises:
        CheckError: It cannot compute them.
    """
    process = _started(frozenset(os.environ.items()))
    try:
        print(json.dumps(list(paths)), file=process.stdin, flush=True)
        line = process.stdout.readline() if process.stdout else ""
    except OSError:
        line = ""
    if not line:
        _started.cache_clear()
        raise CheckError(f"another process cannot compute the run: it ended with status {process.wait()}")
    told = json.loads(line)
    if told["problem"]:
        raise CheckError(f"another process cannot compute the run: {told['problem']}")
    return [str(each) for each in told["hashes"]]


@cache
def _started(environment: frozenset[tuple[str, str]]) -> "subprocess.Popen[str]":
    """Start a process in an environment; it ends when nobody can ask it any more."""
    process = subprocess.Popen(  # noqa: S603 - this very Python
        [sys.executable, "-c", CHILD], env=dict(environment), stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    atexit.register(process.communicate)
    return process
