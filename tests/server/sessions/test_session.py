"""A session without a worker: what ends with it, and what it waits for."""

import asyncio
from typing import Any

from pftrack_server.core.settings import Settings
from pftrack_server.sessions.session import Session
from pftrack_server.sessions.spec import BranchSpec, Phase, SessionSpec
from pftrack_server.sessions.worker.protocol import Described, Ready
from tests.server.sessions.test_session_state import DESCRIPTION, START, row


class Curtain:
    """A viewer that needs a while to close."""

    def __init__(self) -> None:
        self.told: list[object] = []
        self.ended = asyncio.Event()

    def tell(self, in_force: object) -> None:
        self.told.append(in_force)

    def refuse(self, message: str) -> None:
        self.told.append(message)

    async def close(self) -> None:
        await asyncio.sleep(0.01)
        self.ended.set()


def session_with(curtain: Curtain) -> Session:
    async def config_of(spec: SessionSpec) -> Any:
        raise AssertionError(spec)

    made = Session(SessionSpec(id="s", branches={"b0": BranchSpec(title="Main", run=START)}), Settings(), config_of)
    made.enter(Phase.STARTING)
    made.begin(Ready(DESCRIPTION, START, [row(0)]))
    made.scene_feed._viewer = curtain  # type: ignore[assignment]
    return made


async def test_other_trackers_need_another_scene() -> None:
    """Its panel is made anew; until the old one has closed the session has not ended either."""
    curtain = Curtain()
    session = session_with(curtain)
    session._event(Described(DESCRIPTION))
    await asyncio.sleep(0)
    assert session.scene_feed._viewer is None
    await session.close("Ended.")
    assert curtain.ended.is_set()


async def test_a_scene_ends_with_its_session_or_its_worker() -> None:
    """What the panel still asks for is refused, and nothing is left to be done."""
    for end in (Session.suspend, Session.close):
        curtain = Curtain()
        session = session_with(curtain)
        await session._command_lock.acquire()
        session.scene_feed.ask({"kind": "change", "values": {"n": 3}})
        ending = asyncio.ensure_future(end(session, "Ended."))
        await asyncio.sleep(0)
        session._command_lock.release()
        await ending
        assert curtain.ended.is_set()
        assert any("resume it first" in str(told) for told in curtain.told)
        assert not session.scene_feed._commands
