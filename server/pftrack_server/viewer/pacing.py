"""How fast each browser is sent frames: as fast as it takes them up, whatever the others do.

A browser or a line that cannot keep up does not complain: the buffers of the connection fill with seconds of stale
pictures. So each browser is asked for an echo, up to ten times a second while frames go out. The question travels
behind the frames already sent, and is answered by the code that takes them up to be drawn. While its answer is overdue
that browser is sent nothing more, and what follows is the newest. So what waits on the way never grows beyond a
fraction of a second, a line that is merely long is not mistaken for a slow one, and one that never answers, such as a
frozen tab, is sent a few frames each time that the question is given up. While all browsers are held nothing is drawn.

A still scene is not asked: each question makes the browser draw for a while.
"""

import asyncio
import math
import time
from collections.abc import Callable
from typing import Protocol

import viser

from pftrack_server.viewer import viser_adapter

FASTEST_S = 1.0 / 30.0
LATE_S = 0.2
"""Time beyond a browser's best at which its answer is overdue."""
ANSWER_S = 4.0
"""Time after which an answer is given up, and another question is asked."""
ECHO_EVERY_S = 0.1


class Line(Protocol):
    """What can be held: a connection to a browser."""

    @property
    def held(self) -> bool:
        """Whether nothing is sent, because an answer is overdue."""

    def expect(self, patience_s: float) -> None:
        """Take note that a question follows: so long after it has left nothing more is sent until `release`."""

    def release(self) -> float:
        """Send again, as the answer has come; return the time since the question had left, s."""


class Pace:
    """The pace of one browser, from its answers.

    Args:
        line: What leads to it.
    """

    def __init__(self, line: Line) -> None:
        self._line = line
        self._best_s = math.inf

    @property
    def held(self) -> bool:
        """Whether the browser is sent nothing, because its answer is overdue."""
        return self._line.held

    def note_question(self) -> None:
        """Take note that a question goes out; the line is held when the answer is overdue."""
        # One that has never answered is still loading, which may take seconds: the best is infinite.
        self._line.expect(self._best_s + LATE_S)

    def note_answer(self) -> None:
        """Take note of an answer."""
        self._best_s = min(self._line.release(), self._best_s)

    def silent(self) -> None:
        """Take note that a question was given up: the line is free until the next answer is overdue."""
        self._line.release()


class Pacer:
    """Asks the browsers for echoes, and holds the connections of those that are late.

    All methods belong to viser's loop.

    Args:
        on_release: Called when a browser has answered, so that it is held no longer, or has left.
    """

    def __init__(self, on_release: Callable[[], None]) -> None:
        self._on_release = on_release
        self._paces: dict[int, Pace] = {}
        self._frames: dict[int, asyncio.Event] = {}
        self._askers: dict[int, asyncio.Task[None]] = {}

    @property
    def all_held(self) -> bool:
        """Whether there are browsers, and all of them are held: a frame would be sent to nobody."""
        return bool(self._paces) and all(pace.held for pace in self._paces.values())

    def note_frame(self) -> None:
        """Take note that a frame is on its way."""
        for frame in self._frames.values():
            frame.set()

    def watch(self, client: viser.ClientHandle) -> None:
        """Ask a browser for echoes until it leaves."""
        line = viser_adapter.connection_of(client)
        if line is None:
            return
        name = client.client_id
        self._paces[name], self._frames[name] = Pace(line), asyncio.Event()
        asking = self._ask(client, self._paces[name], self._frames[name])
        self._askers[name] = asyncio.create_task(asking)

    def forget(self, client: int) -> None:
        """Leave out a browser that has gone."""
        if self._paces.pop(client, None) is not None:
            del self._frames[client]
            self._askers.pop(client).cancel()
        self._on_release()

    def close(self) -> None:
        """Ask no more."""
        for asker in self._askers.values():
            asker.cancel()

    async def _ask(self, client: viser.ClientHandle, pace: Pace, frame: asyncio.Event) -> None:
        while True:
            await frame.wait()
            frame.clear()
            begun = time.monotonic()
            pace.note_question()
            if await viser_adapter.echo(client, ANSWER_S):
                pace.note_answer()
            else:
                pace.silent()
            self._on_release()
            await asyncio.sleep(max(begun + ECHO_EVERY_S - time.monotonic(), 0.0))
