"""A class in tests: a lecturer with the rights of the server, and followers in browsers of their own."""

import contextlib
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any
from urllib.parse import urlsplit

import httpx
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import ClientConnection, connect

from tests.server.host import Server, post

PATIENCE_S = 240
"""Longest wait for an answer: a loaded machine may take minutes to start a run."""


def lead(client: httpx.Client, *sessions: str, **wanted: Any) -> dict[str, Any]:
    """Let a class follow these sessions."""
    return dict(post(client, "follows", sessions=sessions, **wanted))


def change(client: httpx.Client, follow: dict[str, Any], **wanted: Any) -> httpx.Response:
    return client.patch(f"/api/v1/follows/{follow['id']}", json=wanted)


class Follower:
    """One browser that has opened the link of a class, with what it keeps."""

    def __init__(self, server: Server, link: str) -> None:
        self.place = urlsplit(link).path
        self.http = httpx.Client(base_url=f"{server.origin}{self.place}/", timeout=PATIENCE_S, verify=False)  # noqa: S501
        self.ws = server.ws.removesuffix(server.base) + self.place
        self.page = self.http.get("")

    @property
    def cookie(self) -> str:
        return "; ".join(f"{name}={value}" for name, value in self.http.cookies.items())

    def socket(self, path: str = "api/v1/follow/stream", **options: Any) -> ClientConnection:
        return connect(f"{self.ws}/{path}", additional_headers={"cookie": self.cookie}, max_size=None, **options)

    def ask(self, method: str, path: str, **body: Any) -> httpx.Response:
        return self.http.request(method, f"api/v1/{path}", json=body or None)


@contextmanager
def follower(server: Server, follow: dict[str, Any]) -> Iterator[Follower]:
    """Open the link of a class in a new browser."""
    one = Follower(server, follow["links"][0]["address"])
    try:
        yield one
    finally:
        one.http.close()


def farewell(socket: ClientConnection) -> tuple[int, str]:
    """Read to the end; return the code and the reason with which the server closed."""
    with contextlib.suppress(ConnectionClosed):
        while True:
            socket.recv(timeout=PATIENCE_S)
    return socket.close_code or 0, socket.close_reason or ""
