"""The manager: places taken at the same moment, and sessions that end while they begin."""

import asyncio
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from typing import Any
from unittest.mock import AsyncMock

import httpx
import pytest
from websockets.sync.client import connect

from pftrack_server.core.errors import unavailable
from pftrack_server.sessions.session import Session
from pftrack_server.sessions.spec import Phase
from pftrack_server.store.database import SessionRow
from tests.server.asking import get, kill, resume
from tests.server.host import Server, begin, error_of, steer
from tests.server.teaching.class_room import follower, lead
from tests.session_requests import session_request
from tests.waiting import wait_for

BODY = session_request({"experiment": "ball"})


def refused(client: httpx.Client) -> str:
    """Ask for a session for which there is no place, and return why."""
    return error_of(client.post("/api/v1/sessions", json=BODY), 503)["message"]


class Gate:
    """Where sessions wait to be compiled until it is opened."""

    def __init__(self, server: Server) -> None:
        self._server = server
        self._event = asyncio.Event()
        self.waiting = 0
        server.manager._wait_for = self._wait

    async def _wait(self, name: str) -> None:
        del name
        self.waiting += 1
        await self._event.wait()

    def open(self) -> None:
        self._server.uvicorn.loop.call_soon_threadsafe(self._event.set)


def test_places_are_taken_once(start_server: Any) -> None:
    """If several clients ask at the same moment, only as many get a session as there are places.

    A session that ends while it is about to resume gets no worker, which nobody would ever end.
    """
    with start_server(max_sessions=1) as (server, client), ThreadPoolExecutor(3) as pool:
        gate = Gate(server)
        asked = [pool.submit(client.post, "/api/v1/sessions", json=BODY) for _ in range(3)]
        wait_for(lambda: gate.waiting == 3)
        gate.open()
        assert sorted(each.result().status_code for each in asked) == [201, 503, 503]
        (session,) = (each["id"] for each in client.get("/api/v1/sessions").json())
        found = server.manager.get(session)
        suspend(server, session)
        gate = Gate(server)
        resumed = pool.submit(client.post, f"/api/v1/sessions/{session}/resume")
        wait_for(lambda: gate.waiting == 1)
        assert client.delete(f"/api/v1/sessions/{session}").status_code == 204
        gate.open()
        error_of(resumed.result(), 409)
        assert (found.worker, found.phase) == (None, Phase.CLOSED)


def test_what_nobody_watches_gives_way(start_server: Any) -> None:
    """If all places are taken, the session left longest ago is suspended at once, and resumes at its frame."""
    with start_server(max_sessions=2) as (server, client), ExitStack() as pages:

        def states() -> list[str]:
            return [get(client, each)["state"] for each in (left, watched, new)]

        def watch(session: str) -> None:
            pages.enter_context(connect(f"{server.ws}/api/v1/sessions/{session}/stream")).recv()
            wait_for(lambda: get(client, session)["state"] == "ready")

        watched, left = begin(client)["id"], begin(client)["id"]
        watch(watched)
        steer(client, left, "seek", frame=12)
        new = begin(client)["id"]
        assert states() == ["suspended", "ready", "ready"]
        assert get(client, left)["message"].startswith("Paused to free a slot for another session; it resumes")
        watch(left)
        assert states() == ["ready", "ready", "suspended"]
        wait_for(lambda: get(client, left)["position"] == 12)
        full = error_of(client.post(f"/api/v1/sessions/{new}/resume"), 503)["message"]
        assert "All 2 session slots are in use" in full
        assert states() == ["ready", "ready", "suspended"]
        client.delete(f"/api/v1/sessions/{watched}")
        assert client.post(f"/api/v1/sessions/{new}/resume").json()["state"] == "ready"


def test_a_long_seek_can_be_watched_and_cut_short(start_server: Any) -> None:
    """A session that is computing keeps its place without viewers, until a pause cuts the seek short.

    A request for the picture neither ends the seek nor waits for it.
    """
    with start_server(max_sessions=1) as (_, client), ThreadPoolExecutor(1) as pool:
        session = begin(client, frames=20_000, parameters={"sample_count": 5000})["id"]
        seeking = pool.submit(steer, client, session, "seek", frame=19_999)
        wait_for(lambda: get(client, session)["computed"] > 5)
        refused(client)
        picture = client.get(f"/api/v1/sessions/{session}/frame.png").raise_for_status()
        assert (picture.headers["content-type"], picture.content[:4]) == ("image/png", b"\x89PNG")
        assert get(client, session)["goal"] == 19_999
        paused = steer(client, session, "pause")
        assert 5 < seeking.result(60)["position"] <= paused["position"] < 19_999
        assert paused["state"] == "ready"
        begin(client)
        assert get(client, session)["state"] == "suspended"


def test_what_could_not_be_started_is_not_kept(
    server: Server, client: httpx.Client, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A session whose worker ends during its start is not stored."""
    store = server.app.state.services.store
    monkeypatch.setattr(Session, "wait_until_open", AsyncMock(side_effect=unavailable("The worker ended.")))
    before = client.get("/api/v1/sessions").json(), store.all(SessionRow)
    refused(client)
    assert (client.get("/api/v1/sessions").json(), store.all(SessionRow)) == before


def test_a_command_that_hangs_does_not_stop_the_rounds(
    server: Server, client: httpx.Client, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A command may wait for a hung worker of a session without viewers: only the rounds end that."""
    looked = []
    check = Session.check

    def counted(self: Session, *, after_gap: bool) -> None:
        looked.append(self)
        check(self, after_gap=after_gap)

    found = server.manager.get(begin(client)["id"])
    server.run(found._command_lock.acquire())
    monkeypatch.setattr(Session, "check", counted)
    found.left -= 2 * server.manager._settings.idle_seconds
    wait_for(lambda: looked.count(found) >= 3)
    assert found.worker is not None
    server.uvicorn.loop.call_soon_threadsafe(found._command_lock.release)
    wait_for(lambda: found.phase is Phase.SUSPENDED)


def suspend(server: Server, *sessions: str) -> None:
    for name in sessions:
        server.run(server.manager.get(name).suspend("Nobody needs it."))


def test_what_nobody_needs_gives_way(start_server: Any) -> None:
    """At the limit the oldest plain suspended session ends for a new one, but not for a copy nor for a name in use.

    No session ends while a page is open on it, suspended or crashed, while a class follows it, or before it began.
    """
    with start_server(max_stored_sessions=2) as (server, client), ThreadPoolExecutor(1) as pool:

        def stored() -> set[str]:
            return {each["id"] for each in client.get("/api/v1/sessions").json()}

        watched, plain = (begin(client)["id"] for _ in range(2))
        client.patch(f"/api/v1/sessions/{watched}", json={"name": "Keep"})
        assert "My work" in refused(client)
        suspend(server, watched, plain)
        error_of(client.post("/api/v1/sessions", json={**BODY, "id": watched}), 409)
        follow = lead(client, watched)
        with follower(server, follow) as one, one.socket():
            message = error_of(one.ask("POST", "follow/fork", session=watched), 503)["message"]
        assert "Ask the lecturer" in message
        assert stored() == {watched, plain}
        followed = begin(client)["id"]
        assert stored() == {watched, followed}
        client.delete(f"/api/v1/follows/{follow['id']}").raise_for_status()
        follow = lead(client, followed)
        with connect(f"{server.ws}/api/v1/sessions/{watched}/stream") as page:
            page.recv(timeout=60)
            suspend(server, watched, followed)
            assert "followed by a class" in refused(client)
            client.delete(f"/api/v1/follows/{follow['id']}").raise_for_status()
            newest = begin(client)["id"]
            assert stored() == {newest, watched}
            resume(client, watched)
            kill(server, client, watched)
            client.delete(f"/api/v1/sessions/{newest}")
            gate = Gate(server)
            made = pool.submit(client.post, "/api/v1/sessions", json=BODY)
            wait_for(lambda: gate.waiting == 1)
            assert "My work" in refused(client)
            gate.open()
            assert made.result().status_code == 201
