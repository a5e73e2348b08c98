"""Sweeps that start with their code loaded, and give way to nobody."""

from collections.abc import Iterator

import httpx
import pytest

from pftrack_server.sweeps import sweep
from tests.server.host import Server, begin


@pytest.fixture(scope="session", autouse=True)
def loaded(server: Server) -> None:
    """Have the fork server load what a session on the ball loads: each sweep's processes are forked from it."""
    with httpx.Client(base_url=server.url, timeout=240, verify=False) as client:  # noqa: S501
        client.delete(f"/api/v1/sessions/{begin(client)['id']}")


@pytest.fixture(scope="session", autouse=True)
def awaited() -> Iterator[None]:
    """Have sweeps compete as equals: on a busy machine a test would wait for minutes, and asking takes time as well."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sweep, "NICENESS", 0)
        yield
