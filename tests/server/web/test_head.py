"""HEAD, seen from behind: what answers a GET, and knows nothing of it."""

from starlette.types import Message, Receive, Scope, Send

from pftrack_server.web.middleware import HeadAsGet
from tests.apart import run


async def endless(scope: Scope, receive: Receive, send: Send) -> None:
    """Answer GET piece by piece, until the client is gone."""
    assert scope["method"] == "GET"
    await send({"type": "http.response.start", "status": 200, "headers": [(b"content-length", b"9")]})
    await send({"type": "http.response.body", "body": b"first", "more_body": True})
    for _ in range(1000):
        await send({"type": "http.response.body", "body": b"piece", "more_body": True})
        if (await receive())["type"] == "http.disconnect":
            return
    raise AssertionError("nobody said that the client is gone")


async def asked() -> list[Message]:
    sent: list[Message] = []

    async def receive() -> Message:
        return {"type": "http.request", "body": b"", "more_body": False}

    async def send(message: Message) -> None:
        sent.append(message)

    await HeadAsGet(endless)({"type": "http", "method": "HEAD"}, receive, send)
    return sent


def test_an_answer_without_end_ends_with_its_head() -> None:
    """Its headers go out, nothing of its body, and it is told to stop after the first piece."""
    start, body = run(asked())
    assert (start["status"], start["headers"]) == (200, [(b"content-length", b"9")])
    assert (body["body"], body.get("more_body", False)) == (b"", False)
