"""Fork servers: processes from which others are forked."""

import asyncio
import json
import os
import re
import signal
import socket
import subprocess
import sys
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

import psutil
import pytest

from pftrack.process import BlockingEnd, Child, Ending, ForkServer, describe, ending
from pftrack.process.child import command, environment
from tests import waiting
from tests.process.children import leave_another, load, obey, tell_loaded, wait_for

PRELOAD = "pftrack.process"


def who(child: Child) -> tuple[int, int, int, bool]:
    return BlockingEnd(child.end).receive()


def tell(child: Child, what: str) -> None:
    BlockingEnd(child.end).send(what)


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


def test_it_tells_how_its_children_ended(server: ForkServer, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each has its own status, whatever the others do; it is in the owner's group, and what its owner sends ends it.

    A child that has ended is not killed again, since the system may have given its number to others.
    """
    children = {how: server.fork(obey) for how in ENDINGS}
    told = {how: who(child) for how, child in children.items()}
    _, parent, *_ = told["exit"]
    for how, child in children.items():
        assert told[how] == (child.pid, parent, os.getpgid(0), True)
        assert not child.has_ended
        with child.end:
            if how in ("kill", "terminate"):
                getattr(child, how)()
            else:
                tell(child, how)
            assert child.status(30) == ENDINGS[how]
        assert child.has_ended
    killed: list[int] = []
    for name in ("kill", "killpg"):
        monkeypatch.setattr(os, name, lambda pid, _: killed.append(pid))
    child.kill()
    assert killed == []


def test_what_it_loads_for_one_child_all_later_ones_share(capfd: pytest.CaptureFixture[str]) -> None:
    """It is loaded once, also by one that takes the place of one that was lost; what fails keeps no child back.

    A child goes on without a lost one, unless it has asked to end with it; how that ends nobody can tell.
    """
    server = ForkServer(PRELOAD)

    def loaded(what: str | None) -> object:
        with forked(server, tell_loaded, load=(load, what) if what else None) as child:
            return BlockingEnd(child.end).receive()

    assert loaded(None) == []
    assert loaded("one") == loaded("one") == ["one"]
    assert loaded("nonsense") == ["one"]
    assert "ValueError: nonsense" in capfd.readouterr().err
    assert loaded("two") == loaded(None) == ["one", "two"]
    with forked(server) as child:
        _, parent, *_ = who(child)
        os.kill(parent, signal.SIGKILL)
        assert (child.status(30), child.has_ended, psutil.pid_exists(child.pid)) == (None, True, True)
        tell(child, "exit")
    assert loaded("two") == ["two"]
    server.close()


@pytest.mark.parametrize("times", [1, 3])
def test_a_child_that_is_no_longer_wanted_leaves_nothing_behind(server: ForkServer, tmp_path: Path, times: int) -> None:
    """A request for a child that is cancelled, however often, leaves no descriptor and no process."""
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


@pytest.mark.parametrize("apart", [False, True])
def test_what_a_child_has_started_ends_with_it(server: ForkServer, *, apart: bool) -> None:
    """Processes that a child has started end after it, in whatever group they are."""
    with forked(server, partial(leave_another, apart=apart)) as child:
        other = BlockingEnd(child.end).receive()
        tell(child, "return")
        waiting.wait_for(lambda: has_ended(other))


def test_it_ends_with_its_owner(monkeypatch: pytest.MonkeyPatch) -> None:
    """Closing a fork server ends what it has forked, in the middle of whatever it does, and what that has started.

    A variable that is named as a secret is in the environment of no other process; a preload that fails is named.
    """
    monkeypatch.setenv("PFTRACK_TOKEN", "secret")
    server = ForkServer(PRELOAD, secrets=("PFTRACK_TOKEN",))
    with (
        forked(server) as child,
        forked(server, leave_another) as leader,
        forked(server, partial(leave_another, apart=True)) as loose,
    ):
        pid, parent, *_ = who(child)
        assert "PFTRACK_TOKEN" not in psutil.Process(pid).environ()
        tell(child, "hang")
        others = [BlockingEnd(each.end).receive() for each in (leader, loose)]
        server.close()
        waiting.wait_for(lambda: all(map(has_ended, (pid, parent, *others))))
    server = ForkServer("tests.process.no_such_module")
    with pytest.raises(OSError, match=r"could not import tests\.process\.no_such_module"):
        server.fork(obey)
    server.close()


# Child processes: how they end, what limits they set themselves, and that nothing else starts any.


def test_a_child_finds_our_packages_and_not_the_current_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A child imports pftrack wherever it is started, and nothing that merely lies there.

    It has the environment of its parent, which limits numerical libraries to one processor.
    """
    monkeypatch.setenv("OMP_NUM_THREADS", "8")
    monkeypatch.setenv("LANGUAGE_OF_ONES_OWN", "en")
    assert (environment()["OMP_NUM_THREADS"], environment()["LANGUAGE_OF_ONES_OWN"]) == ("1", "en")
    (tmp_path / "pftrack.py").write_text("raise SystemExit(3)")
    asked = command("pftrack", "--version")
    result = subprocess.run(asked, env=environment(), cwd=tmp_path, capture_output=True, check=False)
    assert result.returncode == 0, result.stderr


def test_a_status_tells_the_ending() -> None:
    """Every exit status is one of six endings, in words with the signal's name where it has one."""
    endings = {0: Ending.DONE, 1: Ending.FAILED, None: Ending.OUT_OF_TIME, -signal.SIGALRM: Ending.OUT_OF_TIME}
    endings |= {-signal.SIGXCPU: Ending.OUT_OF_CPU_TIME, -signal.SIGKILL: Ending.KILLED}
    endings |= {-signal.SIGSEGV: Ending.CRASHED, -99: Ending.CRASHED}
    assert {status: ending(status) for status in endings} == endings
    assert [describe(2), describe(-signal.SIGSEGV)] == ["ended with status 2", "killed by SIGSEGV"]
    assert [describe(-99), describe(None)] == ["killed by signal 99", "lost with the process that had started it"]


def run_python(program: str, *arguments: str) -> "subprocess.CompletedProcess[bytes]":
    command = [sys.executable, "-c", program, *arguments]
    return subprocess.run(command, env=environment(), capture_output=True, check=False, timeout=60)


def test_a_child_ends_with_its_parent() -> None:
    """A child that follows its parent ends soon after it, though nobody tells it to."""
    body = "import time; from pftrack.process import end_with_parent; end_with_parent(); print('up', flush=True)"
    body += "; time.sleep(60)"
    parent = (
        "import subprocess, sys;"
        f"child = subprocess.Popen([sys.executable, '-c', {body!r}], stdout=subprocess.PIPE);"
        "child.stdout.readline(); print(child.pid, flush=True)"
    )
    child = int(run_python(parent).stdout)
    waiting.wait_for(lambda: has_ended(child))


# Limits that a child process sets itself.


def run(program: str, *arguments: str) -> "subprocess.CompletedProcess[bytes]":
    """Run a program that may confine itself."""
    return run_python("from pftrack.process import confine; import resource, sys, json\n" + program, *arguments)


CONFINED = """
import ctypes, os, socket
def reached():
    try: socket.create_connection(('127.0.0.1', int(sys.argv[1])), 5).close()
    except OSError: return False
    return True
def adjusted(): return int(open('/proc/self/oom_score_adj').read())
resource.setrlimit(resource.RLIMIT_NOFILE, (40, 40))
before = [reached(), os.getuid(), adjusted()]
confine(memory_bytes=2**28, cpu_seconds=7, file_bytes=4096, open_files=64)
alone = os.readlink('/proc/self/ns/net') != os.readlink(f'/proc/{os.getppid()}/ns/net')
after = [reached(), os.getuid(), adjusted()]
confine()
limits = {name: resource.getrlimit(getattr(resource, 'RLIMIT_' + name)) for name in sys.argv[2:]}
try: bytearray(2**33)
except MemoryError: print(json.dumps([before, after, alone, adjusted(), limits]))
"""


@pytest.mark.skipif(sys.platform != "linux", reason="Linux alone limits memory, and says which process goes first")
def test_a_process_confines_itself() -> None:
    """Memory is counted from what the process has, processor time from what it used; core dumps are off.

    A lower limit of its parent remains. Memory that it does not get is a MemoryError. It reaches nobody, not even on
    this machine, where the system lets it leave the network. It is ended before others where memory runs out, and
    confining it twice changes nothing.
    """
    with socket.create_server(("127.0.0.1", 0)) as server:
        done = run(CONFINED, str(server.getsockname()[1]), "AS", "CPU", "FSIZE", "NOFILE", "CORE")
    (reached, user, score), (reaches, same_user, higher), alone, twice, limits = json.loads(done.stdout)
    assert 2**28 < limits["AS"][1] < 2**28 + 2**33
    assert 7 <= limits["CPU"][0] < 15
    assert [limits[name] for name in ("FSIZE", "NOFILE", "CORE")] == [[4096, 4096], [40, 40], [0, 0]]
    assert (reached, reaches, same_user) == (True, not alone, user)
    assert twice == higher == max(score, 500)


@pytest.mark.skipif(sys.platform != "linux", reason="groups of processes have a niceness on Linux only")
def test_a_process_that_gives_way_comes_after_others() -> None:
    """It is nicer itself, and so is its session by half as much, where the system divides time among sessions."""
    program = """
from pathlib import Path
from pftrack.process import give_way
import os
if not os.fork():
    os.setsid()
    give_way(19)
    group = Path("/proc/self/autogroup")
    print(os.nice(0), group.read_text().split()[-1] if os.access(group, os.W_OK) else 9)
else:
    os.wait()
"""
    assert run(program).stdout.split() == [b"19", b"9"]


# Nothing but `pftrack.process` starts a process.

ROOT = Path(__file__).parents[2]
STARTERS = re.compile(
    r"^ *(?:import|from) (?:[\w., ]+, )?(?:subprocess|multiprocessing|pty)\b"
    r"|^ *from os import .*(?:fork|exec|spawn|system|popen)"
    r"|\bos\.(?:fork\w*|exec\w+|spawn\w+|posix_spawnp?|system|popen|startfile)\(|\bProcessPoolExecutor\b"
    r"|\b(?:create_)?subprocess_(?:exec|shell)\b",
    re.MULTILINE,
)
"""What imports or calls a part of the standard library that makes processes."""


def test_nothing_else_starts_a_process() -> None:
    """Sessions, lessons, tasks, sweeps, studies, compiling and the command line all use `pftrack.process`."""
    homes = ROOT / "pftrack", ROOT / "server" / "pftrack_server"
    found = {path: STARTERS.findall(path.read_text("utf-8")) for home in homes for path in home.rglob("*.py")}
    assert len(found) > 400
    starting = {path for path, starters in found.items() if starters}
    assert {path.parent for path in starting} == {ROOT / "pftrack" / "process"}, starting
