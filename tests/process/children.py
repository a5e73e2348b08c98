"""What children do in tests, apart from the tests: each child imports this, which takes it a moment."""

import os
import signal
import socket
import time
from collections.abc import Generator
from pathlib import Path

from pftrack.process import BlockingEnd, end_with_parent, report
from pftrack.process.calls import TELL_S

LOADED: list[str] = []


def obey(end: socket.socket) -> None:
    """Say who this is, then end as told."""
    pipe = BlockingEnd(end)
    pipe.send((os.getpid(), os.getppid(), os.getpgid(0), signal.getsignal(signal.SIGTERM) == signal.SIG_DFL))
    match pipe.receive():
        case "exit":
            os._exit(3)
        case "fail":
            raise RuntimeError("on purpose")
        case "hang":
            time.sleep(60)


def leave_another(end: socket.socket, *killing: object, apart: bool = False) -> None:
    """Start another process in a group of its own, say its number, and end as told, or end the fork server at once."""
    os.setsid()
    end_with_parent()
    other = os.fork()
    if other == 0:
        end.close()
        if apart:
            os.setsid()
        signal.pause()
    pipe = BlockingEnd(end)
    pipe.send(other)
    if killing:
        os.kill(os.getppid(), signal.SIGKILL)
    pipe.receive()


def load(what: str) -> None:
    if what == "nonsense":
        raise ValueError(what)
    LOADED.append(what)


def tell_loaded(end: socket.socket) -> None:
    BlockingEnd(end).send(LOADED)


def wait_for(fifo: Path) -> None:
    fifo.read_bytes()


def refuse() -> None:
    raise KeyError("of this name")


def count(steps: int) -> Generator[tuple[int, int], None, str]:
    for step in range(steps):
        time.sleep(TELL_S)
        yield step + 1, steps
    return "done"


def tell(*news: object) -> None:
    for each in news:
        report(each)
