"""A server with a token, a lecturer who has it, and a class."""

from collections.abc import Iterator
from typing import Any

import httpx
import pytest

from pftrack.core.model.recipe import Recipe
from pftrack_server.core.settings import Settings
from pftrack_server.sessions.create import new_spec
from pftrack_server.store import Store
from pftrack_server.store.database import SessionRow
from tests.server.host import Server, begin, running
from tests.server.teaching.class_room import PATIENCE_S, Follower, follower, lead

TOKEN = "sixteen characters"


@pytest.fixture(scope="session")
def guarded(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    """A server with a token, which no follower has; it has begun with what a class has left in a crash."""
    settings = Settings(data_dir=tmp_path_factory.mktemp("data"), token=TOKEN)
    left = new_spec(Recipe(experiment="ball"))
    left.follow = "k7q2"
    store = Store(settings)
    store.save(SessionRow(id=left.id, spec=left.model_dump_json(), created=left.created))
    store.close()
    with running(settings) as server:
        assert server.app.state.services.store.all(SessionRow) == []
        yield server


@pytest.fixture(scope="session")
def lecturer(guarded: Server) -> Iterator[httpx.Client]:
    headers = {"authorization": f"Bearer {TOKEN}"}
    with httpx.Client(base_url=guarded.url, headers=headers, timeout=PATIENCE_S, verify=False) as client:  # noqa: S501
        yield client


@pytest.fixture(scope="session")
def session(lecturer: httpx.Client) -> str:
    return str(begin(lecturer, frames=40)["id"])


@pytest.fixture(scope="session")
def other(lecturer: httpx.Client) -> str:
    """A session that no class follows at first."""
    return str(begin(lecturer, frames=40)["id"])


@pytest.fixture
def follow(lecturer: httpx.Client, session: str) -> Iterator[dict[str, Any]]:
    made = lead(lecturer, session)
    yield made
    lecturer.delete(f"/api/v1/follows/{made['id']}")


@pytest.fixture
def one(guarded: Server, follow: dict[str, Any]) -> Iterator[Follower]:
    with follower(guarded, follow) as browser:
        yield browser
