"""A package whose experiment does not run harms nobody but those who begin it."""

from collections.abc import Iterator

import httpx
import pytest

from tests.browser.host import Server
from tests.installing import install

FAILING = """
from dataclasses import replace
from pftrack.experiments import find

def simulate():
    raise RuntimeError("no scene in this house")

EXPERIMENT = replace(find("sine"), id="failing", simulate=simulate, interface=1)
"""


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    place = tmp_path_factory.mktemp("installed")
    install(place, "a-failing-one", FAILING, "failing = a_failing_one:EXPERIMENT")
    server = Server(tmp_path_factory.mktemp("served"), installed=place)
    yield server
    server.stop()


def test_workers_start_beside_an_experiment_that_does_not_run(server: Server) -> None:
    """The forkserver warms all experiments; one that fails there is passed over, and sessions of others run."""
    assert "failing" in [entry["id"] for entry in server.get("experiments")]
    session = server.start_session(experiment="sine", frames=10)
    server.seek(session["id"], 9)
    assert len(server.column(session["id"], "estimate")) == 10


def test_its_own_session_is_refused_in_a_sentence(server: Server) -> None:
    """Whoever begins it is told that it failed, without the words of the exception; the server goes on."""
    answer = httpx.post(f"{server.url}/api/v1/sessions", json={"recipe": {"experiment": "failing"}}, timeout=60)
    assert answer.is_error
    message = answer.json()["error"]["message"]
    assert "RuntimeError" in message
    assert "no scene" not in message
    assert server.get("plugins") == [{"name": "failing", "package": "a-failing-one 1.0", "problem": ""}]
