"""Limits that a child process sets itself."""

import json
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

import pytest

from pftrack.process.child import environment

CONFINE = "from pftrack.process import confine; import resource, sys, json\n"


def run(program: str, *arguments: str) -> "subprocess.CompletedProcess[bytes]":
    return subprocess.run(
        [sys.executable, "-c", CONFINE + program, *arguments],
        env=environment(),
        capture_output=True,
        check=False,
        timeout=60,
    )


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
    assert limits["FSIZE"] == [4096, 4096]
    assert limits["NOFILE"] == [64, 64]
    assert limits["CORE"] == [0, 0]


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
    assert before
    assert after is not alone
    assert same


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
    assert standing
    assert descriptors == [0, 1, 2, keep]
    assert output == "/dev/null"
    end = time.monotonic() + 20
    while Path(f"/proc/{child}").exists() and time.monotonic() < end:
        time.sleep(0.02)
    assert not Path(f"/proc/{child}").exists()


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
