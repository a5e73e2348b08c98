"""The pipe between a process and its child: whole messages over a socket pair, length first.

The child's end blocks, as it has nothing else to do. The parent's end never does: a child that is stopped in the middle
of a message must not stop everybody else, which is why `multiprocessing`'s own connections will not do here.
"""

import asyncio
import pickle
import select
import socket
import struct
from collections.abc import Callable
from typing import Any, cast

Pack = Callable[[Any], bytes]
Unpack = Callable[[bytearray], Any]

LENGTH = struct.Struct("!Q")
LARGEST_MESSAGE = 256 * 1024 * 1024
BUFFER_BYTES = 1024 * 1024


def pair() -> tuple[socket.socket, socket.socket]:
    """Return two connected ends with room for a picture in between."""
    ends = socket.socketpair()
    for end in ends:
        end.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, BUFFER_BYTES)
    return ends


def _pickle(message: object) -> bytes:
    return pickle.dumps(message, protocol=5)


def _with_length(body: bytes) -> list[bytes]:
    return [LENGTH.pack(len(body)), body]


class BlockingEnd:
    """An end that waits, as a child's does.

    Args:
        end: One end of a pair.
        pack: Writes a message, as the other end reads it.
    """

    def __init__(self, end: socket.socket, pack: Pack = _pickle) -> None:
        self._socket = end
        self._socket.setblocking(True)
        self._pack = pack

    def send(self, message: object) -> None:
        """Send a message, waiting while the other end is busy."""
        for part in _with_length(self._pack(message)):
            self._socket.sendall(part)

    def receive(self, wait_s: float | None = None) -> Any:  # noqa: ANN401 - whatever the parent has sent
        """Return the parent's next message, or None when none came in time.

        Args:
            wait_s: How long to wait; None for ever.

        Raises:
            EOFError: The other end is closed.
        """
        if wait_s is not None and not select.select([self._socket], [], [], max(0.0, wait_s))[0]:
            return None
        (length,) = LENGTH.unpack(self._exactly(LENGTH.size))
        return pickle.loads(self._exactly(length))  # noqa: S301 - from the process that made us

    def _exactly(self, length: int) -> bytearray:
        data = bytearray(length)
        view = memoryview(data)
        while view:
            count = self._socket.recv_into(view)
            if count == 0:
                raise EOFError
            view = view[count:]
        return data


class AsyncEnd(asyncio.BufferedProtocol):
    """The parent's end: reads straight into the buffer of the message that is coming."""

    def __init__(
        self,
        on_message: Callable[[Any], None],
        on_lost: Callable[[], None],
        unpack: Unpack,
        most_bytes: int,
    ) -> None:
        self._on_message = on_message
        self._on_lost = on_lost
        self._unpack = unpack
        self._most_bytes = most_bytes
        self._transport: asyncio.WriteTransport | None = None
        self._buffer = bytearray(LENGTH.size)
        self._filled = 0
        self._in_body = False

    @classmethod
    async def connect(
        cls,
        end: socket.socket,
        on_message: Callable[[Any], None],
        on_lost: Callable[[], None],
        unpack: Unpack = pickle.loads,
        most_bytes: int = LARGEST_MESSAGE,
    ) -> "AsyncEnd":
        """Take over one end of a pair and call back for every message, and once when the child is gone.

        Args:
            end: It.
            on_message: Is called with every message.
            on_lost: Is called when the child is gone, or has sent what is no message.
            unpack: Reads a message, or raises a `ValueError`. A pickle is read of nobody but a process that runs our
                own program.
            most_bytes: Length of a message.
        """
        end.setblocking(False)
        loop = asyncio.get_running_loop()
        _, protocol = await loop.create_unix_connection(lambda: cls(on_message, on_lost, unpack, most_bytes), sock=end)
        return protocol

    def send(self, message: object) -> None:
        """Send a message without waiting; to a child that is gone it is lost."""
        if self._transport is not None and not self._transport.is_closing():
            self._transport.write(b"".join(_with_length(_pickle(message))))

    def close(self) -> None:
        """Hang up; the child ends when it notices."""
        if self._transport is not None:
            self._transport.abort()

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Keep the transport (asyncio)."""
        # uvloop's transports are such, too, but do not inherit from asyncio's.
        self._transport = cast("asyncio.WriteTransport", transport)

    def get_buffer(self, sizehint: int) -> memoryview:  # noqa: ARG002 - asyncio's signature
        """Offer what is left of the current message (asyncio)."""
        return memoryview(self._buffer)[self._filled :]

    def buffer_updated(self, nbytes: int) -> None:
        """Take note of what came, and hand over whole messages (asyncio)."""
        self._filled += nbytes
        if self._filled < len(self._buffer):
            return
        buffer, self._filled = self._buffer, 0
        if not self._in_body:
            (length,) = LENGTH.unpack(buffer)
            if not 0 < length <= self._most_bytes:
                self.close()
                return
            self._buffer, self._in_body = bytearray(length), True
            return
        self._buffer, self._in_body = bytearray(LENGTH.size), False
        try:
            message = self._unpack(buffer)
        except ValueError:
            self.close()
            return
        self._on_message(message)

    def connection_lost(self, exc: Exception | None) -> None:  # noqa: ARG002 - asyncio's signature
        """Tell that the child is gone (asyncio)."""
        self._on_lost()
