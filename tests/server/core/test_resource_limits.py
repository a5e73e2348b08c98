"""Limits that a shell has set: each is named when it hits."""

import resource
import signal
import subprocess
import sys

import pytest

from pftrack_server.core.resource_limits import MEBIBYTE, mebibytes
from pftrack_server.sessions.worker_handle import _cause
from tests.server.command import ROOT
from tests.server.sessions.test_run_tree import config


def said(program: str) -> tuple[int, str]:
    """Return exit status and output of a Python program."""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False, cwd=ROOT)
    return done.returncode, done.stdout + done.stderr


def test_a_low_soft_limit_is_raised() -> None:
    """Where more files may be asked for, the server asks."""
    program = (
        "import resource; resource.setrlimit(resource.RLIMIT_NOFILE, (100, 600));"
        "from pftrack_server.core.resource_limits import too_few_files; assert too_few_files() is None;"
        "print(resource.getrlimit(resource.RLIMIT_NOFILE)[0])"
    )
    assert said(program) == (0, "600\n")


def test_processor_time_of_the_server() -> None:
    """Shortly before the server's own time is over it is told to stop, with the name of the limit."""
    program = (
        "import resource, signal, sys; resource.setrlimit(resource.RLIMIT_CPU, (60, 60));"
        "from pftrack_server.core.resource_limits import name_cpu_limit; name_cpu_limit(sys.exit)\n"
        "print(*resource.getrlimit(resource.RLIMIT_CPU)); signal.raise_signal(signal.SIGXCPU)"
    )
    status, words = said(program)
    assert (status, words.startswith("55 60\n")) == (1, True)
    assert "60 s of processor time that its shell allows (ulimit -t)" in words


def test_processor_time_of_a_session(monkeypatch: pytest.MonkeyPatch) -> None:
    """The message of a worker under a lower limit of the shell names that limit."""
    monkeypatch.setattr(resource, "getrlimit", lambda _: (60, 60))
    assert "60 s of processor time that the server's shell allows (ulimit -t)" in _cause(-signal.SIGXCPU, config())


def test_bytes_are_written_as_people_read_them() -> None:
    """Small amounts have four digits, large ones are whole numbers with commas, and none has an exponent."""
    words = {0: "0 MiB", MEBIBYTE // 8: "0.125 MiB", 999 * MEBIBYTE: "999 MiB", 20_480 * MEBIBYTE: "20,480 MiB"}
    assert {count: mebibytes(count) for count in words} == words
