"""Tasks that do what a hostile file might have a decoder do, in the confined child."""

import ctypes
import os
import resource
import signal
import socket
import subprocess
import threading
import time
from collections.abc import Callable, Generator, Iterator
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import Any

from pftrack.sources.limits import DEFAULT_LIMITS
from pftrack_server.jobs.functions import index_frames

HARM = Path(f"/tmp/harm-of-{os.getuid()}")  # noqa: S108 - the same for a child without TMPDIR
NAMES = ("AS", "CPU", "FSIZE", "NOFILE", "CORE")


def crash(*_: object) -> None:
    """Read where nothing is."""
    ctypes.string_at(0)


def abort(*_: object) -> None:
    """End as the C library ends a program that has spoilt its memory."""
    os.abort()


def be_killed(*_: object) -> None:
    """End as when the system is short of memory."""
    os.kill(os.getpid(), signal.SIGKILL)


def take_too_long(*_: object) -> None:
    """End as when all processor time has been used."""
    os.kill(os.getpid(), signal.SIGXCPU)


def fail(*_: object) -> None:
    """End by a mistake of our own."""
    raise RuntimeError("on purpose")


def miss(*_: object) -> None:
    """End by a mistake that looks like a refusal of what was asked for."""
    raise KeyError("on purpose")


def leave(*_: object) -> None:
    """End without a word, as if all were well."""
    os._exit(0)


def leave_with_status(*_: object) -> None:
    """End without a word, and not well."""
    os._exit(3)


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


def say(length: bytes, text: bytes, *_: object) -> None:
    """Write to the pipe of the answer, past our own program."""
    pipe = socket.socket(fileno=next(int(name) for name, target in _descriptors() if target.startswith("socket:")))
    pipe.sendall(length + text)
    time.sleep(60)


def flood_a_reply(*_: object) -> str:
    """Answer in due form, and at far too great a length."""
    return "x" * 20_000_000


def said(text: bytes, length: int | None = None) -> Callable[..., None]:
    """Return a task that announces a message, of another length where told, and says it."""
    return partial(say, (len(text) if length is None else length).to_bytes(8, "big"), text)


ANSWERS: tuple[Callable[..., object], ...] = (
    *(partial(answer, what) for what in ("nonsense", '{"kind": "video"}', 7)),
    said(b"no json"),
    said(f"cos\nsystem\n(S'touch {HARM}'\ntR.".encode()),  # a pickle, which would run a command in its reader
    said(b"", 20_000_000),
    said(bytes(20_000_000)),
    flood_a_reply,
)
"""What answers with nonsense, half an index, what is not even text, and more than anybody wants to hear."""


def unfold(*_: object) -> int:
    """Take far more memory than is allowed, and use it."""
    return len(b"x" * (1 << 31))


def limits() -> dict[str, Any]:
    """Tell the limits that hold here, and how large this process is."""
    pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[0])
    held = {name: resource.getrlimit(getattr(resource, f"RLIMIT_{name}")) for name in NAMES}
    return {**held, "size": pages * resource.getpagesize()}


def surroundings() -> dict[str, Any]:
    """Tell what this process has of its parent's."""
    return {
        "pid": os.getpid(),
        "parent": os.getppid(),
        "group": os.getpgid(0),
        "session": os.getsid(0),
        "threads": threading.active_count(),
        "threads_of_parent": len(list(Path(f"/proc/{os.getppid()}/task").iterdir())),
        "descriptors": dict(_descriptors()),
        "dispositions": [str(signal.getsignal(each)) for each in (signal.SIGALRM, signal.SIGXCPU, signal.SIGTERM)],
        "blocked": len(signal.pthread_sigmask(signal.SIG_BLOCK, ())),
    }


def write(folder: str) -> list[str]:
    """Write to a new file and to one that is there, and return what came of it."""
    return [_written(Path(folder) / name) for name in ("new", "there")]


def reach(port: int) -> dict[str, bool]:
    """Call somebody on this machine; tell whether that was answered, and whether there is a network of one's own."""
    own = Path("/proc/self/ns/net").readlink() != Path(f"/proc/{os.getppid()}/ns/net").readlink()
    try:
        socket.create_connection(("127.0.0.1", port), 5).close()
    except OSError:
        return {"reached": False, "alone": own}
    return {"reached": True, "alone": own}


def talk() -> str:
    """Print a lot, as a decoder may."""
    for stream in (1, 2):
        os.write(stream, b"A DECODER'S COMPLAINT\n" * 1000)
    return "quiet"


def start_another(told: str) -> None:
    """Start a process, tell its number in a file, and hang."""
    child = subprocess.Popen(["/bin/sleep", "60"], env={})
    Path(told).write_text(str(child.pid), encoding="ascii")
    time.sleep(60)


def wait_for_ever(told: str, *_: object) -> None:
    """Tell this process's number in a file, and hang in native code that holds the interpreter."""
    Path(told).write_text(str(os.getpid()), encoding="ascii")
    hang()


def take_long(steps: int, each_s: float) -> Generator[tuple[int, int], None, dict[str, Any]]:
    """Take so long for each step, and tell of each; then tell how many there were."""
    for step in range(steps):
        time.sleep(each_s)
        yield step + 1, steps
    return {"steps": steps}


def decode_and_look_around(path: str) -> dict[str, str]:
    """Decode a file, and tell the environment in which that was done."""
    index_frames(path, DEFAULT_LIMITS, 1 << 30)
    return dict(os.environ)


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
