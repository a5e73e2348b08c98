"""The workers of lessons: nobody waits for another's figure, and one that goes wild harms nobody else."""

import asyncio
import os
import time

import psutil
import pytest

from pftrack.model.parameters import ParameterError
from pftrack_server.errors import RefusedError, UnavailableError
from pftrack_server.lessons import pool as pools
from pftrack_server.lessons.pool import Pool
from tests.server.apart import run

pytestmark = pytest.mark.usefixtures("nothing_is_left")


def test_a_worker_lives_on() -> None:
    """Two calls one after the other have the same process, which is another than this one."""

    async def work() -> tuple[int, int]:
        pool = Pool()
        pids = await pool.call(os.getpid), await pool.call(os.getpid)
        await pool.close()
        return pids

    first, second = run(work())
    assert first == second != os.getpid()


def test_nobody_waits_for_a_slow_one() -> None:
    """While one call sleeps for minutes, another is answered; the first ends with who waits for it."""

    async def work() -> None:
        pool = Pool()
        slow = asyncio.create_task(pool.call(time.sleep, 600))
        sleeper = await pool.call(os.getpid)
        assert not slow.done()
        slow.cancel()
        await asyncio.gather(slow, return_exceptions=True)
        assert await pool.call(os.getpid) == sleeper
        await pool.close()

    run(work())


def test_one_that_takes_too_long_is_given_up(monkeypatch: pytest.MonkeyPatch) -> None:
    """Who waits is told, and what comes after it is answered by another process."""
    monkeypatch.setattr(pools, "LONGEST_S", 0.2)

    async def work() -> None:
        pool = Pool()
        with pytest.raises(UnavailableError, match=r"longer than the 0\.2 s"):
            await pool.call(time.sleep, 600)
        monkeypatch.setattr(pools, "LONGEST_S", 60.0)
        assert await pool.call(len, "four") == 4
        await pool.close()

    run(work())


@pytest.mark.parametrize(
    ("function", "argument", "error", "message"),
    [
        (os._exit, 1, UnavailableError, "ended by the system"),
        (bytearray, 1 << 40, RefusedError, "1024 MiB of memory"),
        (int, "x", UnavailableError, "the lesson has a mistake"),
    ],
)
def test_what_goes_wrong_is_told(function: object, argument: object, error: type[Exception], message: str) -> None:
    """A process that dies, asks for too much or makes a mistake is one answer with a sentence; the next is fine."""

    async def work() -> None:
        pool = Pool()
        with pytest.raises(error, match=message):
            await pool.call(function, argument)  # type: ignore[arg-type]
        assert await pool.call(len, "four") == 4
        await pool.close()

    run(work())


def test_a_refusal_comes_whole() -> None:
    """A parameter that is refused names field, bound and value, as if it had been refused here."""

    async def work() -> None:
        pool = Pool()
        with pytest.raises(ParameterError, match="N must be small, got 9") as caught:
            await pool.call(refuse)
        assert (caught.value.field, caught.value.bound, caught.value.value) == ("N", "small", 9)
        await pool.close()

    run(work())


def refuse() -> None:
    raise ParameterError("N", 9, "small")


def test_one_that_was_killed_in_its_sleep_is_replaced() -> None:
    """The system may take a worker that waits, to have its memory."""

    async def work() -> None:
        pool = Pool()
        psutil.Process(await pool.call(os.getpid)).kill()
        await pool._free[0]._gone.wait()
        assert await pool.call(len, "four") == 4
        await pool.close()

    run(work())
