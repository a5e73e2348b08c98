"""What goes between a process and its child: answers as JSON, and the pipe."""

import asyncio
import pickle
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pftrack.process import AsyncEnd, BlockingEnd, Fault, Refusal, Reply
from pftrack.process.calls import Answer, Step, pack, unpack
from pftrack.process.child import pair

VALUES = st.recursive(
    st.none() | st.booleans() | st.integers(-(2**70), 2**70) | st.floats(allow_nan=False) | st.text() | st.binary(),
    lambda inner: st.lists(inner) | st.dictionaries(st.text(), inner),
    max_leaves=8,
)


@given(VALUES)
def test_a_result_comes_back(value: object) -> None:
    """Whatever JSON can say, and bytes anywhere in it, is read as it was written, to the last bit."""
    assert unpack(pack(Reply(value))) == Reply(value)


def test_an_answer_comes_back() -> None:
    """Refusals, faults and steps are answers as well, and numbers of NumPy are numbers.

    What a file says is told from what was bytes, even if it copies the form of an answer that was seen before.
    """
    tag = pack(Reply(b""))[:16].decode()
    copies = (Reply(value) for value in ({"base64": "eHg="}, {tag: "eHg="}, {tag: "no base64"}))
    for answer in (*copies, Refusal("the file is empty \udcff"), Fault("KeyError: 3", "Traceback"), Step((3, 7))):
        assert unpack(pack(answer)) == answer
    measured = Reply({"hits": np.int64(3), "share": np.float32(0.5), "success": np.bool_(True)})
    assert unpack(pack(measured)) == Reply({"hits": 3, "share": 0.5, "success": True})


@pytest.mark.parametrize("answer", [Step(3), Reply(object()), Reply({1, 2})])
def test_what_cannot_be_said_is_refused(answer: Answer) -> None:
    """A task that returns something else is a mistake of ours, and noticed where it is made."""
    with pytest.raises(TypeError, match="not "):
        pack(answer)


@pytest.mark.parametrize(
    "data",
    [
        b"",
        b"null",
        b"[]",
        b"{}",
        b'{"refusal": 3}',
        b'{"fault": ["a"], "traceback": "b"}',
        b'{"done": "1", "total": 2}',
        b'{"value": 1, "refusal": "b"}',
        b'{"value": {"0123456789abcdef": "=no="}}',
        b'{"value": {"0123456789abcdef": 7}}',
        b"\xff\xfe",
        b"[" * 100_000,
        b"1" * 10_000,
        pickle.dumps(Reply(1)),
    ],
)
def test_nonsense_is_refused(data: bytes) -> None:
    """Nothing but an answer is read as one, with its tag or without, and no other exception comes of it."""
    for text in (data, b"0123456789abcdef" + data):
        with pytest.raises(ValueError):  # noqa: PT011 - each parser has words of its own
            unpack(bytearray(text))


@given(st.binary())
def test_no_bytes_do_harm(data: bytes) -> None:
    """Random bytes are refused."""
    with pytest.raises(ValueError):  # noqa: PT011 - each parser has words of its own
        unpack(data)


# The pipe between a process and its child.


async def test_there_and_back() -> None:
    """Messages arrive whole and in order, however large they are, and a hang-up is noticed on both sides."""
    ours, theirs = pair()
    heard: list[Any] = []
    lost, both = asyncio.Event(), asyncio.Event()

    def hear(message: Any) -> None:
        heard.append(message)
        if len(heard) == 2:
            both.set()

    web = await AsyncEnd.connect(ours, hear, lost.set)
    worker = BlockingEnd(theirs)
    for message in ("a credit", (7, "a picture")):
        web.send(message)
    assert [await asyncio.to_thread(worker.receive, 5) for _ in range(2)] == ["a credit", (7, "a picture")]
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
