"""Limits that a child process sets itself."""

import json
import signal
import socket
import subprocess
import sys

from pftrack.process import environment

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
    """A process that uses up its processor time, or its time, ends by the signal that says so."""
    assert run("confine(cpu_seconds=0.2)\nwhile True: pass").returncode == -signal.SIGXCPU
    assert run("confine(wall_seconds=1)\nimport time\ntime.sleep(30)").returncode == -signal.SIGALRM


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
