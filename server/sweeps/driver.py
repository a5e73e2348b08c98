"""The driver: what runs in the process that computes a sweep. It is the command line, kept on a lead by the server.

The server holds the other end of this process's standard input. When the server is gone, however it went, the pipe
closes, and the sweep stops as if somebody had pressed Ctrl-C: what was computed is kept. Sweeps give way to sessions,
which people watch.
"""

import os
import resource
import signal
import sys
import threading

from pftrack.cli.app import main

__all__: list[str] = []

NICENESS = 10


def _follow() -> None:
    """Stop when the server lets go of the pipe."""
    while os.read(0, 1024):
        pass
    os.kill(os.getpid(), signal.SIGTERM)


def _confine(largest_file: int) -> None:
    """Limit what this process and its workers may do to the machine."""
    os.nice(NICENESS)
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    resource.setrlimit(resource.RLIMIT_FSIZE, (largest_file, largest_file))


if __name__ == "__main__":
    _confine(int(sys.argv[1]))
    threading.Thread(target=_follow, name="follow", daemon=True).start()
    sys.argv = ["pftrack", "sweep", *sys.argv[2:]]
    main()
