"""What the forkserver has ready is shared by all workers, and stays so."""

import gc

from server.tasks.child_tasks import ChildTasks
from server.tasks.queue import Queues
from tests.server.apart import run


def test_a_workers_garbage_collector_leaves_what_is_shared_alone() -> None:
    """Otherwise its first full collection copies the pages of everything that was preloaded."""
    frozen = run(ChildTasks(Queues(), 1 << 30).run(gc.get_freeze_count))
    assert frozen > 100_000
