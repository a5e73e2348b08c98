"""A bare websocket client, so small that hundreds can run together with the server that they measure.

It keeps only the length and the beginning of a message, and reads only a server's messages: unmasked, one frame each.
"""

import asyncio
import base64
import os
import time
from collections.abc import Callable
from typing import cast
from urllib.parse import urlsplit

__all__ = ["BareSocket", "open_socket"]

KEPT = 160
"""Bytes of the beginning of a message that are kept."""
TEXT, CLOSE, PING, PONG = 0x1, 0x8, 0x9, 0xA
SHORT, MEDIUM = 126, 127

Take = Callable[["BareSocket", float, bytes, int], None]


class BareSocket(asyncio.Protocol):
    """One socket.

    Args:
        request: The handshake.
        take: Called with the socket, the time (s), the beginning and the length of each message.

    Attributes:
        opened: Done when the server has agreed.
        closed: Why the server closed it; None while it is open.
    """

    transport: asyncio.Transport

    def __init__(self, request: bytes, take: Take) -> None:
        self.opened: asyncio.Future[None] = asyncio.get_running_loop().create_future()
        self.closed: str | None = None
        self._request, self._take = request, take
        self._buffer = bytearray()
        self._code = self._length = self._left = 0
        self._start = b""

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Begin the handshake."""
        self.transport = cast("asyncio.Transport", transport)
        self.transport.write(self._request)

    def connection_lost(self, exc: Exception | None) -> None:
        """Note the end."""
        self.closed = self.closed or str(exc or "the connection broke")
        if not self.opened.done():
            self.opened.set_exception(ConnectionError(self.closed))

    def data_received(self, data: bytes) -> None:
        """Read the received data, without copying the parts that are not kept."""
        now = time.perf_counter()
        if not self.opened.done():
            data = self._agreed(data)
        at = 0
        while at < len(data):
            if self._left:
                step = min(self._left, len(data) - at)
                if len(self._start) < KEPT:
                    self._start += data[at : at + min(step, KEPT - len(self._start))]
                at, self._left = at + step, self._left - step
            else:
                self._buffer += data[at : at + 1]
                at += 1
                self._read_header()
            if self._length and not self._left:
                self._message(now)

    def send(self, text: str) -> None:
        """Send a short text."""
        self._write(TEXT, text.encode())

    def _write(self, code: int, payload: bytes) -> None:
        # A client must use a mask; it may be zero.
        self.transport.write(bytes((0x80 | code, 0x80 | len(payload))) + bytes(4) + payload)

    def _agreed(self, data: bytes) -> bytes:
        self._buffer += data
        head, found, rest = bytes(self._buffer).partition(b"\r\n\r\n")
        if not found:
            return b""
        self._buffer.clear()
        if b" 101 " in head.split(b"\r\n")[0]:
            self.opened.set_result(None)
        else:
            self.opened.set_exception(ConnectionError(f"{head.splitlines()[0].decode()} {rest[:200].decode()}"))
        return rest

    def _read_header(self) -> None:
        head = self._buffer
        size = 2 if len(head) < 2 else {SHORT: 4, MEDIUM: 10}.get(head[1] & 0x7F, 2)
        if len(head) < size:
            return
        self._code, self._start = head[0] & 0x0F, b""
        self._length = self._left = (head[1] & 0x7F) if size == 2 else int.from_bytes(head[2:size], "big")
        head.clear()

    def _message(self, now: float) -> None:
        length, self._length = self._length, 0
        if self._code == CLOSE:
            self.closed = self._start[2:].decode()
            self.transport.close()
        elif self._code == PING:
            self._write(PONG, self._start)
        else:
            self._take(self, now, self._start, length)


async def open_socket(address: str, take: Take, headers: dict[str, str]) -> BareSocket:
    """Open a websocket.

    Args:
        address: Address such as `ws://host:port/path?query`.
        take: Called with the socket, the time (s), the beginning and the length of each message.
        headers: Headers to send.
    """
    parts = urlsplit(address)
    key = base64.b64encode(os.urandom(16)).decode()
    lines = [
        f"GET {parts.path}?{parts.query} HTTP/1.1",
        f"Host: {parts.netloc}",
        "Upgrade: websocket",
        "Connection: Upgrade",
        f"Sec-WebSocket-Key: {key}",
        "Sec-WebSocket-Version: 13",
        *(f"{name}: {value}" for name, value in headers.items()),
    ]
    request = "\r\n".join([*lines, "", ""]).encode()
    loop = asyncio.get_running_loop()
    _, socket = await loop.create_connection(lambda: BareSocket(request, take), parts.hostname, parts.port)
    await socket.opened
    return socket
