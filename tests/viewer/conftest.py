"""One session with its viewer, the web server before it, and those who look at it."""

from collections.abc import Iterator

import pytest

from tests.viewer.host import Peer, Session, Site, wait_for


@pytest.fixture
def session() -> Iterator[Session]:
    made = Session()
    yield made
    made.viewer.close()


@pytest.fixture
def site(session: Session) -> Iterator[Site]:
    made = Site(session)
    yield made
    made.close()


@pytest.fixture
def peer(session: Session) -> Iterator[Peer]:
    with Peer(f"ws://127.0.0.1:{session.viewer.port}") as made:
        wait_for(lambda: session.viewer.clients == 1)
        yield made
