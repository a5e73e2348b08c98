"""Fork servers: processes from which others are forked."""

import asyncio
import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import psutil
import pytest

from pftrack.process import BlockingEnd, Child, ForkServer, describe, end_with_parent
from pftrack.process.child import environment
from tests import waiting

PRELOAD = "pftrack.process"


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


def who(child: Child) -> tuple[int, int, int, bool]:
    told: tuple[int, int, int, bool] = BlockingEnd(child.end).receive()
    return told


def tell(child: Child, what: str) -> None:
    BlockingEnd(child.end).send(what)


def lose_server(child: Child) -> int:
    """Kill the fork server of a child, whose status nobody knows then, and return the number that it had."""
    _, parent, *_ = who(child)
    os.kill(parent, signal.SIGKILL)
    assert child.status(30) is None
    return parent


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


@pytest.fixture
def server() -> Iterator[ForkServer]:
    made = ForkServer(PRELOAD)
    yield made
    made.close()


@contextmanager
def forked(server: ForkServer, function: Callable[..., object] = obey, **more: Any) -> Iterator[Child]:
    """A child whose end of the pipe is closed afterwards."""
    child = server.fork(function, **more)
    with child.end:
        yield child


def has_ended(pid: int) -> bool:
    """Whether a process has ended, also while nobody has taken note of it."""
    try:
        return psutil.Process(pid).status() == psutil.STATUS_ZOMBIE
    except psutil.NoSuchProcess:
        return True


ENDINGS = {"exit": 3, "fail": 1, "return": 0, "kill": -signal.SIGKILL, "terminate": -signal.SIGTERM}


def test_it_tells_how_its_children_ended(server: ForkServer) -> None:
    """Each has its own status, two at a time; it is in the owner's group, and what its owner sends ends it."""
    for how, status in ENDINGS.items():
        child, other = server.fork(obey), server.fork(obey)
        with child.end, other.end:
            pid, parent, group, has_signals = who(child)
            assert (pid, parent, group, has_signals) == (child.pid, who(other)[1], os.getpgid(0), True)
            assert not child.has_ended
            if how in ("kill", "terminate"):
                getattr(child, how)()
            else:
                tell(child, how)
            assert child.status(30) == status
            assert child.has_ended
            other.kill()
            assert other.status(30) == -signal.SIGKILL
    child.kill()  # of one that has ended nothing is left to be hit


FORKED = """
from pftrack.process import ForkServer
from tests.process.test_fork_server import obey, tell, who
server = ForkServer("json")
server.fork_off()
child = server.fork(obey)
who(child)
tell(child, "exit")
print(child.status(30))
server.close()
"""


def test_it_may_be_forked_off_its_owner() -> None:
    """A process without threads need not start another interpreter, and its children are the same."""
    command = [sys.executable, "-c", FORKED]
    told = subprocess.run(command, env=environment(), capture_output=True, text=True, timeout=60, check=True)
    assert told.stdout == "3\n"


def test_one_that_was_killed_is_started_again(server: ForkServer) -> None:
    """A child goes on without it, unless it has asked to end with it; how that ends nobody can tell."""
    with forked(server) as child:
        parent = lose_server(child)
        assert describe(child.status()) == "lost with the process that had started it"
        assert child.has_ended
        assert psutil.pid_exists(child.pid)
        tell(child, "exit")
    with forked(server) as another:
        assert who(another)[1] != parent


LOADED: list[str] = []


def load(what: str) -> None:
    if what == "nonsense":
        raise ValueError(what)
    LOADED.append(what)


def tell_loaded(end: socket.socket) -> None:
    BlockingEnd(end).send(LOADED)


def test_what_it_loads_for_one_child_all_later_ones_share(
    server: ForkServer, capfd: pytest.CaptureFixture[str]
) -> None:
    """It is loaded once, also by one that takes the place of one that was lost; what fails keeps no child back."""

    def loaded(what: str | None) -> object:
        with forked(server, tell_loaded, load=(load, what) if what else None) as child:
            return BlockingEnd(child.end).receive()

    assert loaded(None) == []
    assert loaded("one") == loaded("one") == ["one"]
    assert loaded("nonsense") == ["one"]
    assert "ValueError: nonsense" in capfd.readouterr().err
    assert loaded("two") == loaded(None) == ["one", "two"]
    with forked(server) as child:
        lose_server(child)
    assert loaded("two") == ["two"]


def wait_for(fifo: Path) -> None:
    fifo.read_bytes()


@pytest.mark.parametrize("times", [1, 2, 3])
def test_a_child_that_nobody_wants_any_more_leaves_nothing_behind(
    server: ForkServer, tmp_path: Path, times: int
) -> None:
    """Whoever asks for a child and is cancelled, however often, has no descriptor and no process more than before."""
    fifo = tmp_path / "fifo"
    os.mkfifo(fifo)

    async def ask_and_cancel() -> None:
        asked = asyncio.create_task(server.fork_async(obey, load=(wait_for, fifo)))
        with await asyncio.to_thread(fifo.open, "wb"):  # which is when the fork server reads it, and is held up
            for _ in range(times):
                asked.cancel()
                for _ in range(4):  # until it has begun to clear up
                    await asyncio.sleep(0)
                assert not asked.done()
        with pytest.raises(asyncio.CancelledError):
            await asked

    with forked(server) as child:
        _, parent, *_ = who(child)
        tell(child, "exit")
        assert child.status(30) == 3
    before = psutil.Process().num_fds()
    with ThreadPoolExecutor(1) as apart:  # where a browser has been used, its loop is running in this thread
        apart.submit(asyncio.run, ask_and_cancel()).result()
    assert psutil.Process().num_fds() == before
    assert psutil.Process(parent).children() == []


def test_it_ends_with_its_owner(server: ForkServer) -> None:
    """Closing a fork server ends what it has forked, in the middle of whatever it does."""
    with forked(server) as child:
        pid, parent, *_ = who(child)
        tell(child, "hang")
        family = psutil.Process(pid), psutil.Process(parent)
        server.close()
        assert not psutil.wait_procs(family, timeout=30)[1]


def leave_another_apart(end: socket.socket) -> None:
    """Do so, in a session that the other process begins itself."""
    leave_another(end, apart=True)


@pytest.mark.parametrize("start", [leave_another, leave_another_apart])
@pytest.mark.parametrize("first", ["the child", "the owner"])
def test_what_a_child_has_started_ends_with_it(
    server: ForkServer, first: str, start: Callable[[socket.socket], None]
) -> None:
    """What a child has started ends after it, or with the fork server, in whatever group it is."""
    with forked(server, start) as child:
        other = BlockingEnd(child.end).receive()
        if first == "the child":
            tell(child, "return")
        else:
            server.close()
        waiting.wait_for(lambda: has_ended(other))


def test_a_number_that_another_group_has_by_now_is_not_killed(
    server: ForkServer, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A child that has ended is not killed again, since the system may have given its number to others."""
    with forked(server) as child:
        who(child)
        tell(child, "return")
    assert child.status(wait_s=30) == 0
    killed: list[int] = []
    monkeypatch.setattr(os, "killpg", lambda pid, _: killed.append(pid))
    monkeypatch.setattr(os, "kill", lambda pid, _: killed.append(pid))
    child.kill()
    assert killed == []


def test_what_cannot_be_imported_is_told() -> None:
    """A preload that fails makes no child, and says so where one is wanted."""
    server = ForkServer("tests.process.no_such_module")
    with pytest.raises(OSError, match=r"could not import tests\.process\.no_such_module"):
        server.fork(obey)
    server.close()


def test_a_secret_stays_with_the_owner(monkeypatch: pytest.MonkeyPatch) -> None:
    """A variable that is named as a secret is in the environment of no other process."""
    monkeypatch.setenv("PFTRACK_TOKEN", "secret")
    server = ForkServer(PRELOAD, secrets=("PFTRACK_TOKEN",))
    with forked(server) as child:
        who(child)
        assert "PFTRACK_TOKEN" not in psutil.Process(child.pid).environ()
        assert child.pid
        child.kill()
    server.close()
