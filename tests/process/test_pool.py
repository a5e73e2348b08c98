"""Workers, tasks and pools: nobody waits for another's call, and one that goes wild harms nobody else."""

import asyncio
import math
import os
import time
from collections.abc import Callable, Generator, Iterator
from concurrent.futures import CancelledError
from dataclasses import replace
from typing import Any

import psutil
import pytest

from pftrack.process import (
    UNLIMITED,
    BackgroundLoop,
    BlockingPool,
    Budget,
    CallError,
    Ending,
    ForkServer,
    Pool,
    Refusal,
    Reply,
    WorkerLostError,
    report,
    run_task,
)
from pftrack.process.calls import TELL_S
from tests.apart import run


@pytest.fixture(scope="module")
def server() -> Iterator[ForkServer]:
    made = ForkServer("pftrack.process")
    yield made
    made.close()


def pool_of(server: ForkServer, budget: Budget = UNLIMITED) -> Pool:
    return Pool(server, most=4, kept=2, budget=budget, refusals=(LookupError,))


def refuse() -> None:
    raise KeyError("of this name")


def count(steps: int) -> Generator[tuple[int, int], None, str]:
    for step in range(steps):
        time.sleep(TELL_S)
        yield step + 1, steps
    return "done"


def tell(*news: object) -> None:
    for each in news:
        report(each)


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


def leave(status: int) -> None:
    """End at once. A function of one's own, since tools that measure coverage replace `os._exit`."""
    os._exit(status)


@pytest.mark.parametrize(
    ("call", "error", "message"),
    [
        ((leave, 1), WorkerLostError, "ended with status 1"),
        ((os.abort,), WorkerLostError, "killed by SIGABRT"),
        ((time.sleep, 600), WorkerLostError, "killed by SIGKILL"),
        ((bytearray, 1 << 40), MemoryError, "1024 MiB that it may use"),
        ((int, "x"), CallError, "ValueError: invalid literal"),
        ((os.memfd_create,), CallError, "TypeError"),
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
    """A task has a process of its own; its answer is JSON, and an ending says how it ended without one."""

    def come(function: Callable[..., Any], *arguments: object, silence_s: float = 60.0, **more: Any) -> object:
        budget = Budget(silence_s=silence_s)
        return run(run_task(server, function, *arguments, budget=budget, refusals=(LookupError,), **more))

    told: list[Any] = []
    steps = 13  # take longer than it may be silent
    assert come(count, steps, silence_s=12 * TELL_S, on_step=told.append) == Reply("done")
    assert set(map(tuple, told)) <= {(done, steps) for done in range(1, steps + 1)}
    assert told
    assert come(refuse) == Refusal("'of this name'")
    assert come(time.sleep, 60, silence_s=0.5) is Ending.OUT_OF_TIME
    assert come(time.sleep, 60, stopped=lambda: True) is Ending.KILLED
    assert come(os.abort) is Ending.CRASHED
    fault = come(object)
    assert "may hold what JSON can say" in fault.name


def test_who_has_a_loop_may_wait_for_tasks(server: ForkServer) -> None:
    """In a notebook a loop runs in the very thread that waits; tasks run side by side, and closing ends them."""

    async def wait() -> object:
        with BackgroundLoop("tasks") as loop:
            endless = loop.submit(run_task(server, time.sleep, 600, budget=UNLIMITED))
            answer = loop.submit(run_task(server, len, "four", budget=UNLIMITED)).result(60)
        with pytest.raises(CancelledError):
            endless.result(0)
        return answer

    assert run(wait()) == Reply(4)


def test_a_program_without_a_loop_has_futures() -> None:
    """Calls run side by side; news arrive, faults are raised, and closing ends whatever goes on."""
    pool = BlockingPool(ForkServer("pftrack.process"), processes=2, budget=replace(UNLIMITED, niceness=1))
    told: list[object] = []
    pool.submit(tell, "one", {"two": 2}, on_step=told.append).result(60)
    assert told == ["one", {"two": 2}]
    assert len({each.result(60) for each in [pool.submit(os.getpid) for _ in range(6)]}) <= 2
    assert pool.submit(os.nice, 0).result(60) == min(os.nice(0) + 1, 19)
    with pytest.raises(CallError, match="ValueError"):
        pool.submit(math.factorial, -1).result(60)
    endless = pool.submit(time.sleep, 600)
    pool.submit(os.getpid).result(60)
    pool.close()
    pool.close()
    with pytest.raises(CancelledError):
        endless.result()
    report("to nobody")
