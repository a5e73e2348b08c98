"""The stream of a session: one order of all messages and drawings, to each page at its own pace."""

import asyncio
import json
from collections.abc import AsyncIterator, Iterator
from contextlib import ExitStack, contextmanager
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pftrack.core.model.drawing import Drawing, Picture
from pftrack_server.sessions.stream import LONGEST_QUEUE, WINDOW, Changes, Page, SessionStream
from pftrack_server.sessions.worker.codec import DrawingEncoder
from tests.apart import run
from tests.server.drawings import Reader


class Worker:
    """Counts what it is asked for, and draws when told to."""

    def __init__(self) -> None:
        self.asked = self.greeted = 0
        self.stream = SessionStream(self._greeting, self._credit)
        self._encoder = DrawingEncoder()
        self.frame = -1
        self.drawn = 0

    def _greeting(self) -> Any:
        self.greeted += 1
        return Changes(session={"hello": True, "position": self.frame})

    def _credit(self) -> None:
        self.asked += 1

    def moves(self, *, draws: bool = False) -> None:
        """Go on by a frame and tell it; frames come in pairs that show the same picture."""
        self.frame += 1
        self.tells(position=self.frame)
        drawing = None
        if draws:
            self.drawn += 1
            image = np.full((12, 16, 3), 40 * (self.frame // 2 % 6), np.uint8)
            drawing = self._encoder.encode(Drawing(16, 12, {"picture": Picture(image)}), self.frame)
        self.stream.draw(drawing, is_ahead=not draws)

    def draws(self) -> None:
        self.moves(draws=True)

    def tells(self, **fields: Any) -> None:
        """Tell what changes nothing that is seen."""
        self.stream.emit(Changes(session=fields))

    @contextmanager
    def looker(self, *, paints: bool = True) -> Iterator["Looker"]:
        with self.stream.join(paints=paints) as page:
            yield Looker(page)


async def told(messages: AsyncIterator[str | bytes]) -> str | bytes | None:
    """Return the next message, None if there is none."""
    ahead = asyncio.ensure_future(anext(messages))
    for _ in range(5):
        await asyncio.sleep(0)
    if ahead.done():
        return ahead.result()
    ahead.cancel()
    await asyncio.gather(ahead, return_exceptions=True)
    return None


class Looker(Reader):
    """Somebody at a page."""

    def __init__(self, page: Page) -> None:
        super().__init__()
        self.page = page
        self.sizes: list[int] = []
        self.came = 0
        """Drawings over the present connection."""

    async def reads(self) -> None:
        """Read all that is there; while there is a picture, each message leaves the page at the frame of it."""
        while (message := await told(aiter(self.page))) is not None:
            if self.take(message) is not None:
                self.came += 1
                self.sizes.append(len(message))
            assert not self.frames or self.position == self.frames[-1]

    def paints(self) -> None:
        self.page.note_painted(self.came)


async def test_only_a_page_that_paints_asks_for_drawings() -> None:
    """A count of painted drawings larger than that of the sent ones is refused with both bounds."""
    worker = Worker()
    with worker.stream.join():
        assert worker.asked == 0
    with worker.stream.join(paints=True) as page:
        assert worker.asked == 1
        with pytest.raises(ValueError, match="expected between 0 and 0 painted drawings, got 1"):
            page.note_painted(1)


async def test_what_is_not_drawn_waits_for_the_next_drawing() -> None:
    """Frames in between come with the next picture; what changes nothing that is seen comes at once."""
    worker = Worker()
    with worker.looker() as looker, worker.looker(paints=False) as reader:
        worker.draws()
        await looker.reads()
        worker.tells(name="new")
        await looker.reads()
        assert looker.heard[-1]["session"] == {"name": "new"}
        worker.moves()
        worker.tells(name="newer")
        await looker.reads()
        await reader.reads()
        assert (looker.position, reader.position) == (0, 1)
        worker.draws()
        await looker.reads()
        assert [each["session"] for each in looker.heard[-3:]] == [{"position": 1}, {"name": "newer"}, {"position": 2}]
        assert looker.frames == [0, 2]


async def test_a_slow_page_slows_nobody_and_sees_the_newest() -> None:
    """A page that does not paint has at most two drawings on their way; then it gets only the newest."""
    worker = Worker()
    with worker.looker() as quick, worker.looker() as slow:
        for _ in range(10):
            worker.draws()
            await quick.reads()
            await slow.reads()
            quick.paints()
        assert (quick.frames, slow.frames, worker.asked) == (list(range(10)), list(range(WINDOW)), 11)
        slow.paints()
        await slow.reads()
        assert slow.frames == [0, 1, 9]
        assert len(slow.heard) == 10


@pytest.mark.parametrize("paints", [False, True])
async def test_a_full_queue_is_a_new_greeting(*, paints: bool) -> None:
    """A page that falls behind is greeted again, once, when it can receive; other pages lose nothing."""
    worker = Worker()
    with worker.looker(paints=paints) as slow, worker.looker(paints=False) as quick:
        for _ in range(WINDOW):
            worker.draws()
            await slow.reads()
        for _ in range(3 * LONGEST_QUEUE):
            worker.moves(draws=paints)
            await quick.reads()
        assert worker.greeted == 1
        if paints:
            slow.paints()
        before = len(slow.heard)
        await slow.reads()
        assert "hello" in slow.heard[before]["session"]
        assert slow.position == quick.position == worker.frame
        assert len(quick.heard) == 3 * LONGEST_QUEUE + WINDOW
        assert worker.greeted == 2


async def test_a_picture_is_sent_to_each_page_once() -> None:
    """A drawing with the previous picture carries no file, except to a new page, or after a change of the worker.

    A new worker is asked anew, since the request to the old one is lost and its keys mean nothing.
    """
    worker = Worker()
    with worker.looker() as early:
        worker.draws()
        await early.reads()
        early.paints()
        worker.draws()
        with worker.looker() as late:
            await early.reads()
            await late.reads()
            assert (early.frames, late.frames) == ([0, 1], [1])
            assert late.sizes[0] - early.sizes[1] > early.sizes[0] / 3
        asked = worker.asked
        worker.stream.change_worker(is_ahead=True)
        worker.stream.want()
        assert worker.asked == asked + 1
        early.paints()
        again = DrawingEncoder().encode(Drawing(16, 12, {"picture": Picture(np.full((12, 16, 3), 9, np.uint8))}), 0)
        worker.stream.draw(again, is_ahead=False)
        assert await told(aiter(early.page)) == again.message()


async def test_without_a_drawing_to_come_nothing_waits() -> None:
    """Messages before the first picture come at once, and so do those after the worker ended."""
    worker = Worker()
    with worker.stream.join(paints=True) as page:
        worker.moves()
        assert "hello" in json.loads(await told(aiter(page)) or "")["session"]
        worker.draws()
        assert isinstance(await told(aiter(page)), bytes)
        worker.moves()
        assert await told(aiter(page)) is None
        worker.stream.change_worker(is_ahead=False)
        worker.tells(state="crashed")
        heard = [json.loads(await told(aiter(page)) or "")["session"] for _ in range(2)]
        assert heard == [{"position": 2}, {"state": "crashed"}]


@given(st.lists(st.sampled_from(["moves", "draws", "tells", "reads", "paints", "greets", "comes back"]), max_size=60))
def test_a_page_is_always_at_the_frame_of_its_picture(steps: list[str]) -> None:
    """In any order of events, each message leaves the page at the frame that it shows.

    The worker is asked for one drawing at a time.
    """

    async def scenario(worker: Worker) -> None:
        with ExitStack() as pages:
            looker = Looker(pages.enter_context(worker.stream.join(paints=True)))
            for step in steps:
                if step in {"moves", "draws"}:
                    worker.moves(draws=step == "draws" and worker.asked > worker.drawn)
                elif step == "tells":
                    worker.tells(name=str(worker.frame))
                elif step == "reads":
                    await looker.reads()
                elif step == "paints":
                    looker.paints()
                elif step == "greets":
                    worker.stream.greet()
                else:
                    pages.close()
                    again = worker.stream.join(paints=True, has_picture=bool(looker.frames))
                    looker.page, looker.came = pages.enter_context(again), 0
                assert 0 <= worker.asked - worker.drawn <= 1
            looker.paints()
            worker.draws()
            await looker.reads()
            assert looker.position == looker.frames[-1] == worker.frame

    run(scenario(Worker()))
