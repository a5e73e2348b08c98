"""Sweeps that start with their code loaded, and give way to nobody."""

from collections.abc import Iterator

import httpx
import pytest

from pftrack_server.sweeps import functions, sweep
from tests.server.host import Server, begin
from tests.server.sweeping import compute_unmeasured


@pytest.fixture(scope="session", autouse=True)
def loaded(server: Server) -> None:
    """Have the fork server load what a session on the ball loads: each sweep's processes are forked from it."""
    with httpx.Client(base_url=server.url, timeout=240, verify=False) as client:  # noqa: S501
        client.delete(f"/api/v1/sessions/{begin(client)['id']}")


@pytest.fixture(scope="module", autouse=True)
def awaited() -> Iterator[None]:
    """Have sweeps begin at once and compete as equals: on a busy machine a test would wait for minutes."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sweep, "NICENESS", 0)
        patch.setattr(functions, "compute", compute_unmeasured)
        yield
