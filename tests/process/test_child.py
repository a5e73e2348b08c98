"""Child processes as their parent sees them."""

import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from pftrack.process import Ending, describe, ending
from pftrack.process.child import command, environment


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


@pytest.mark.parametrize(
    ("status", "how"),
    [
        (0, Ending.DONE),
        (1, Ending.FAILED),
        (None, Ending.OUT_OF_TIME),
        (-signal.SIGALRM, Ending.OUT_OF_TIME),
        (-signal.SIGXCPU, Ending.OUT_OF_CPU_TIME),
        (-signal.SIGKILL, Ending.KILLED),
        (-signal.SIGSEGV, Ending.CRASHED),
        (-99, Ending.CRASHED),
    ],
)
def test_a_status_tells_the_ending(status: int | None, how: Ending) -> None:
    """Every exit status is one of six endings."""
    assert ending(status) is how


def test_a_status_in_words() -> None:
    """A status names its signal where the signal has a name."""
    assert describe(2) == "ended with status 2"
    assert describe(-signal.SIGSEGV) == "killed by SIGSEGV"
    assert describe(-99) == "killed by signal 99"
    assert describe(None) == "lost with the process that had started it"


def test_a_child_ends_with_its_parent() -> None:
    """A child that follows its parent ends soon after it, though nobody tells it to."""
    body = "import time; from pftrack.process import end_with_parent; end_with_parent(); print('up', flush=True)"
    body += "; time.sleep(60)"
    parent = (
        "import subprocess, sys;"
        f"child = subprocess.Popen([sys.executable, '-c', {body!r}], stdout=subprocess.PIPE);"
        "child.stdout.readline(); print(child.pid, flush=True)"
    )
    result = subprocess.run(
        [sys.executable, "-c", parent], env=environment(), capture_output=True, check=True, timeout=60
    )
    child = int(result.stdout)
    end = time.monotonic() + 20
    while _alive(child) and time.monotonic() < end:
        time.sleep(0.05)
    assert not _alive(child)


def _alive(process: int) -> bool:
    try:
        stat = Path(f"/proc/{process}/stat").read_text(encoding="ascii")
    except FileNotFoundError:
        return False
    return stat.rpartition(")")[2].split()[0] != "Z"
