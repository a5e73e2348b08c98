"""What tests ask of a session."""

from typing import Any

import httpx


def get(client: httpx.Client, session: str) -> dict[str, Any]:
    return client.get(f"/api/v1/sessions/{session}").json()


def timeline_of(session: dict[str, Any]) -> list[dict[str, Any]]:
    """Return a session's timeline as a client writes one."""
    return [{"frame": change["frame"], "values": change["values"]} for change in session["timeline"]]


def columns(client: httpx.Client, session: str, branch: str | None = None) -> dict[str, list[Any]]:
    query = {"branch": branch} if branch else {}
    return client.get(f"/api/v1/sessions/{session}/diagnostics", params=query).json()["columns"]
