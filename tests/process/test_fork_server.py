"""Fork servers: processes from which others are forked."""

import json
import os
import signal
import subprocess
from collections.abc import Iterator

import psutil
import pytest

from pftrack.process import ForkServer, command, environment
from tests.process.serving_forks import endings

MODULE = "tests.process.serving_forks"
ENDINGS = {
    "exit": "ended with status 3",
    "fail": "ended with status 1",
    "return": "ended with status 0",
    "hang": "ended",
    "killed": "killed by SIGKILL",
}


@pytest.fixture
def server() -> Iterator[ForkServer]:
    made = ForkServer.fresh(MODULE)
    yield made
    made.close()


def test_it_tells_how_its_children_ended(server: ForkServer) -> None:
    """A child's status is told in words; one that had to be ended just ended."""
    assert endings(server) == ENDINGS


def test_it_may_be_forked_off_its_owner() -> None:
    """A process without threads need not start another interpreter, and its children are the same."""
    told = subprocess.run(command(MODULE), env=environment(), capture_output=True, text=True, timeout=60, check=True)
    assert json.loads(told.stdout) == ENDINGS


def test_children_end_with_it(server: ForkServer) -> None:
    """When the owner lets go, or the fork server is killed, no child goes on; its owner is told."""
    with server.start(0) as connection:
        process, parent, *_ = connection.recv()
        children = psutil.Process(process), psutil.Process(parent)
        os.kill(parent, signal.SIGKILL)
        assert not psutil.wait_procs(children, timeout=30)[1]
        assert server.end(0) == "lost with the process that had started it"
    with pytest.raises(OSError, match="Broken pipe"):
        server.start(1)


def test_it_ends_with_its_owner() -> None:
    """Closing a fork server ends what it has started, in the middle of whatever it does."""
    server = ForkServer.fresh(MODULE)
    with server.start(0) as connection:
        process, parent, *_ = connection.recv()
        connection.send("hang")
        children = psutil.Process(process), psutil.Process(parent)
        server.close()
        assert not psutil.wait_procs(children, timeout=30)[1]
