"""The pipe between a process and its child."""

import asyncio
from typing import Any

import pytest

from pftrack.process import AsyncEnd, BlockingEnd
from pftrack.process.child import pair


async def test_there_and_back() -> None:
    """Messages arrive whole and in order, however large they are, and a hang-up is noticed on both sides."""
    ours, theirs = pair()
    heard: list[Any] = []
    lost = asyncio.Event()
    both = asyncio.Event()

    def hear(message: Any) -> None:
        heard.append(message)
        if len(heard) == 2:
            both.set()

    web = await AsyncEnd.connect(ours, hear, lost.set)
    worker = BlockingEnd(theirs)
    web.send("a credit")
    web.send((7, "a picture"))
    assert await asyncio.to_thread(worker.receive, 5) == "a credit"
    assert await asyncio.to_thread(worker.receive, 5) == (7, "a picture")
    assert worker.receive(0) is None
    large = b"x" * 5_000_000
    await asyncio.to_thread(worker.send, (1, large))
    await asyncio.to_thread(worker.send, "alive")
    await asyncio.wait_for(both.wait(), 60)
    assert heard == [(1, large), "alive"]
    web.close()
    await asyncio.wait_for(lost.wait(), 60)
    with pytest.raises((EOFError, ConnectionResetError)):
        worker.receive(5)
    theirs.close()


async def test_half_a_message() -> None:
    """A worker that stops in the middle of a message stops nobody else."""
    ours, theirs = pair()
    heard: list[Any] = []
    web = await AsyncEnd.connect(ours, heard.append, lambda: None)
    theirs.sendall(b"\0\0\0\0\0\0\0\x10half")
    await asyncio.sleep(0.05)
    assert heard == []
    web.close()
    await asyncio.sleep(0)
    theirs.close()


async def test_an_absurd_length() -> None:
    """A length that cannot be closes the pipe rather than fill the memory."""
    ours, theirs = pair()
    lost = asyncio.Event()
    await AsyncEnd.connect(ours, lambda _: None, lost.set)
    theirs.sendall(b"\xff" * 8)
    await asyncio.wait_for(lost.wait(), 60)
    theirs.close()
