"""Workers, tasks and pools: nobody waits for another's call, and one that goes wild harms nobody else."""

import asyncio
import math
import os
import pickle
import time
from collections.abc import Callable
from concurrent.futures import CancelledError
from contextlib import suppress
from dataclasses import replace
from typing import Any

import numpy as np
import psutil
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pftrack.process import (
    UNLIMITED,
    AsyncEnd,
    BackgroundLoop,
    BlockingEnd,
    BlockingPool,
    Budget,
    CallError,
    Ending,
    Fault,
    ForkServer,
    Pool,
    Refusal,
    Reply,
    WorkerLostError,
    report,
    run_task,
)
from pftrack.process.calls import Answer, Step, pack, unpack
from pftrack.process.child import pair
from tests.apart import run
from tests.process.children import count, refuse, tell


def pool_of(server: ForkServer, budget: Budget = UNLIMITED) -> Pool:
    return Pool(server, most=4, kept=2, budget=budget, refusals=(LookupError,))


async def test_nobody_waits_for_a_slow_one(server: ForkServer) -> None:
    """While one call sleeps for minutes, another is answered; the first ends with who waits for it.

    Calls one after the other have the same process, which is another than this one; one that the system takes while
    it waits, to have its memory, is replaced.
    """
    pool = pool_of(server)
    slow = asyncio.create_task(pool.call(time.sleep, 600))
    sleeper = await pool.call(os.getpid)
    assert not slow.done()
    slow.cancel()
    await asyncio.gather(slow, return_exceptions=True)
    assert os.getpid() != await pool.call(os.getpid) == sleeper
    psutil.Process(sleeper).kill()
    await pool._free[0]._gone.wait()
    assert await pool.call(len, "four") == 4
    await pool.close()


@pytest.mark.parametrize(
    ("call", "error", "message"),
    [
        ((os.abort,), WorkerLostError, "killed by SIGABRT"),
        ((time.sleep, 600), WorkerLostError, "killed by SIGKILL"),
        ((bytearray, 1 << 40), MemoryError, "1024 MiB that it may use"),
        ((int, "x"), CallError, "ValueError: invalid literal"),
        ((open, os.devnull), CallError, "cannot pickle"),
        ((refuse,), KeyError, "of this name"),
    ],
)
async def test_what_goes_wrong_is_told(
    server: ForkServer, call: tuple[Callable[..., Any]], error: type[Exception], message: str
) -> None:
    """A process that dies, falls silent, asks for too much or fails is one answer; the next call is fine."""
    pool = pool_of(server, Budget(silence_s=0.3 if call[0] is time.sleep else 60.0))
    with pytest.raises(error, match=message):
        await pool.call(*call)
    assert await pool.call(len, "four") == 4
    await pool.close()


def test_tasks_tell_what_came_of_them(server: ForkServer) -> None:
    """A task has a process of its own; its answer is JSON, and an ending says how it ended without one.

    In a notebook a loop runs in the very thread that waits; tasks run side by side, and closing ends them.
    """

    def come(function: Callable[..., Any], *arguments: object, silence_s: float = 60.0, **more: Any) -> object:
        budget = Budget(silence_s=silence_s)
        return run(run_task(server, function, *arguments, budget=budget, refusals=(LookupError,), **more))

    async def wait() -> object:
        with BackgroundLoop("tasks") as loop:
            endless = loop.submit(run_task(server, time.sleep, 600, budget=UNLIMITED))
            answer = loop.submit(run_task(server, len, "four", budget=UNLIMITED)).result(60)
        with pytest.raises(CancelledError):
            endless.result(0)
        return answer

    told: list[Any] = []
    assert come(count, 3, on_step=told.append) == Reply("done")
    assert told
    assert set(map(tuple, told)) <= {(done, 3) for done in range(1, 4)}
    assert come(refuse) == Refusal("'of this name'")
    assert come(time.sleep, 60, silence_s=0.5) is Ending.OUT_OF_TIME
    assert come(time.sleep, 60, stopped=lambda: True) is Ending.KILLED
    assert come(os.abort) is Ending.CRASHED
    assert "may hold what JSON can say" in come(object).name
    assert run(wait()) == Reply(4)


def test_a_program_without_a_loop_has_futures() -> None:
    """Calls run side by side; news arrive, faults are raised, and closing ends whatever goes on."""
    pool = BlockingPool(ForkServer("pftrack.process"), processes=2, budget=replace(UNLIMITED, niceness=1))
    told: list[object] = []
    pool.submit(tell, "one", {"two": 2}, on_step=told.append).result(60)
    assert told == ["one", {"two": 2}]
    assert pool.submit(os.nice, 0).result(60) == min(os.nice(0) + 1, 19)
    with pytest.raises(CallError, match="ValueError"):
        pool.submit(math.factorial, -1).result(60)
    endless = pool.submit(time.sleep, 600)
    assert pool.submit(os.getpid).result(60) != os.getpid()
    pool.close()
    pool.close()
    with pytest.raises(CancelledError):
        endless.result()
    report("to nobody")


# What goes between a process and its child: answers as JSON, and the pipe.

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

    Text of a file is never taken for bytes, even if it copies the form of an earlier answer.
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
        b'{"refusal": 3}',
        b'{"done": "1", "total": 2}',
        b'{"value": 1, "refusal": "b"}',
        b'{"value": {"0123456789abcdef": "=no="}}',
        b"\xff\xfe",
        b"[" * 100_000,
        pickle.dumps(Reply(1)),
    ],
)
def test_nonsense_is_refused(data: bytes) -> None:
    """Only an answer is read as one, with its tag or without; anything else raises ValueError."""
    for text in (data, b"0123456789abcdef" + data):
        with pytest.raises(ValueError):  # noqa: PT011 - each parser has words of its own
            unpack(bytearray(text))


# The pipe between a process and its child.


async def test_there_and_back() -> None:
    """Messages arrive whole and in order, however large they are, and a hang-up is noticed on both sides."""
    ours, theirs = pair()
    heard: asyncio.Queue[Any] = asyncio.Queue()
    lost = asyncio.Event()
    web = await AsyncEnd.connect(ours, heard.put_nowait, lost.set)
    worker = BlockingEnd(theirs)
    messages = ["a credit", (7, b"x" * 5_000_000), "alive"]
    for message in messages:
        web.send(message)
        assert await asyncio.to_thread(worker.receive, 60) == message
        await asyncio.to_thread(worker.send, message)
    assert worker.receive(0) is None
    assert [await asyncio.wait_for(heard.get(), 60) for _ in messages] == messages
    web.close()
    await asyncio.wait_for(lost.wait(), 60)
    with pytest.raises((EOFError, ConnectionResetError)):
        worker.receive(5)
    theirs.close()


async def test_what_is_no_message() -> None:
    """Half a message stops nobody else; an absurd length closes the pipe rather than fill the memory."""
    for sent, is_lost in ((b"\0\0\0\0\0\0\0\x10half", False), (b"\xff" * 8, True)):
        ours, theirs = pair()
        heard: list[Any] = []
        lost = asyncio.Event()
        web = await AsyncEnd.connect(ours, heard.append, lost.set)
        theirs.sendall(sent)
        with suppress(TimeoutError):
            await asyncio.wait_for(lost.wait(), 60 if is_lost else 0.05)
        assert (heard, lost.is_set()) == ([], is_lost)
        web.close()
        await asyncio.sleep(0)
        theirs.close()
