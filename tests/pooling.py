"""One fork server for the pools of many tests, and sweeps without a pool: two seconds less for each sweep."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from typing import Any

import pytest

import pftrack
from pftrack.process import Child, ForkServer
from pftrack.sweep import driver, work
from pftrack.sweep.driver import open_workers

__all__ = ["computed_here", "fork_server", "shared_fork_server"]


class _Kept(ForkServer):
    """One that outlives its pools, which end their own processes."""

    def fork(self, function: Callable[..., None], *arguments: object, load: Any = None) -> Child:
        """Load what runs on the ball need before the first child: each would load that for itself."""
        return super().fork(function, *arguments, load=load or (partial(pftrack.run, frames=2), "ball"))

    def close(self) -> None:
        """Stay."""


@pytest.fixture(scope="session")
def fork_server() -> Iterator[ForkServer]:
    """What every pool starts for itself, for all of them."""
    server = _Kept(work.PRELOAD)
    yield server
    ForkServer.close(server)


@pytest.fixture(autouse=True)
def shared_fork_server(fork_server: ForkServer, monkeypatch: pytest.MonkeyPatch) -> None:
    """Have the pools of each test take that one."""
    monkeypatch.setattr(work, "_fresh", lambda: fork_server)


class _Here:
    """The only worker of a sweep is this process, which has loaded everything."""

    def __init__(self) -> None:
        self._done: list[work.Done] = []

    def free(self) -> int:
        return 1 - len(self._done)

    def share(self, recording: object) -> object:
        return recording

    def start(self, number: int, function: Callable[..., Any], *arguments: object) -> None:
        self._done.append(work.Done(number, function(*arguments)))

    def collect(self, _timeout_s: float) -> list[work.Done]:
        return [self._done.pop() for _ in self._done[:]]

    def close(self) -> None:
        """Keep what was loaded."""


@contextmanager
def without_a_pool() -> Iterator[None]:
    """Have this process compute sweeps of one job; those of more have processes of their own."""

    def found(jobs: int, cluster: str | None) -> Any:
        return _Here() if (jobs, cluster) == (1, None) else open_workers(jobs, cluster)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(driver, "open_workers", found)
        yield


@pytest.fixture(autouse=True)
def computed_here() -> Iterator[None]:
    """Do so for each test."""
    with without_a_pool():
        yield
