"""Changes reach the session one batch at a time, the newest value of each control."""

import threading

import pytest

from pftrack.parameters import Value
from server.viewer.changes import Coalescer
from tests.viewer.host import wait_for


def test_the_first_change_leaves_at_once() -> None:
    """There is nothing to wait for."""
    sent: list[dict[str, Value]] = []
    Coalescer(sent.append).offer("a", 1)
    wait_for(lambda: sent == [{"a": 1}])


def test_what_comes_meanwhile_leaves_together_and_only_the_newest() -> None:
    """A drag that outruns the session is not replayed."""
    sent: list[dict[str, Value]] = []
    free, entered = threading.Event(), threading.Event()

    def send(batch: dict[str, Value]) -> None:
        sent.append(batch)
        entered.set()
        free.wait(5)

    changes = Coalescer(send)
    changes.offer("a", 1)
    assert entered.wait(5)
    for value in range(2, 30):
        changes.offer("a", value)
    changes.offer("b", True)
    free.set()
    wait_for(lambda: not changes.busy)
    assert sent == [{"a": 1}, {"a": 29, "b": True}]


def test_whoever_offers_does_not_wait() -> None:
    """A value is offered by the loop that serves all browsers, and a session may take its time."""
    free = threading.Event()
    changes = Coalescer(lambda batch: free.wait(5))
    changes.offer("a", 1)
    assert changes.busy
    free.set()
    wait_for(lambda: not changes.busy)


def test_a_change_that_fails_does_not_block_the_next(caplog: pytest.LogCaptureFixture) -> None:
    """The failure is logged, and the control still works."""
    sent: list[dict[str, Value]] = []

    def send(batch: dict[str, Value]) -> None:
        sent.append(batch)
        if len(sent) == 1:
            raise RuntimeError("the worker has gone")

    changes = Coalescer(send)
    changes.offer("a", 1)
    wait_for(lambda: len(sent) == 1)
    changes.offer("a", 2)
    wait_for(lambda: sent == [{"a": 1}, {"a": 2}])
    assert "the worker has gone" in caplog.text


def test_nothing_leaves_after_closing() -> None:
    """A closed session is not disturbed."""
    sent: list[dict[str, Value]] = []
    changes = Coalescer(sent.append)
    changes.close()
    changes.offer("a", 1)
    assert not changes.busy
    assert sent == []
