"""Listeners: lecturer and followers hear what is in force, each at its own pace.

Nothing is queued: whoever is ready for news is told the newest of each kind, and nothing of what came and went before.
Each text is encoded once for all.
"""

from collections.abc import AsyncIterator, Callable

from pftrack_server.sessions.duplex import Listener


class NewestListener(Listener):
    """One page.

    Args:
        greeting: Encodes the first message.
        news: Returns the newest text of each kind, by kind; the same object until there is another.
    """

    def __init__(self, greeting: Callable[[], str], news: Callable[[], dict[str, str]]) -> None:
        super().__init__()
        self._greeting = greeting
        self._news = news

    async def __aiter__(self) -> AsyncIterator[str]:
        """Yield messages as they come, the greeting first."""
        told = {"follow": self._news().get("follow", "")}
        yield self._greeting()
        while True:
            await self.news.wait()
            self.news.clear()
            for kind, text in self._news().items():
                if told.get(kind) != text:
                    told[kind] = text
                    yield text
            if self.closed:
                return
