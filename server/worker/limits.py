"""Limits of a process that does a session's work: memory, CPU time, files; so that it can only ruin itself."""

import resource
import signal
import sys
from pathlib import Path

__all__ = ["confine"]

OPEN_FILES = 256


def confine(*, memory_bytes: int, cpu_seconds: int) -> None:
    """Limit this process for good.

    Args:
        memory_bytes: Address space on top of what it has now, since most of that is shared with its siblings.
        cpu_seconds: CPU time from now on, after which the kernel ends it.
    """
    # Ctrl-C in a terminal reaches the whole group; ending the workers is the web process's business.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    resource.setrlimit(resource.RLIMIT_CPU, (cpu_seconds, cpu_seconds + 5))
    resource.setrlimit(resource.RLIMIT_NOFILE, (OPEN_FILES, OPEN_FILES))
    if sys.platform == "linux":
        pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[0])
        total = pages * resource.getpagesize() + memory_bytes
        resource.setrlimit(resource.RLIMIT_AS, (total, total))
