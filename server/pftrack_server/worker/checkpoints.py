"""Checkpoints: when a worker writes down what it has computed, so that a session that comes back need not wait.

What counts is the time that computing took: a run that is computed again in a moment is never written down, and one
that takes minutes is, every few seconds of them. Writing takes a small share of the time at the most.
"""

import logging
import time

from pftrack_server.worker.run_tree import RunTree

KEEP_AFTER_S = 5.0
LARGEST_SHARE = 0.05

log = logging.getLogger(__name__)


class Checkpoints:
    """The computing time of each branch that no checkpoint holds yet."""

    def __init__(self, tree: RunTree) -> None:
        self._tree = tree
        self._unkept_s: dict[str, float] = {}
        self._write_s = 0.0

    def on_frame(self, seconds: float) -> None:
        """Take note of how long a frame of the active branch took, and write a checkpoint if it is due."""
        name = self._tree.active
        unkept = self._unkept_s.get(name, 0.0) + seconds
        self._unkept_s[name] = unkept
        if unkept < max(KEEP_AFTER_S, self._write_s / LARGEST_SHARE):
            return
        self._unkept_s[name] = 0.0
        begun = time.monotonic()
        try:
            self._tree.keep_states()
        except (OSError, ValueError) as error:
            # The run can be computed again: nobody loses anything but time.
            log.warning("the states of branch %s were not kept: %s", name, error)
        self._write_s = time.monotonic() - begun
