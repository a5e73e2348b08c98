"""Listeners: the pages that watch a sweep, each over the axes that it has chosen and at its own pace.

Nothing is queued. A listener that is ready for news receives the state of that moment, and nothing of what
came and went before. So the slowest browser costs a sweep nothing.
"""

import asyncio
import time
from collections.abc import AsyncIterator
from typing import Protocol

from pftrack_server.schemas.stream import Pong, encode
from pftrack_server.schemas.sweep_messages import Cells, Hello, Progress
from pftrack_server.schemas.sweep_views import CellsPublic, MapPublic, SweepPublic
from pftrack_server.stream.listeners import Listener

EVERY_S = 0.2


class Watched(Protocol):
    """What a listener asks of a sweep."""

    def view(self) -> SweepPublic:
        """Return it as everybody outside sees it."""

    async def cells(self, x: str | None = None, y: str | None = None) -> CellsPublic:
        """Return its map over one or two axes."""


class SweepListener(Listener):
    """One page that watches a sweep."""

    def __init__(self, sweep: Watched, x: str | None, y: str | None) -> None:
        super().__init__()
        self.news.clear()  # the greeting is not waited for
        self._sweep = sweep
        self._axes = x, y
        self._pong: float | None = None

    def answer(self, sent: float) -> None:
        """Answer a ping with its own time."""
        self._pong = sent
        self.news.set()

    async def __aiter__(self) -> AsyncIterator[str]:
        """Yield messages, the greeting first, not more often than anybody can see."""
        known = await self._sweep.cells(*self._axes)
        progress = self._progress()
        yield encode(Hello(sweep=self._sweep.view(), cells=known))
        told = time.monotonic()
        while not self.closed:
            await self.news.wait()
            self.news.clear()
            if self._pong is not None:
                sent, self._pong = self._pong, None
                yield encode(Pong(sent=sent))
            # Changes within one interval are sent together; the end of a sweep is sent at once.
            await asyncio.sleep(max(0.0, told + EVERY_S - time.monotonic()))
            told = time.monotonic()
            now = await self._sweep.cells(*self._axes)
            changed = _changed_cells(known, now)
            known = now
            if changed is not None:
                yield encode(changed)
            if self._progress() != progress:
                progress = self._progress()
                yield encode(progress)

    def _progress(self) -> Progress:
        view = self._sweep.view()
        return Progress(**{name: getattr(view, name) for name in Progress.model_fields if hasattr(view, name)})


def _changed_cells(before: CellsPublic, now: CellsPublic) -> Cells | None:
    """Return the cells in which runs have been added, or None."""
    if before is now:
        return None
    cells = len(now.maps[0].runs) if now.maps else 0
    at = [index for index in range(cells) if _runs(before, index) != _runs(now, index)]
    return Cells(done=now.done, at=at, maps=[_only(one, at) for one in now.maps]) if at else None


def _runs(view: CellsPublic, index: int) -> list[tuple[int, int]]:
    return [(one.runs[index], one.problems[index]) for one in view.maps]


def _only(one: MapPublic, at: list[int]) -> MapPublic:
    columns = {name: [column[index] for index in at] for name, column in one if isinstance(column, list)}
    measures = {name: [column[index] for index in at] for name, column in one.measures.items()}
    return MapPublic(tracker=one.tracker, measures=measures, **columns)
