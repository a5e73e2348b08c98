"""The stream of a session: its messages and drawings for all pages, each at its own pace.

One socket carries all messages in one order. A page that paints gets the newest drawing, whose head holds all messages
up to its frame, so all numbers next to a picture belong to it. A message that changes nothing visible is sent at once;
the others wait for their drawing.

A page reports how many drawings it has painted. At most `WINDOW` are on their way to it; meanwhile newer drawings
replace each other here. So a slow page sees fewer drawings, never old ones, and slows no other page. The stream asks
the worker for a drawing as soon as one page can take it; the worker encodes it once for all.
"""

from collections.abc import AsyncIterator, Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Annotated, Any, Literal

from pydantic import Field, WithJsonSchema

from pftrack_server.core.errors import ErrorDetail
from pftrack_server.core.panel import SPEEDS
from pftrack_server.sessions.duplex import Listener, Listeners, Message, encode
from pftrack_server.sessions.spec import SessionDescription, SessionSnapshot
from pftrack_server.sessions.worker.codec import EncodedDrawing


class SessionPublic(SessionDescription, SessionSnapshot):
    """The public view of a session: its description, its snapshot and its addresses."""

    id: str
    speeds: tuple[float, ...] = SPEEDS
    sweep: str | None
    upload: str | None
    created: str
    page: str
    thumbnail: str
    viewer: str


class Hello(Message):
    """The complete state; the first message of every connection."""

    type: Literal["hello"] = "hello"
    session: SessionPublic
    diagnostics: dict[str, list[Any]]


class Changes(Message):
    """The changed fields of a session's snapshot, and new rows of diagnostics; all other fields stay as they are."""

    type: Literal["changes"] = "changes"
    session: Annotated[dict[str, Any], WithJsonSchema({"type": "object", "partial": SessionSnapshot.__name__})]
    rows: list[dict[str, Any]] = Field([], description="Diagnostics of new frames of the branch active then")


class Refused(Message, ErrorDetail):
    """A change that came through the scene's panel was refused."""

    type: Literal["refused"] = "refused"


WINDOW = 2
"""Most drawings on their way to one page: one is painted while the next one travels."""
LONGEST_QUEUE = 256
LONGEST_TALE = 64
"""Messages after a greeting up to which it is reused; reading them is faster than making a new greeting."""


class Page(Listener):
    """One page's end of a session's stream.

    Nobody waits for a page that falls behind, and it gets no old messages: its queue is dropped and it is sent the
    complete state again.

    Args:
        stream: The session's stream.
        paints: Whether it receives drawings.
        has_picture: Whether it still shows a drawing of an earlier connection; its greeting then waits for the next
            drawing.
    """

    def __init__(self, stream: "SessionStream", *, paints: bool, has_picture: bool) -> None:
        super().__init__()
        self._stream = stream
        self._paints = paints
        self._has_picture = has_picture
        self._behind = True
        self._texts: list[str] = []
        self._drawing = None if stream.is_ahead or not paints else stream.newest
        """The newest drawing, until it is sent."""
        self._drawn = 0
        """How many of the queued texts belong to the drawing."""
        self._keys: frozenset[int] = frozenset()
        self._sent = self._painted = 0

    @property
    def ready(self) -> bool:
        """Whether the page can take one more drawing."""
        return self._paints and self._sent - self._painted < WINDOW

    def note_painted(self, count: int) -> None:
        """Note the number of drawings that the page has painted or skipped since it connected.

        Raises:
            ValueError: The number is larger than that of the sent drawings, or went down.
        """
        if not self._painted <= count <= self._sent:
            raise ValueError(f"expected between {self._painted} and {self._sent} painted drawings, got {count}")
        self._painted = count
        self.news.set()
        self._stream.want()

    def put(self, text: str) -> None:
        """Queue a message; if the queue is full, drop it and greet again."""
        if len(self._texts) >= LONGEST_QUEUE:
            self.greet()
        elif not self._behind:
            self._texts.append(text)
            self.news.set()

    def greet(self) -> None:
        """Drop the queue and send the complete state again."""
        self._texts.clear()
        self._drawn, self._behind = 0, True
        self.news.set()

    def offer(self, drawing: EncodedDrawing) -> None:
        """Take the newest drawing, which covers all messages so far."""
        if self._paints:
            self._drawing, self._drawn = drawing, len(self._texts)
            self.news.set()

    def forget_drawings(self) -> None:
        """Drop drawings of a worker that has ended; the next worker reuses the keys for other pictures."""
        self._drawing, self._drawn, self._keys = None, 0, frozenset()
        self.news.set()

    async def __aiter__(self) -> AsyncIterator[str | bytes]:
        """Yield messages as they arrive, the greeting first."""
        while True:
            await self.news.wait()
            message = self._next()
            if message is not None:
                yield message
            elif self.closed:
                return
            else:
                self.news.clear()

    @property
    def _waits(self) -> bool:
        """Whether the next message belongs to a drawing that is still to come."""
        if not self._has_picture or not self._paints or self.closed:
            return False
        return self._stream.is_ahead or (self._drawing is not None and not self.ready)

    def _next(self) -> str | bytes | None:
        """Return the next message; None if there is none, or if its drawing is still to come."""
        if self._behind and not self._waits:
            self._behind = False
            self._texts = list(self._stream.greeting())
            self._drawn = len(self._texts)
            if self._stream.is_ahead:
                # An unsent drawing shows less than the greeting says.
                self._drawing = None
                self._stream.want()
        if self._behind:
            return None
        if self._drawing is not None and self.ready:
            return self._draw(self._drawing)
        return self._texts.pop(0) if self._texts and not self._waits else None

    def _draw(self, drawing: EncodedDrawing) -> bytes:
        """Return the message of a drawing, with the queued messages up to its frame."""
        message = drawing.message(self._keys, self._texts[: self._drawn])
        self._keys = frozenset(picture.key for picture in drawing.pictures)
        self._texts = self._texts[self._drawn :]
        self._drawing, self._drawn, self._has_picture = None, 0, True
        self._sent += 1
        self._stream.want()
        return message


class SessionStream(Listeners[Page]):
    """All pages of one session; call all methods in the event loop's thread.

    A greeting holds the whole past of a run, so it is kept for the next pages, with the messages since: a class that
    connects all at once shares one greeting.

    Args:
        greeting: Returns the complete state.
        credit: Lets the worker send one drawing.

    Attributes:
        newest: The newest drawing of the present worker, None before the first.
        is_ahead: Whether the run looks different from the newest drawing, so that another one will come.
    """

    def __init__(self, greeting: Callable[[], Hello], credit: Callable[[], None]) -> None:
        super().__init__()
        self._greeting = greeting
        self._credit = credit
        self._tale: list[str] = []
        self._asked = False
        self.newest: EncodedDrawing | None = None
        self.is_ahead = False

    @contextmanager
    def join(self, *, paints: bool = False, has_picture: bool = False) -> Iterator[Page]:
        """Add a page while the context lasts; the arguments are those of `Page`."""
        with self.add(Page(self, paints=paints, has_picture=has_picture)) as page:
            self.want()
            yield page

    def emit(self, message: Message) -> None:
        """Send a message to all pages, encoded once."""
        if not self._all:
            self._tale = []
            return
        text = encode(message)
        if self._tale:
            self._tale.append(text)
        if len(self._tale) > LONGEST_TALE:
            self._tale = []
        for page in self._all:
            page.put(text)

    def greet(self) -> None:
        """Send the complete state to all pages again."""
        self._tale = []
        for page in self._all:
            page.greet()

    def greeting(self) -> Sequence[str]:
        """Return a greeting and the messages since."""
        if not self._tale:
            self._tale = [encode(self._greeting())]
        return self._tale

    def want(self) -> None:
        """Ask the worker for a drawing if a page can take one and none is on its way."""
        if not self._asked and any(page.ready for page in self._all):
            self._asked = True
            self._credit()

    def draw(self, drawing: EncodedDrawing | None, *, is_ahead: bool) -> None:
        """Take the drawing that covers all messages so far, if there is one.

        Args:
            drawing: The requested drawing; None if the worker sent none.
            is_ahead: Whether the run looks different from the newest drawing.
        """
        self.is_ahead = is_ahead
        if drawing is not None:
            self.newest, self._asked = drawing, False
            for page in self._all:
                page.offer(drawing)

    def change_worker(self, *, is_ahead: bool) -> None:
        """Forget the drawings of a worker that has ended; `is_ahead` if another worker will draw again."""
        self.newest, self._asked, self.is_ahead = None, False, is_ahead
        for page in self._all:
            page.forget_drawings()
