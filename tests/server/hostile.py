"""Tasks that do in the confined child what a hostile file might make a decoder do."""

import ctypes
import os
import resource
import signal
import socket
import threading
import time
from collections.abc import Callable, Generator, Iterator
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import Any

from pftrack.sources.limits import DEFAULT_LIMITS
from pftrack_server.jobs.functions import Steps, index_frames
from pftrack_server.work.run_functions import weigh_record

HARM = Path(f"/tmp/harm-of-{os.getuid()}")  # noqa: S108 - the same for a child without TMPDIR
FRAME_S = 0.25
NAMES = ("AS", "CPU", "FSIZE", "NOFILE", "CORE")


def crash(*_: object) -> None:
    """Read where nothing is."""
    ctypes.string_at(0)


def end_by(number: signal.Signals, *_: object) -> None:
    """End by a signal of the system."""
    signal.raise_signal(number)


def fail(*_: object) -> None:
    """End by a mistake of our own."""
    raise RuntimeError("on purpose")


def miss(*_: object) -> None:
    """End by a mistake that looks like a refusal."""
    raise KeyError("on purpose")


def leave(*_: object) -> None:
    """End without a word, as if all were well."""
    os._exit(0)


def hang(*_: object) -> None:
    """Wait for what never comes, in native code that holds the interpreter."""
    ctypes.PyDLL(None).sleep(60)


def hang_up(*_: object) -> None:
    """Close the pipe and go on."""
    os.closerange(3, 64)
    time.sleep(60)


def answer(what: object, *_: object) -> object:
    """Answer with what is not an index."""
    return what


def say(text: bytes, *_: object) -> None:
    """Write a message to the pipe of the answer, past our own program."""
    pipe = socket.socket(fileno=next(int(name) for name, target in _descriptors() if target.startswith("socket:")))
    pipe.sendall(len(text).to_bytes(8, "big") + text)
    time.sleep(60)


ANSWERS: tuple[Callable[..., object], ...] = (
    *(partial(answer, what) for what in ("nonsense", '{"kind": "video"}', 7)),
    partial(say, f"cos\nsystem\n(S'touch {HARM}'\ntR.".encode()),  # a pickle, which would run a command in its reader
    partial(say, bytes(20_000_000)),
)
"""Answers that are nonsense, half an index, a program, or far too long."""


def unfold(*_: object) -> int:
    """Take far more memory than is allowed, and use it."""
    return len(b"x" * (1 << 31))


def surroundings() -> dict[str, Any]:
    """Return what this process inherited from its parent, its limits, and how large it is."""
    pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[0])
    at_parents_end = ctypes.c_int()
    ctypes.CDLL(None).prctl(2, ctypes.byref(at_parents_end))  # PR_GET_PDEATHSIG
    return {
        "at_parents_end": at_parents_end.value,
        "limits": {name: resource.getrlimit(getattr(resource, f"RLIMIT_{name}")) for name in NAMES},
        "size": pages * resource.getpagesize(),
        "leads": os.getpid() == os.getsid(0) == os.getpgid(0),
        "parent": os.getppid(),
        "threads": threading.active_count(),
        "threads_of_parent": len(list(Path(f"/proc/{os.getppid()}/task").iterdir())),
        "descriptors": dict(_descriptors()),
        "dispositions": [str(signal.getsignal(each)) for each in (signal.SIGALRM, signal.SIGXCPU, signal.SIGTERM)],
        "blocked": len(signal.pthread_sigmask(signal.SIG_BLOCK, ())),
    }


def write(folder: str) -> list[str]:
    """Write to a new file and to an existing one, and return the results."""
    return [_written(Path(folder) / name) for name in ("new", "there")]


def talk_and_decode(path: str) -> dict[str, str]:
    """Print a lot, as a decoder may, decode a file, and return the environment."""
    for stream in (1, 2):
        os.write(stream, b"A DECODER'S COMPLAINT\n" * 1000)
    index_frames(path, DEFAULT_LIMITS, 1 << 30)
    return dict(os.environ)


def take_long(steps: int, each_s: float) -> Generator[tuple[int, int], None, dict[str, Any]]:
    """Take some time for each step, and report each; then return how far the alarm was before each report."""
    left_s = []
    for step in range(steps):
        time.sleep(each_s)
        left_s.append(signal.getitimer(signal.ITIMER_REAL)[0])
        yield step + 1, steps
    return {"left_s": left_s}


def weigh_for_ever(*_: object) -> Steps:
    """Report the first frame of a saved run again and again."""
    while True:
        time.sleep(FRAME_S)
        yield 1, 12


def weigh_slowly(*asked: Any) -> Steps:
    """Compute a saved run, and take a while for each frame."""
    steps = weigh_record(*asked)
    while True:
        try:
            step = next(steps)
        except StopIteration as end:
            return end.value
        time.sleep(FRAME_S)
        yield step


def wait_for_ever(told: str, *_: object) -> None:
    """Write this process's number to a file, and hang in native code that holds the interpreter."""
    Path(told).write_text(str(os.getpid()), encoding="ascii")
    hang()


def _descriptors() -> Iterator[tuple[str, str]]:
    """Yield the open descriptors with what they are of, but for that of the listing itself."""
    for each in Path("/proc/self/fd").iterdir():
        with suppress(OSError):
            if not (target := str(each.readlink())).startswith("/proc/"):
                yield each.name, target


def _written(path: Path) -> str:
    try:
        with path.open("ab") as file:
            file.write(b"harm")
    except OSError as error:
        return type(error).__name__
    return "written"
