"""Queues: fair, with known places, left when the client leaves, and short for what takes a moment."""

import asyncio
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import AsyncExitStack, contextmanager
from typing import Any

import httpx
import pytest

from pftrack_server.core.errors import ApiError
from pftrack_server.jobs.child_tasks import Queue, Queues, unless_gone
from pftrack_server.jobs.jobs import Jobs
from pftrack_server.work.runs import FitJob, ImportJob
from tests.server.host import Server
from tests.server.uploads.test_uploads import png, send
from tests.waiting import wait_for

FILM = b"no film at all" * 1_400_000


@contextmanager
def occupied(server: Server, *names: str) -> Iterator[None]:
    """Have all places of some queues taken for as long as the context lasts."""
    held = AsyncExitStack()
    for name in names:
        queue = getattr(server.app.state.services.queues, name)
        for _ in range(queue._free):
            server.run(held.enter_async_context(queue.place()))
    try:
        yield
    finally:
        server.run(held.aclose())


def before(client: httpx.Client, ticket: str) -> int:
    return client.get(f"/api/v1/queue/{ticket}").json()["before"]


def send_film(server: Server, ticket: str) -> httpx.Response:
    with httpx.Client(base_url=server.url, timeout=60) as client:
        return client.post("/api/v1/uploads", params={"ticket": ticket}, files={"file": ("film.mp4", FILM)})


async def stand_in_line(queue: Queue, *weights_s: float) -> tuple[list[asyncio.Task[None]], list[str]]:
    """Queue work called a, b, ... of these weights; return it, and the list that gets the order of its turns."""
    order: list[str] = []

    async def work(name: str, weight_s: float) -> None:
        async with queue.place(name, weight_s=weight_s):
            order.append(name)
            await asyncio.sleep(0)

    waiting = []
    for name, weight_s in zip("abcd", weights_s, strict=True):
        waiting.append(asyncio.create_task(work(name, weight_s)))
        await asyncio.sleep(0)
    return waiting, order


async def test_the_first_to_come_is_the_first_to_be_served() -> None:
    """Each knows how many are before it, and one that gives up is passed over.

    One that gives up at the very moment of its turn hands the turn on.
    """
    queue = Queue(1)
    async with queue.place():
        waiting, order = await stand_in_line(queue, 0.0, 0.0, 0.0, 0.0)
        assert [queue.before(name) for name in "abcd"] == [1, 2, 3, 4]
        waiting[1].cancel()
        await asyncio.gather(waiting[1], return_exceptions=True)
        assert [queue.before(name) for name in "abcd"] == [1, None, 2, 3]
    await asyncio.gather(*waiting, return_exceptions=True)
    assert order == ["a", "c", "d"]
    async with queue.place("e"):
        assert queue.before("e") is None
        late = asyncio.create_task(queue.place().__aenter__())
        await asyncio.sleep(0)
    late.cancel()
    await asyncio.gather(late, return_exceptions=True)
    async with asyncio.timeout(60), queue.place():
        pass


async def test_small_ones_pass_large_ones() -> None:
    """What takes less time comes before what has come earlier by less than that."""
    queue = Queue(1)
    async with queue.place():
        waiting, order = await stand_in_line(queue, 500.0, 20.0, 500.0, 0.0)
        assert [queue.before(name) for name in ("d", "a")] == [1, 3]
    await asyncio.gather(*waiting)
    assert order == ["d", "b", "a", "c"]


class Works:
    """Work of three kinds: one that takes a moment, and two that end when they are let."""

    def __init__(self) -> None:
        self.begun: list[str] = []
        self.given_up: list[str] = []
        self.is_begun = asyncio.Event()
        self.ends = {name: asyncio.Event() for name in ("one", "two")}

    async def do(self, name: str) -> str:
        self.begun.append(name)
        self.is_begun.set()
        if name in self.ends:
            try:
                await self.ends[name].wait()
            except asyncio.CancelledError:
                self.given_up.append(name)
                raise
        return name


async def test_what_takes_a_moment_does_not_wait_for_what_turns_out_heavy() -> None:
    """One goes on among heavy work, the next has to begin again when its turn comes, and both make room."""
    queues, works = Queues(light=1, heavy=1, moment_s=0.05), Works()
    one, two = (
        asyncio.create_task(queues.take_turn(lambda name=name: works.do(name), name)) for name in ("one", "two")
    )
    assert await asyncio.wait_for(queues.take_turn(lambda: works.do("light")), 60) == "light"
    assert (queues.before("one"), queues.before("two")) == (0, 1)
    assert works.given_up == ["two"]
    works.ends["one"].set()
    works.ends["two"].set()
    assert await asyncio.gather(one, two) == ["one", "two"]
    assert (queues.light.is_free, queues.heavy.is_free) == (True, True)
    assert works.begun == ["one", "two", "light", "two"]


async def test_a_client_that_leaves_takes_the_work_along() -> None:
    """Work whose client is gone is cancelled, and has ended before the error is raised."""
    queues, works = Queues(light=1, heavy=1, moment_s=60.0), Works()
    one = asyncio.create_task(queues.take_turn(lambda: works.do("one")))
    await works.is_begun.wait()
    one.cancel()
    await asyncio.gather(one, return_exceptions=True)
    assert (queues.light.is_free, works.given_up) == (True, ["one"])
    with pytest.raises(ApiError, match="hung up"):
        await unless_gone(works.do("two"), lambda: asyncio.sleep(0))
    assert works.given_up == ["one", "two"]


async def test_jobs_are_bounded_and_end_when_nobody_asks(monkeypatch: pytest.MonkeyPatch) -> None:
    """One more of a kind than allowed is refused, one of another kind begins; listing all jobs keeps none alive."""
    monkeypatch.setattr("pftrack_server.jobs.jobs.LOOK_S", 0.05)
    monkeypatch.setattr("pftrack_server.jobs.jobs.MOST_AT_WORK", 1)
    jobs = Jobs()

    async def work(_: Any) -> None:
        await asyncio.Event().wait()

    first = jobs.begin(FitJob(id="one", name="gain"), work)
    with pytest.raises(ApiError, match="at most 1 fits at a time"):
        jobs.begin(FitJob(id="two", name="gain"), work)
    jobs.begin(ImportJob(id="three", name="run.pft"), work)
    assert [job.id for job in jobs.all()] == ["three", "one"]
    await asyncio.to_thread(wait_for, lambda: first in jobs.all() and first.state == "failed")
    assert "Nobody asked" in str(first.error)
    await jobs.close()


def test_small_work_waits_for_no_heavy_work(server: Server, client: httpx.Client) -> None:
    """While films are decoded, a picture is taken in; the server is ready whatever it works on."""
    with occupied(server, "heavy"):
        assert send(client, ("a.png", png(20)), ("b.png", png(30))).status_code == 201
        with occupied(server, "light"):
            assert client.get("/readyz").status_code == 200


def test_who_waits_is_told_how_many_are_before(server: Server, client: httpx.Client) -> None:
    """Two films behind others know their places; then each gets its answer."""
    with ThreadPoolExecutor(2) as pool:
        films = []
        with occupied(server, "heavy"):
            for place, ticket in enumerate(("ticket-one", "ticket-two"), 1):
                films.append(pool.submit(send_film, server, ticket))
                wait_for(lambda place=place, ticket=ticket: before(client, ticket) == place)
        assert [film.result(60).status_code for film in films] == [422, 422]
    assert before(client, "ticket-two") == 0
    assert client.get("/api/v1/queue/no%20ticket").status_code == 422


def test_uploads_at_the_same_time_do_not_exceed_the_limit(start_server: Any) -> None:
    """Only as many simultaneous uploads are kept as the limit allows."""
    with start_server(max_uploads=2) as (_, client), ThreadPoolExecutor(4) as pool:
        files = [[(f"{name}.png", png(20)), ("z.png", png(30))] for name in "abcd"]
        assert sorted(pool.map(lambda each: send(client, *each).status_code, files)) == [201] * 2 + [409] * 2
        assert len(client.get("/api/v1/uploads").json()) == 2
