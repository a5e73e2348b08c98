"""Confined children: what a task that has gone wild may do, it may do to itself alone."""

import asyncio
import math
import signal
import socket
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import psutil
import pytest

from pftrack.core.refusal import RefusedError
from pftrack.process import Budget
from pftrack.process.calls import GRACE_S
from pftrack.process.child import environment
from pftrack_server.core.errors import ApiError
from pftrack_server.core.log import RateLimitedLogger
from pftrack_server.jobs.child_tasks import ChildTasks, Queues
from pftrack_server.uploads.intake import BUDGET
from tests.apart import run
from tests.server import hostile
from tests.server.confined import ask, ended
from tests.server.uploads.test_uploads import video
from tests.waiting import wait_for

pytestmark = pytest.mark.usefixtures("nothing_is_left")

MEBIBYTE = 1024**2


def test_the_process_limits_itself() -> None:
    """It gives up memory, processor time, files, core dumps and all writing before it looks at a file."""
    found = ask(hostile.limits)
    # Memory is counted from what the process had when it was forked.
    assert abs(found["AS"][0] - BUDGET.memory_bytes - found["size"]) < 64 * MEBIBYTE
    assert 120 <= found["CPU"][0] < 130
    assert [found[name] for name in ("FSIZE", "NOFILE", "CORE")] == [[0, 0], [BUDGET.open_files] * 2, [0, 0]]


def test_the_process_has_nothing_of_its_parents() -> None:
    """It leads a group of its own, has no threads, and holds open its answer alone, though others are at work."""

    async def with_others() -> Any:
        tasks = ChildTasks(Queues())
        others = [asyncio.ensure_future(tasks.run_beside(hostile.hang)) for _ in range(3)]
        await asyncio.sleep(0.5)
        answer = await tasks.run_beside(hostile.surroundings)
        for other in others:
            other.cancel()
        await asyncio.gather(*others, return_exceptions=True)
        return answer

    found = run(with_others())
    assert found["pid"] == found["group"] == found["session"]
    # A thread of the parent's would have left its locks behind, for ever locked.
    assert (found["threads"], found["threads_of_parent"]) == (1, 1)
    standard = {number: found["descriptors"].pop(number) for number in "012"}
    assert set(standard.values()) == {"/dev/null"}
    (pipe,) = found["descriptors"].values()
    assert pipe.startswith("socket:")
    assert found["dispositions"] == ["0", "0", "0"]  # as the system has them: to end the process
    assert found["blocked"] == 0


def test_the_process_writes_nothing_and_reaches_nobody(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """No file becomes longer, whether it was there or not, and what a decoder prints fills no log.

    It cannot reach even a server on this machine, where the system lets a process leave the network.
    """
    (tmp_path / "there").write_bytes(b"before")
    assert ask(hostile.write, str(tmp_path)) == ["OSError", "OSError"]
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == {"there": b"before", "new": b""}
    with socket.create_server(("127.0.0.1", 0)) as server:
        found = ask(hostile.reach, server.getsockname()[1])
    assert found["reached"] is not found["alone"]
    assert ask(hostile.talk) == "quiet"
    assert "COMPLAINT" not in "".join(capfd.readouterr())


def test_what_the_process_has_started_ends_with_it(tmp_path: Path) -> None:
    """A process that a decoder has managed to start does not outlive it."""
    told = tmp_path / "child"
    work = ChildTasks(Queues()).run_beside(
        hostile.start_another, str(told), stopped=lambda: told.exists() and told.read_text() != ""
    )
    with pytest.raises(ApiError, match="was killed"):
        run(work)
    wait_for(lambda: ended(int(told.read_text())))


def test_short_work_ends_with_its_client() -> None:
    """Nobody waits for what nobody wants any more."""
    with pytest.raises(ApiError, match="hung up"):
        run(ChildTasks(Queues(), lambda: asyncio.sleep(0.3)).run(hostile.hang))


def test_work_that_goes_on_is_not_silent() -> None:
    """A task that tells how far it is may take as long as it takes, in the web process and by its own alarm."""
    told: list[tuple[int, int]] = []
    budget = Budget(silence_s=1.0)
    steps = math.ceil((budget.silence_s + GRACE_S + 1.0) / 0.25)
    tasks = ChildTasks(Queues())
    work = tasks.run_beside(hostile.take_long, steps, 0.25, budget=budget, on_step=lambda *step: told.append(step))
    assert run(work) == {"steps": steps}
    assert len(told) > steps / 3
    assert {total for _, total in told} == {steps}
    with pytest.raises(ApiError, match="did not respond for 1 s"):
        run(tasks.run_beside(hostile.take_long, 2, 3.0, budget=budget))


@pytest.mark.parametrize("mistake", [hostile.fail, hostile.miss])
def test_a_mistake_of_ours_is_in_the_log(
    mistake: Callable[..., None], capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Who asks for a task that fails is told little, the log where."""
    monkeypatch.setattr("pftrack_server.jobs.child_tasks.warnings", RateLimitedLogger("tasks"))
    with pytest.raises(RefusedError, match="cannot be read safely"):
        run(ChildTasks(Queues()).run(mistake))
    assert "on purpose" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("task", "error", "words"),
    [
        (hostile.be_killed, ApiError, "its process was killed"),
        (hostile.abort, RefusedError, "ended unexpectedly"),
        (hostile.take_too_long, RefusedError, "more than the 1 s of processor time"),
    ],
)
def test_how_a_process_ended_is_told(task: Callable[..., None], error: type[Exception], words: str) -> None:
    """One that was killed is not told to need more than it may use, and the other way round."""
    with pytest.raises(error, match=words):
        run(ChildTasks(Queues()).run_long(task, cpu_seconds=1, on_step=lambda *_: None))


TASK = """
import asyncio, sys
from pftrack_server.jobs.child_tasks import ChildTasks
from pftrack_server.jobs.child_tasks import Queues
from tests.server import hostile
task = getattr(hostile, sys.argv[1])
print(asyncio.run(ChildTasks(Queues()).run_beside(task, sys.argv[2])), flush=True)
"""


def test_a_decoder_sees_no_environment(tmp_path: Path) -> None:
    """Tokens and passwords may be in it."""
    clip = tmp_path / "clip.mp4"
    clip.write_bytes(video())
    assert ask(hostile.decode_and_look_around, str(clip)) == {}


def test_the_process_ends_with_the_web_process(tmp_path: Path) -> None:
    """When that is killed, a child that hangs is ended by the system; the token has been in no other process."""
    told = tmp_path / "child"
    program = [sys.executable, "-c", TASK, "wait_for_ever", str(told)]
    # Where nothing has been compiled, a fork server loads nothing.
    own = {**environment(), "PFTRACK_TOKEN": "secret-of-the-server", "NUMBA_CACHE_DIR": str(tmp_path)}
    with subprocess.Popen(program, env=own) as web:
        wait_for(lambda: told.exists() and told.read_text(), 60)
        child = psutil.Process(int(told.read_text()))
        parent = child.parent()
        assert parent is not None
        for process in (child, parent):
            assert b"secret-of-the-server" not in Path(f"/proc/{process.pid}/environ").read_bytes()
        web.send_signal(signal.SIGKILL)
    wait_for(lambda: ended(child.pid) and ended(parent.pid))
