"""Workers that stand still on the way to a frame until a test lets them go on: a long way that costs no time."""

import socket
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from pftrack.core.files import write_whole
from pftrack_server.sessions.spec import Goal
from pftrack_server.sessions.worker import worker
from pftrack_server.sessions.worker.protocol import WorkerConfig
from pftrack_server.sessions.worker.run_tree import RunTree

__all__ = ["allow", "held_worker", "held_worker_that_keeps_all"]

LOOK_S = 0.02
EVERY = 1_000_000


def held_worker(end: socket.socket, config: WorkerConfig) -> None:
    """What a worker does that computes no more frames than `allow` says, and all of them before it was called."""

    def way(tree: RunTree, goal: Goal) -> Iterator[dict[str, Any] | None]:
        for row in straight(tree, goal):
            yield row
            while goal.computed > tree.run.computed >= int(allowed.read_text() if allowed.exists() else EVERY):
                time.sleep(LOOK_S)
                yield None

    assert config.states is not None
    allowed = Path(config.states).with_name("allowed")
    straight, RunTree.seek_steps = RunTree.seek_steps, way  # type: ignore[method-assign]
    worker.main(end, config)


def held_worker_that_keeps_all(end: socket.socket, config: WorkerConfig) -> None:
    """What such a worker does that writes every frame down, as if each had taken seconds."""
    worker.KEEP_AFTER_S, worker.LARGEST_SHARE = 0.0, float("inf")
    held_worker(end, config)


def allow(data: Path, frames: int = EVERY) -> None:
    """Let the workers of a server compute so many frames."""
    write_whole(data / "states" / "allowed", str(frames).encode())
