"""Runs that take long to compute again: pages see their progress, and only a silent worker is given up."""

import dataclasses
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import httpx
import psutil
import pytest
from websockets.sync.client import connect

from pftrack_server.sessions.worker.run_tree import RunTree
from pftrack_server.sessions.worker.worker import KEEP_AFTER_S, Checkpoints
from tests.server.asking import diagnostics, get, kill, resume
from tests.server.holding import allow, held_worker, held_worker_that_keeps_all
from tests.server.host import Server, begin, steer
from tests.server.sessions.test_duplex import hear
from tests.server.sessions.test_run_tree import config
from tests.waiting import wait_for

FAR = 20
HELD = 5
"""The frame at which workers stand still."""


@contextmanager
def stopped(server: Server, client: httpx.Client, data: Path) -> Iterator[str]:
    """A session that had gone back by five frames when its worker was killed; its next one is held."""
    session = begin(client)["id"]
    steer(client, session, "seek", frame=FAR)
    steer(client, session, "seek", frame=FAR - 5)
    kill(server, client, session)
    allow(data / "data", HELD)
    yield session
    client.delete(f"/api/v1/sessions/{session}")


@pytest.mark.usefixtures("impatient", "server", "held")
class TestResuming:
    def test_it_takes_as_long_as_it_takes(self, start_server: Any, tmp_path: Path) -> None:
        """A run that needs longer than a start is allowed to take resumes, and reports its progress meanwhile."""
        with (
            start_server(start_seconds=2, hang_seconds=5) as (server, client),
            stopped(server, client, tmp_path) as session,
        ):
            before = diagnostics(client, session)
            resumed = resume(client, session)
            begun = time.monotonic()
            assert (resumed["state"], resumed["goal"]) == ("ready", FAR)
            assert resumed["computed"] <= HELD
            wait_for(lambda: server.manager.get(session).worker.heard > begun + 3, 60)
            with connect(f"{server.ws}/api/v1/sessions/{session}/stream") as socket:
                hear(socket)
                told = []
                for frames in [*range(HELD + 1, HELD + 7), FAR]:
                    allow(tmp_path / "data", frames)
                    while not told or told[-1] < frames:
                        told += [hear(socket).get("session", {}).get("computed", 0)]
            computed = [frame for frame in told if frame > 0]
            assert computed == sorted(computed)
            assert len(set(computed)) > 5
            wait_for(lambda: get(client, session)["goal"] is None)
            arrived = get(client, session)
            assert (arrived["position"], arrived["computed"], arrived["goal"]) == (FAR - 5, FAR, None)
            assert diagnostics(client, session) == before

    def test_it_can_be_interrupted(self, start_server: Any, tmp_path: Path) -> None:
        """A killed worker keeps the goal, a pause stops at the present frame, and a deleted session ends its worker."""
        with start_server() as (server, client), stopped(server, client, tmp_path) as session:
            assert resume(client, session)["goal"] == FAR
            kill(server, client, session)
            assert resume(client, session)["goal"] == FAR
            paused = steer(client, session, "pause")
            assert paused["goal"] is None
            assert paused["position"] == paused["computed"] <= HELD
            allow(tmp_path / "data")
            assert steer(client, session, "step")["position"] == paused["position"] + 1
            steer(client, session, "seek", frame=FAR)
            kill(server, client, session)
            allow(tmp_path / "data", HELD)
            assert resume(client, session)["goal"] == FAR
            pid = server.pid_of(session)
            assert client.delete(f"/api/v1/sessions/{session}").status_code == 204
            wait_for(lambda: not psutil.pid_exists(pid))

    def test_a_step_on_the_way_gives_up_no_frame(self, start_server: Any, tmp_path: Path) -> None:
        """It changes the frame to show at the end; a speed interrupts nothing. All known frames are computed again."""
        with (
            start_server() as (server, client),
            stopped(server, client, tmp_path) as session,
            ThreadPoolExecutor(2) as pool,
        ):
            assert resume(client, session)["goal"] == FAR
            assert steer(client, session, "speed", speed=2)["goal"] == FAR
            first = pool.submit(steer, client, session, "step")
            wait_for(lambda: get(client, session)["goal_position"] == FAR - 4)
            second = pool.submit(steer, client, session, "seek", frame=2)
            assert first.result()["goal"] == FAR
            wait_for(lambda: get(client, session)["goal_position"] == 2)
            allow(tmp_path / "data")
            arrived = second.result()
            assert (arrived["position"], arrived["computed"], arrived["goal"]) == (2, FAR, None)

    def test_with_its_states_it_is_back_at_once(
        self, start_server: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        """A slow run is stored while it is computed, and is not computed again."""
        monkeypatch.setattr("pftrack_server.sessions.worker_handle.main", held_worker_that_keeps_all)
        with start_server() as (server, client):
            session = begin(client)["id"]
            steer(client, session, "seek", frame=FAR)
            states = tmp_path / "data" / "states" / session
            assert list(states.glob("b0.states"))
            before = diagnostics(client, session)
            kill(server, client, session)
            allow(tmp_path / "data", 0)
            assert resume(client, session)["computed"] == FAR
            wait_for(lambda: get(client, session)["goal"] is None, 30)
            assert get(client, session)["position"] == FAR
            assert diagnostics(client, session) == before
            client.delete(f"/api/v1/sessions/{session}")
            assert not states.exists()


@pytest.fixture
def held(monkeypatch: pytest.MonkeyPatch) -> None:
    """Have workers stand still where a test says."""
    monkeypatch.setattr("pftrack_server.sessions.worker_handle.main", held_worker)


@pytest.fixture
def impatient(monkeypatch: pytest.MonkeyPatch) -> None:
    """Have the server answer before a session is where it was, on fast machines, too."""
    monkeypatch.setattr("pftrack_server.sessions.manager.OPENING_S", 0.1)


def test_what_took_long_is_written_once(tmp_path: Path) -> None:
    """A branch is stored when computing it took some seconds, and continues there the next time.

    Nothing is written if less space would be left free than the server must leave.
    """
    kept = dataclasses.replace(config(), states=str(tmp_path / "states"))
    for reserve_bytes, seconds in ((0, KEEP_AFTER_S / 2), (1 << 60, KEEP_AFTER_S), (0, KEEP_AFTER_S)):
        assert not (tmp_path / "states").exists()
        tree = RunTree(dataclasses.replace(kept, reserve_bytes=reserve_bytes))
        tree.run.seek(20)
        Checkpoints(tree).on_frame(seconds)
    assert RunTree(kept).run.computed == 20
