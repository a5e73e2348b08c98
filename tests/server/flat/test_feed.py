"""The feed of the flat view: the newest drawing for everybody, at everybody's own pace."""

import asyncio
from collections.abc import AsyncIterator

import numpy as np
import pytest

from pftrack.core.model.drawing import Drawing, Picture
from pftrack_server.flat.codec import DrawingEncoder, EncodedDrawing, decode
from pftrack_server.flat.feed import WINDOW, DrawingFeed, Watcher
from tests.apart import run


class Worker:
    """Counts what it is asked for, and draws when told to."""

    def __init__(self) -> None:
        self.asked = 0
        self.feed = DrawingFeed(self._credit)
        self._encoder = DrawingEncoder()
        self._frame = 0

    def _credit(self) -> None:
        self.asked += 1

    def draws(self) -> EncodedDrawing:
        """Draw the next frame; frames come in pairs that show the same picture."""
        image = np.full((12, 16, 3), 40 * (self._frame // 2), np.uint8)
        drawing = self._encoder.encode(Drawing(16, 12, {"picture": Picture(image)}), self._frame)
        self._frame += 1
        self.feed.offer(drawing)
        return drawing


async def told(messages: AsyncIterator[bytes]) -> bytes | None:
    """Return the next message, None if there is none."""
    ahead = asyncio.ensure_future(anext(messages))
    for _ in range(5):
        await asyncio.sleep(0)
    if ahead.done():
        return ahead.result()
    ahead.cancel()
    await asyncio.gather(ahead, return_exceptions=True)
    return None


class Page:
    """A page and what it was told; it paints when it is told to."""

    def __init__(self, watcher: Watcher) -> None:
        self.watcher = watcher
        self.frames: list[int] = []
        self.sizes: list[int] = []
        self._pictures: dict[int, bytes] = {}

    async def reads(self) -> None:
        """Read all that is there."""
        while (message := await told(aiter(self.watcher))) is not None:
            frame, _, self._pictures = decode(message, self._pictures)
            self.frames.append(frame)
            self.sizes.append(len(message))

    def paints(self) -> None:
        self.watcher.acknowledge(len(self.frames))


def test_nobody_draws_for_an_empty_room() -> None:
    """The worker is asked for a drawing when somebody looks on, and for one at a time."""

    async def scenario() -> None:
        worker = Worker()
        assert worker.asked == 0
        with worker.feed.join():
            assert worker.asked == 1
            with worker.feed.join():
                assert worker.asked == 1
        worker.draws()
        assert worker.asked == 1

    run(scenario())


def test_a_page_that_paints_sees_every_drawing() -> None:
    """One that keeps up gets all, and the worker is asked for the next as soon as one is taken."""

    async def scenario() -> None:
        worker = Worker()
        with worker.feed.join() as watcher:
            page = Page(watcher)
            for frame in range(6):
                assert worker.asked == frame + 1
                worker.draws()
                await page.reads()
                page.paints()
            assert page.frames == list(range(6))

    run(scenario())


def test_a_slow_page_slows_nobody_and_sees_the_newest() -> None:
    """One that does not paint has two drawings on their way at the most; then it gets the newest alone."""

    async def scenario() -> None:
        worker = Worker()
        with worker.feed.join() as first, worker.feed.join() as second:
            quick, slow = Page(first), Page(second)
            for _ in range(10):
                worker.draws()
                await quick.reads()
                await slow.reads()
                quick.paints()
            assert quick.frames == list(range(10))
            assert slow.frames == list(range(WINDOW))
            slow.paints()
            await slow.reads()
            assert slow.frames == [0, 1, 9]

    run(scenario())


def test_who_alone_is_slow_has_nothing_drawn() -> None:
    """When all have enough on their way the worker is not asked, until one has painted."""

    async def scenario() -> None:
        worker = Worker()
        with worker.feed.join() as watcher:
            page = Page(watcher)
            for _ in range(WINDOW):
                worker.draws()
                await page.reads()
            assert worker.asked == WINDOW
            page.paints()
            assert worker.asked == WINDOW + 1

    run(scenario())


def test_a_picture_is_sent_to_each_page_once() -> None:
    """A drawing with the picture of the one before carries no file, except to whoever comes only now."""

    async def scenario() -> None:
        worker = Worker()
        with worker.feed.join() as first:
            early = Page(first)
            worker.draws()
            await early.reads()
            early.paints()
            worker.draws()
            with worker.feed.join() as second:
                late = Page(second)
                await early.reads()
                await late.reads()
                assert (early.frames, late.frames) == ([0, 1], [1])
                assert late.sizes[0] == early.sizes[0] > early.sizes[1]

    run(scenario())


def test_another_worker_is_asked_anew_and_its_pictures_are_sent() -> None:
    """After a crash the request of before counts no more, and keys of before mean nothing."""

    async def scenario() -> None:
        worker = Worker()
        with worker.feed.join() as watcher:
            page = Page(watcher)
            worker.draws()
            await page.reads()
            worker.feed.on_worker_started()
            assert worker.asked == 3
            assert await told(aiter(watcher)) is None
            again = DrawingEncoder().encode(Drawing(16, 12, {"picture": Picture(np.full((12, 16, 3), 9, np.uint8))}), 0)
            worker.feed.offer(again)
            assert await told(aiter(watcher)) == again.message()

    run(scenario())


def test_the_end_of_the_session_ends_the_messages() -> None:
    """Who waits for a drawing is sent away."""

    async def scenario() -> None:
        worker = Worker()
        with worker.feed.join() as watcher:
            waiting = asyncio.ensure_future(anext(aiter(watcher), b"over"))
            await asyncio.sleep(0)
            worker.feed.close()
            assert await waiting == b"over"

    run(scenario())


def test_a_page_cannot_have_painted_what_it_was_not_sent() -> None:
    """A count that cannot be is refused with both bounds."""

    async def scenario() -> None:
        refused = pytest.raises(ValueError, match="expected between 0 and 0 painted drawings, got 1")
        with Worker().feed.join() as watcher, refused:
            watcher.acknowledge(1)

    run(scenario())
