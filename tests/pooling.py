"""One fork server for the pools of many tests: a second of processor time less for each sweep."""

from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

import pytest

import pftrack
from pftrack.process import Child, ForkServer
from pftrack.sweep import work

__all__ = ["fork_server", "shared_fork_server"]


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
