"""What tests ask of jobs."""

from typing import Any

import httpx

from tests.server.host import error_of
from tests.waiting import wait_for


def asked(client: httpx.Client, begun: dict[str, Any]) -> dict[str, Any]:
    """Return what a job tells now."""
    return client.get(f"/api/v1/jobs/{begun['id']}").json()


def ended(client: httpx.Client, begun: httpx.Response | dict[str, Any]) -> dict[str, Any]:
    """Wait for a job that was begun, and return what it tells then."""
    if isinstance(begun, httpx.Response):
        assert begun.status_code == 202, begun.text
        begun = begun.json()
    return wait_for(lambda: (told := asked(client, begun))["state"] != "working" and told, 60, what="the job has ended")


def written(client: httpx.Client, begun: httpx.Response) -> httpx.Response:
    """Wait for an export that was begun, and return its file."""
    told = ended(client, begun)
    assert told["state"] == "done", told["error"]
    return client.get(told["result"]["address"])


def taken(client: httpx.Client, session: str, export: str) -> httpx.Response:
    """Have a session written as a file, and return that."""
    return written(client, client.post(f"/api/v1/sessions/{session}/exports/{export}"))


def send_run(client: httpx.Client, content: bytes, name: str = "x.pft") -> httpx.Response:
    """Send a saved run."""
    return client.post("/api/v1/runs/import", files={"file": (name, content)})


def bring_in(client: httpx.Client, content: bytes, name: str = "x.pft") -> dict[str, Any]:
    """Send a saved run, and return it once it has been computed."""
    told = ended(client, send_run(client, content, name))
    assert told["state"] == "done", told["error"]
    return told["result"]


def import_refusal(client: httpx.Client, content: bytes) -> str:
    """Send a saved run that is refused, at once or once it is computed, and return why."""
    answer = send_run(client, content)
    message = ended(client, answer)["error"] if answer.is_success else error_of(answer, 422)["message"]
    assert message
    return message
