"""Limits that the shell has set (`ulimit`): looked at when the server starts, and named when they hit.

A limit of the operating system speaks in its own words, if at all: a process is simply killed, a file cannot be opened.
"""

import resource
import signal
from collections.abc import Callable

MEBIBYTE = 1024 * 1024
LEAST_OPEN_FILES = 256
USUAL_OPEN_FILES = 8192
"""A class of 200 that follows a comparison of four holds 1,800 connections."""
FILES_SHARE = 0.5
"""Share of the process's files that browsers may have; the others belong to workers, uploads and the database."""
# Between the signal that tells that the time is over and the one that cannot be caught.
LAST_WORDS_S = 5


def too_few_files() -> str | None:
    """Allow this process as many open files as a class needs, and say what is wrong if it may not have enough."""
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    most = USUAL_OPEN_FILES if hard == resource.RLIM_INFINITY else min(hard, USUAL_OPEN_FILES)
    if soft < most:
        resource.setrlimit(resource.RLIMIT_NOFILE, (most, hard))
    if most < LEAST_OPEN_FILES:
        return (
            f"This shell allows a process {most} open files (ulimit -n), and the server needs at least "
            f"{LEAST_OPEN_FILES}; raise it, as with `ulimit -n 1024`, and start again."
        )
    return None


def most_connections() -> int:
    """Return how many connections the process may have, by its limit of open files."""
    files, _ = resource.getrlimit(resource.RLIMIT_NOFILE)
    return max(int(FILES_SHARE * files), 16)


def notices() -> list[str]:
    """Return a sentence for each limit that will sooner or later be felt."""
    found = []
    _, cpu = resource.getrlimit(resource.RLIMIT_CPU)
    if cpu != resource.RLIM_INFINITY:
        found.append(
            f"This shell allows a process {cpu} s of processor time (ulimit -t); then the server stops, or a session"
        )
    length, _ = resource.getrlimit(resource.RLIMIT_FSIZE)
    if length != resource.RLIM_INFINITY:
        found.append(f"This shell allows files of at most {mebibytes(length)} (ulimit -f); longer ones are refused")
    return found


def allowed_cpu_seconds(wanted: int) -> int | None:
    """Return how much processor time the shell allows a child, where that is less than it is meant to have."""
    _, cpu = resource.getrlimit(resource.RLIMIT_CPU)
    return cpu if cpu != resource.RLIM_INFINITY and cpu < wanted else None


def name_cpu_limit(stop: Callable[[str], None]) -> None:
    """Have `stop` called, with a sentence, shortly before this process has used up its processor time."""
    soft, hard = resource.getrlimit(resource.RLIMIT_CPU)
    if hard == resource.RLIM_INFINITY:
        return
    sentence = (
        f"The server has used up the {hard} s of processor time that its shell allows (ulimit -t), and stops; "
        "start it again, and its sessions continue where they were."
    )
    signal.signal(signal.SIGXCPU, lambda *_: stop(sentence))
    resource.setrlimit(resource.RLIMIT_CPU, (min(soft, max(hard - LAST_WORDS_S, 1)), hard))


def mebibytes(count: int) -> str:
    """Return a number of bytes as people read it."""
    return f"{count / MEBIBYTE:{',.0f' if count >= 1000 * MEBIBYTE else '.4g'}} MiB"
