"""Limits set by the shell (`ulimit`): checked when the server starts, and named when they are reached.

The operating system hardly explains its limits: it kills a process, or a file cannot be opened.
"""

import resource
import signal
from collections.abc import Callable

MEBIBYTE = 1024 * 1024
LEAST_OPEN_FILES = 256
USUAL_OPEN_FILES = 8192
"""Wanted limit of open files: 200 followers of a comparison of four hold 1,800 connections."""
FILES_SHARE = 0.5
"""Share of the open files for browsers; workers, uploads and the database need the rest."""
# Time between the signal that warns and the signal that cannot be caught.
LAST_WORDS_S = 5


def too_few_files() -> str | None:
    """Raise the limit of open files to what a class needs; return a message if the shell allows too few."""
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    most = USUAL_OPEN_FILES if hard == resource.RLIM_INFINITY else min(hard, USUAL_OPEN_FILES)
    if soft < most:
        resource.setrlimit(resource.RLIMIT_NOFILE, (most, hard))
    if most < LEAST_OPEN_FILES:
        return (
            f"The open-file limit (ulimit -n) is {most}, and the server needs at least {LEAST_OPEN_FILES}; "
            "raise it, as with `ulimit -n 1024`, and start again."
        )
    return None


def most_connections() -> int:
    """Return the most connections of the process, from its limit of open files."""
    files, _ = resource.getrlimit(resource.RLIMIT_NOFILE)
    return max(int(FILES_SHARE * files), 16)


def notices() -> list[str]:
    """Return a sentence for each limit that may be reached."""
    found = []
    _, cpu = resource.getrlimit(resource.RLIMIT_CPU)
    if cpu != resource.RLIM_INFINITY:
        found.append(f"The processor time limit (ulimit -t) is {cpu} s; a server or a session that reaches it stops")
    length, _ = resource.getrlimit(resource.RLIMIT_FSIZE)
    if length != resource.RLIM_INFINITY:
        found.append(f"The file size limit (ulimit -f) is {mebibytes(length)}; larger files are refused")
    return found


def allowed_cpu_seconds(wanted: int) -> int | None:
    """Return the processor time that the shell allows a child (s), or None if that is at least `wanted`."""
    _, cpu = resource.getrlimit(resource.RLIMIT_CPU)
    return cpu if cpu != resource.RLIM_INFINITY and cpu < wanted else None


def name_cpu_limit(stop: Callable[[str], None]) -> None:
    """Call `stop` with a sentence shortly before this process uses up its processor time."""
    soft, hard = resource.getrlimit(resource.RLIMIT_CPU)
    if hard == resource.RLIM_INFINITY:
        return
    sentence = (
        f"The server used up the {hard} s of processor time that its shell allows (ulimit -t) and stops; "
        "start it again, and its sessions continue where they were."
    )
    signal.signal(signal.SIGXCPU, lambda *_: stop(sentence))
    resource.setrlimit(resource.RLIMIT_CPU, (min(soft, max(hard - LAST_WORDS_S, 1)), hard))


def mebibytes(count: int) -> str:
    """Return a number of bytes as text in MiB."""
    return f"{count / MEBIBYTE:{',.0f' if count >= 1000 * MEBIBYTE else '.4g'}} MiB"
