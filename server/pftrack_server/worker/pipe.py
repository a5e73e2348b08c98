"""The pipe between web process and worker: whole messages over a socket pair, length first.

The worker's end blocks, as it has nothing else to do. The web process's end never does: a worker that is stopped in the
middle of a message must not stop everybody else, which is why `multiprocessing`'s own connections will not do here.
"""

import asyncio
import pickle
import select
import socket
import struct
from collections.abc import Callable
from typing import cast

from pftrack_server.worker.protocol import Call, Credit, Event, Request

__all__ = ["WebEnd", "WorkerEnd", "pair"]

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


class WorkerEnd:
    """The worker's end: blocking.

    Args:
        end: One end of a pair.
        pack: Writes an event, as the other end reads it.
    """

    def __init__(self, end: socket.socket, pack: Callable[[Event], bytes] = _pickle) -> None:
        self._socket = end
        self._socket.setblocking(True)
        self._pack = pack

    def send(self, event: Event) -> None:
        """Send an event, waiting while the web process is busy."""
        for part in _with_length(self._pack(event)):
            self._socket.sendall(part)

    def receive(self, wait_s: float) -> Request | Credit | Call | None:
        """Return the next command, or None when none came in time.

        Raises:
            EOFError: The web process is gone.
        """
        if not select.select([self._socket], [], [], max(0.0, wait_s))[0]:
            return None
        (length,) = LENGTH.unpack(self._exactly(LENGTH.size))
        message: Request | Credit | Call = pickle.loads(self._exactly(length))  # noqa: S301 - from the process that made us
        return message

    def _exactly(self, length: int) -> bytearray:
        data = bytearray(length)
        view = memoryview(data)
        while view:
            count = self._socket.recv_into(view)
            if count == 0:
                raise EOFError
            view = view[count:]
        return data


class WebEnd(asyncio.BufferedProtocol):
    """The web process's end: reads straight into the buffer of the message that is coming."""

    def __init__(
        self,
        on_event: Callable[[Event], None],
        on_lost: Callable[[], None],
        unpack: Callable[[bytearray], Event],
        most_bytes: int,
    ) -> None:
        self._on_event = on_event
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
        on_event: Callable[[Event], None],
        on_lost: Callable[[], None],
        unpack: Callable[[bytearray], Event] = pickle.loads,
        most_bytes: int = LARGEST_MESSAGE,
    ) -> "WebEnd":
        """Take over one end of a pair and call back for every event, and once when the worker is gone.

        Args:
            end: It.
            on_event: Is called with every event.
            on_lost: Is called when the worker is gone, or has sent what is no event.
            unpack: Reads an event, or raises a `ValueError`. A pickle is read of nobody but a process that runs our
                own program.
            most_bytes: Length of an event.
        """
        end.setblocking(False)
        loop = asyncio.get_running_loop()
        _, protocol = await loop.create_unix_connection(lambda: cls(on_event, on_lost, unpack, most_bytes), sock=end)
        return protocol

    def send(self, message: Request | Credit | Call) -> None:
        """Send a command without waiting; to a worker that is gone it is lost."""
        if self._transport is not None and not self._transport.is_closing():
            self._transport.write(b"".join(_with_length(_pickle(message))))

    def close(self) -> None:
        """Hang up; the worker ends when it notices."""
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
            event = self._unpack(buffer)
        except ValueError:
            self.close()
            return
        self._on_event(event)

    def connection_lost(self, exc: Exception | None) -> None:  # noqa: ARG002 - asyncio's signature
        """Tell that the worker is gone (asyncio)."""
        self._on_lost()
