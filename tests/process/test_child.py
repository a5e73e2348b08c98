"""Child processes: how they end, what limits they set themselves, and that nothing else starts any."""

import ast
import json
import re
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from pftrack.process import Ending, describe, ending
from pftrack.process.child import command, environment
from tests.process.test_fork_server import has_ended
from tests.waiting import wait_for


def test_a_child_finds_our_packages_and_not_the_current_folder(tmp_path: Path) -> None:
    """A child imports pftrack wherever it is started, and nothing that merely lies there."""
    (tmp_path / "pftrack.py").write_text("raise SystemExit(3)")
    result = subprocess.run(
        command("pftrack", "--version"), env=environment(), cwd=tmp_path, capture_output=True, check=False
    )
    assert result.returncode == 0, result.stderr


def test_a_child_keeps_to_one_thread(monkeypatch: pytest.MonkeyPatch) -> None:
    """It has the environment of its parent, in which numerical libraries are told that there is one processor."""
    monkeypatch.setenv("OMP_NUM_THREADS", "8")
    monkeypatch.setenv("LANGUAGE_OF_ONES_OWN", "en")
    assert (environment()["OMP_NUM_THREADS"], environment()["LANGUAGE_OF_ONES_OWN"]) == ("1", "en")


def test_a_status_tells_the_ending() -> None:
    """Every exit status is one of six endings."""
    endings = {0: Ending.DONE, 1: Ending.FAILED, None: Ending.OUT_OF_TIME, -signal.SIGALRM: Ending.OUT_OF_TIME}
    endings |= {-signal.SIGXCPU: Ending.OUT_OF_CPU_TIME, -signal.SIGKILL: Ending.KILLED}
    endings |= {-signal.SIGSEGV: Ending.CRASHED, -99: Ending.CRASHED}
    assert {status: ending(status) for status in endings} == endings


def test_a_status_in_words() -> None:
    """A status names its signal where the signal has a name."""
    assert describe(2) == "ended with status 2"
    assert describe(-signal.SIGSEGV) == "killed by SIGSEGV"
    assert describe(-99) == "killed by signal 99"
    assert describe(None) == "lost with the process that had started it"


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
    wait_for(lambda: has_ended(child))


# Limits that a child process sets itself.


def run(program: str, *arguments: str) -> "subprocess.CompletedProcess[bytes]":
    """Run a program that may confine itself."""
    return run_python("from pftrack.process import confine; import resource, sys, json\n" + program, *arguments)


def test_limits_are_set() -> None:
    """Memory is counted from what the process has, processor time from what it used; core dumps are off."""
    program = (
        "confine(memory_bytes=2**28, cpu_seconds=7, file_bytes=4096, open_files=64)\n"
        "names = ['AS', 'CPU', 'FSIZE', 'NOFILE', 'CORE']\n"
        "print(json.dumps({n: resource.getrlimit(getattr(resource, 'RLIMIT_' + n)) for n in names}))"
    )
    limits = json.loads(run(program).stdout)
    assert 2**28 < limits["AS"][1] < 2**28 + 2**33
    assert 7 <= limits["CPU"][0] < 15
    assert [limits[name] for name in ("FSIZE", "NOFILE", "CORE")] == [[4096, 4096], [64, 64], [0, 0]]


def test_a_limit_that_holds_already_is_not_raised() -> None:
    """Under a lower limit of whoever started it a process confines itself to that one, instead of failing."""
    program = (
        "resource.setrlimit(resource.RLIMIT_NOFILE, (40, 40))\n"
        "confine(open_files=64); print(resource.getrlimit(resource.RLIMIT_NOFILE))"
    )
    assert run(program).stdout.strip() == b"(40, 40)"


def test_memory_is_refused() -> None:
    """What a confined process does not get is a MemoryError that it can report."""
    program = "confine(memory_bytes=2**26)\ntry: bytearray(2**28)\nexcept MemoryError: print('refused')"
    assert run(program).stdout.strip() == b"refused"


def test_time_is_up() -> None:
    """A process that uses up its processor time ends by the signal that says so."""
    assert run("confine(cpu_seconds=0.2)\nwhile True: pass").returncode == -signal.SIGXCPU


@pytest.mark.skipif(sys.platform != "linux", reason="Linux alone says which process goes first")
def test_where_all_memory_is_used_up_others_stay() -> None:
    """A confined process is ended before one that is not, as large as that may be; twice confined is no worse."""
    told = "print(int(open('/proc/self/oom_score_adj').read()), int(open('/proc/self/oom_score').read()))\n"
    (before, score), (once, higher), (twice, _) = (
        map(int, line.split()) for line in run(told + "confine()\n" + told + "confine()\n" + told).stdout.splitlines()
    )
    assert once == twice == max(before, 500)
    assert higher > score or before >= 500


def test_no_network() -> None:
    """A confined process reaches nobody, not even on this machine, where the system lets it leave the network."""
    with socket.create_server(("127.0.0.1", 0)) as server:
        program = (
            "import ctypes, os, socket\n"
            "def reached():\n"
            "    try: socket.create_connection(('127.0.0.1', int(sys.argv[1])), 5).close()\n"
            "    except OSError: return False\n"
            "    return True\n"
            "before, user = reached(), os.getuid()\n"
            "confine()\n"
            "same = os.getuid() == user\n"
            "alone = os.readlink('/proc/self/ns/net') != os.readlink(f'/proc/{os.getppid()}/ns/net')\n"
            "print(json.dumps([before, reached(), alone, same]))"
        )
        before, after, alone, same = json.loads(run(program, str(server.getsockname()[1])).stdout)
    assert (before, same) == (True, True)
    assert after is not alone


FORK = """
import os, sys, time
from pathlib import Path
from pftrack.process import confine
from pftrack.process.limits import stand_alone
told, keep = os.pipe()
secret = open(sys.argv[1])
child = os.fork()
if child == 0:
    confine()
    stand_alone(keep)
    open_now = {each.name: os.readlink(each) for each in Path('/proc/self/fd').iterdir() if os.path.exists(each)}
    print('lost')
    standing = os.getpid() == os.getsid(0) == os.getpgid(0)
    os.write(keep, json.dumps([os.getpid(), standing, sorted(map(int, open_now)), keep, open_now['1']]).encode())
    time.sleep(60)
print(os.read(told, 10_000).decode())
"""


@pytest.mark.skipif(sys.platform != "linux", reason="looks into /proc")
def test_a_fork_lets_go_of_its_parent(tmp_path: Path) -> None:
    """It keeps one descriptor, leads its own group, prints nowhere, and ends when its parent has ended."""
    (tmp_path / "secret").touch()
    done = run(FORK, str(tmp_path / "secret"))
    child, standing, descriptors, keep, output = json.loads(done.stdout)
    assert (standing, descriptors, output) == (True, [0, 1, 2, keep], "/dev/null")
    wait_for(lambda: not Path(f"/proc/{child}").exists())


@pytest.mark.skipif(sys.platform != "linux", reason="processors can be chosen, and files tell of groups, on Linux only")
def test_who_gives_way_leaves_the_processor_to_others() -> None:
    """Of two processes on one processor, each in a session of its own, the nicer has much less."""
    program = """
import mmap, os, time
from pftrack.process import give_way
os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
(read, write), ended = os.pipe(), mmap.mmap(-1, 1)
begin = time.monotonic() + 0.3
for name, niceness in (("other", 0), ("nicer", 19)):
    if os.fork() == 0:
        os.setsid()
        give_way(niceness)
        while time.monotonic() < begin: pass
        used = time.process_time()
        while not ended[0] and (name == "nicer" or time.process_time() - used < 0.3): pass
        ended[0] = 1
        os.write(write, f"{name} {time.process_time() - used}\\n".encode())
        os._exit(0)
os.wait(), os.wait()
print(os.read(read, 1000).decode())
"""
    lines = run(program).stdout.decode().split("\n")
    used = {name: float(seconds) for name, seconds in (line.split() for line in lines if line)}
    assert used["nicer"] < used["other"] / 2


# Nothing but `pftrack.process` starts a process.

ROOT = Path(__file__).parents[2]
STARTERS = re.compile(
    r"subprocess|multiprocessing|pty|os\.(fork\w*|exec\w+|spawn\w+|posix_spawnp?|system|popen|startfile)"
    r"|ProcessPoolExecutor|(asyncio\.|\w+\.)?(create_subprocess_\w+|subprocess_(exec|shell))"
)
"""Modules and functions of the standard library that make processes."""


def starters(text: str) -> Iterator[str]:
    """What a module imports or calls that makes processes."""
    for node in ast.walk(ast.parse(text)):
        match node:
            case ast.Import(names=names):
                named = [each.name.split(".")[0] for each in names]
            case ast.ImportFrom(module=module, names=names):
                named = [str(module).split(".")[0], *(each.name for each in names)]
                named += [f"{module}.{each.name}" for each in names]
            case ast.Attribute(value=ast.Name(id=owner), attr=name):
                named = [f"{owner}.{name}"]
            case _:
                continue
        yield from (name for name in named if STARTERS.fullmatch(name))


def test_nothing_else_starts_a_process() -> None:
    """Sessions, lessons, tasks, sweeps, studies, compiling and the command line all use it."""
    homes = ROOT / "pftrack", ROOT / "server" / "pftrack_server"
    modules = [path for home in homes for path in home.rglob("*.py") if home / "process" not in path.parents]
    assert len(modules) > 400
    assert {str(path): found for path in modules if (found := list(starters(path.read_text(encoding="utf-8"))))} == {}


def test_each_way_is_found() -> None:
    """The search finds imports and calls of each form, and passes over what only has a similar name."""
    wrong = """
import subprocess, os, asyncio, multiprocessing.pool
from multiprocessing import Pool
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from os import fork
os.fork(); os.posix_spawn("", [], {}); asyncio.create_subprocess_exec("ls"); loop.subprocess_exec(None)
"""
    assert len(list(starters(wrong))) == 9
    assert list(starters("server.fork(os.path, run); from_process = os.fspath")) == []
