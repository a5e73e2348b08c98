"""Workers that are killed, hang or take too much, servers that stop, and runs that take long to compute again."""

import dataclasses
import os
import signal
import sqlite3
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Any

import httpx
import psutil
import pytest
from websockets.sync.client import connect

from pftrack.core.model.drawing import Picture
from pftrack.process import ForkServer
from pftrack_server.sessions import worker_handle
from pftrack_server.sessions.worker.protocol import Request
from pftrack_server.sessions.worker.run_tree import RunTree
from pftrack_server.sessions.worker.worker import KEEP_AFTER_S, Checkpoints
from tests.server.asking import diagnostics, get, kill, resume
from tests.server.follow_jobs import send_run
from tests.server.holding import allow, held_worker, held_worker_that_keeps_all
from tests.server.host import Server, begin, change_values, command, error_of, post, steer
from tests.server.sessions.test_duplex import Page, hear, until
from tests.server.sessions.test_run_tree import config
from tests.server.uploads.test_uploads import send, video
from tests.waiting import wait_for


def state(client: httpx.Client, session: str) -> str:
    return str(get(client, session)["state"])


class TestKilledWorkers:
    def test_others_go_on_and_it_resumes_where_it_was(self, server: Server, client: httpx.Client) -> None:
        """A killed worker ends its own session alone; viewers see the error, then the resumed run at its frame."""
        victim, other = begin(client)["id"], begin(client, frames=20_000)["id"]
        steer(client, other, "play")
        steer(client, victim, "seek", frame=20)
        with Page(server, victim) as page:
            page.until(20)
            kill(server, client, victim)
            head = get(client, other)["computed"]
            wait_for(lambda: get(client, other)["computed"] > head + 5)
            error_of(change_values(client, victim, {"sample_count": 9}), 409)
            assert resume(client, victim)["state"] == "ready"
            resumed = wait_for(lambda: (told := get(client, victim))["goal"] is None and told)
            assert (resumed["position"], resumed["computed"]) == (20, 20)
            assert isinstance(page.until(20).primitives["picture"], Picture)
            assert any("killed" in str(message["session"].get("message")) for message in page.heard)
            steer(client, victim, "step")
            page.until(21)

    def test_no_process_can_be_made(
        self, server: Server, client: httpx.Client, session: dict[str, Any], monkeypatch: pytest.MonkeyPatch
    ) -> None:
        """While the fork server does not come up, a resume asks to try again, and the next one succeeds."""
        kill(server, client, session["id"])
        with monkeypatch.context() as patched:
            patched.setattr(worker_handle, "FORK_SERVER", ForkServer("no_such_module"))
            refused = client.post(f"/api/v1/sessions/{session['id']}/resume")
        assert "could not start a process; try again" in error_of(refused, 503)["message"]
        assert resume(client, session["id"])["state"] == "ready"

    def test_a_request_under_way_is_answered(self, server: Server, client: httpx.Client) -> None:
        """A request that waits for a worker that dies is answered with a clear error."""
        session = begin(client, frames=20_000)["id"]
        pid, waiting = server.pid_of(session), server.manager.get(session).worker._waiting
        os.kill(pid, signal.SIGSTOP)
        before = len(waiting)
        with ThreadPoolExecutor(1) as pool:
            answer = pool.submit(command, client, session, "step")
            wait_for(lambda: len(waiting) > before, 30)
            os.kill(pid, signal.SIGKILL)
            assert "killed" in error_of(answer.result(), 503)["message"]


class TestBudgets:
    def test_a_hung_worker(self, start_server: Any) -> None:
        """A worker that gives no sign of life is ended, and its session says so and can be resumed.

        One that compiles is silent for as long as a function takes, and has the patience that one has which starts.
        """
        with start_server(hang_seconds=3, start_seconds=5) as (server, client):
            hung = [(begin(client)["id"], *more) for more in ((None, 3), (3, 5))]
            for session, compiling, _ in hung:
                steer(client, session, "seek", frame=10)
                active = server.manager.get(session).spec.active
                os.kill(server.pid_of(session), signal.SIGSTOP)
                active.run = active.run.model_copy(update={"compiling": compiling})
            for session, _, seconds in hung:
                wait_for(lambda session=session: state(client, session) == "crashed")
                assert f"did not respond for {seconds} s" in get(client, session)["message"]
                assert resume(client, session)["position"] == 10

    def test_processor_time_and_memory(self, start_server: Any) -> None:
        """A worker that used up its processor time is ended, and its session says so.

        It may allocate what it is allowed and no more.
        """
        with start_server(worker_cpu_seconds=500, worker_memory_bytes=700 << 20) as (server, client):
            session = begin(client)["id"]
            worker = psutil.Process(server.pid_of(session))
            (soft, _), used = worker.rlimit(psutil.RLIMIT_AS), worker.memory_info().vms
            assert used < soft < used + 1.1 * (700 << 20)
            assert 500 <= worker.rlimit(psutil.RLIMIT_CPU)[0] < 600
            worker.send_signal(signal.SIGXCPU)  # what the system does then
            wait_for(lambda: state(client, session) == "crashed")
            assert "500 s of processor time" in get(client, session)["message"]


class TestSuspending:
    def test_idle_sessions_are_suspended_and_go_on(self, start_server: Any) -> None:
        """A session without viewers is suspended and its worker ends; it resumes for the next viewer.

        A viewer keeps it open; its idle worker is not taken for a hung one.
        """
        with start_server(idle_seconds=1, hang_seconds=4) as (server, client):
            session = begin(client)["id"]
            steer(client, session, "seek", frame=25)
            before, pid = diagnostics(client, session), server.pid_of(session)
            wait_for(lambda: state(client, session) == "suspended" and not psutil.pid_exists(pid))
            assert "paused after inactivity" in get(client, session)["message"]
            with connect(f"{server.ws}/api/v1/sessions/{session}/stream") as socket:
                until(socket, lambda m: m["type"] == "hello" and m["session"]["state"] == "ready")
                visited = server.manager.get(session).left
                wait_for(lambda: server.manager.get(session).left > visited + 5)
                assert state(client, session) == "ready"
            assert diagnostics(client, session) == before

    def test_sessions_outlive_the_server(self, start_server: Any, tmp_path: Path) -> None:
        """After a restart sessions are suspended and resume at their frame; ended sessions are gone.

        What people made is in the database before its request is answered. Saved runs and uploads are there as well.
        """
        with start_server() as (server, client):
            for is_suspended in (False, True):
                ended = begin(client)["id"]
                if is_suspended:
                    server.run(server.manager.get(ended).suspend("Nobody is here."))
                client.delete(f"/api/v1/sessions/{ended}")
            session = begin(client, seed=11)["id"]
            steer(client, session, "seek", frame=20)
            client.post(f"/api/v1/sessions/{session}/bookmarks", json={"note": "keep me"})
            with closing(sqlite3.connect(tmp_path / "data" / "pftrack.sqlite")) as database:
                (spec,) = database.execute("SELECT spec FROM sessions").fetchone()
            assert '"note":"keep me"' in spec
            steer(client, session, "branch", frame=10, values={"tracker": "apf"}, title="B")
            steer(client, session, "seek", frame=18)
            before = diagnostics(client, session)
            run = post(client, "runs", session=session)
            upload = send(client, ("ball.mp4", video(5))).json()
        with start_server(max_record_bytes=1000) as (_, client):
            assert client.get("/api/v1/runs").json() == [run]
            assert client.get("/api/v1/uploads").json() == [upload]
            error_of(send_run(client, b"x" * 2000), 413)
            (found,) = client.get("/api/v1/sessions").json()
            assert (found["id"], found["state"]) == (session, "suspended")
            assert found["bookmarks"][0]["note"] == "keep me"
            assert [branch["title"] for branch in found["branches"]] == ["Main", "B"]
            resumed = resume(client, session)
            assert (resumed["position"], resumed["tracker"], resumed["recipe"]["seed"]) == (18, "apf", 11)
            assert diagnostics(client, session) == before


def test_a_mistake_in_a_tracker(server: Server, client: httpx.Client) -> None:
    """A mistake in the computation is told without its stack, which is in the log, and the session can be resumed."""
    session = begin(client)["id"]
    steer(client, session, "seek", frame=5)
    # What the web process never sends, which is as good as a mistake of the worker's own.
    server.manager.get(session).worker._end.send(Request(999, None))
    wait_for(lambda: state(client, session) == "crashed")
    message = get(client, session)["message"]
    assert ("Traceback" in message, "computation failed" in message) == (False, True)
    assert resume(client, session)["position"] == 5


FAR = 20
HELD = 5
"""The frame at which workers stand still."""


@contextmanager
def stopped(start_server: Any, **settings: float) -> Iterator[tuple[Server, httpx.Client, Path, str]]:
    """A session that had gone back by five frames when its worker was killed; its next one is held."""
    with start_server(**settings) as (server, client):
        data = server.app.state.services.settings.data_dir
        session = begin(client)["id"]
        steer(client, session, "seek", frame=FAR)
        steer(client, session, "seek", frame=FAR - 5)
        kill(server, client, session)
        allow(data, HELD)
        yield server, client, data, session
        client.delete(f"/api/v1/sessions/{session}")


@pytest.mark.usefixtures("impatient", "server", "held")
class TestResuming:
    def test_it_takes_as_long_as_it_takes(self, start_server: Any) -> None:
        """A run that needs longer than a start is allowed to take resumes, and reports its progress meanwhile."""
        with stopped(start_server, start_seconds=5, hang_seconds=5) as (server, client, data, session):
            before = diagnostics(client, session)
            resumed = resume(client, session)
            begun = time.monotonic()
            assert (resumed["state"], resumed["goal"]) == ("ready", FAR)
            assert resumed["computed"] <= HELD
            wait_for(lambda: server.manager.get(session).worker.heard > begun + 6, 60)
            with connect(f"{server.ws}/api/v1/sessions/{session}/stream") as socket:
                hear(socket)
                told = []
                for frames in [*range(HELD + 1, HELD + 7), FAR]:
                    allow(data, frames)
                    while not told or told[-1] < frames:
                        told += [hear(socket).get("session", {}).get("computed", 0)]
            computed = [frame for frame in told if frame > 0]
            assert computed == sorted(computed)
            assert len(set(computed)) > 5
            wait_for(lambda: get(client, session)["goal"] is None)
            arrived = get(client, session)
            assert (arrived["position"], arrived["computed"], arrived["goal"]) == (FAR - 5, FAR, None)
            assert diagnostics(client, session) == before

    def test_it_can_be_interrupted(self, start_server: Any) -> None:
        """A killed worker keeps the goal, a pause stops at the present frame, and a deleted session ends its worker."""
        with stopped(start_server) as (server, client, data, session):
            assert resume(client, session)["goal"] == FAR
            kill(server, client, session)
            assert resume(client, session)["goal"] == FAR
            paused = steer(client, session, "pause")
            assert paused["goal"] is None
            assert paused["position"] == paused["computed"] <= HELD
            allow(data)
            assert steer(client, session, "step")["position"] == paused["position"] + 1
            steer(client, session, "seek", frame=FAR)
            kill(server, client, session)
            allow(data, HELD)
            assert resume(client, session)["goal"] == FAR
            pid = server.pid_of(session)
            assert client.delete(f"/api/v1/sessions/{session}").status_code == 204
            wait_for(lambda: not psutil.pid_exists(pid))

    def test_a_step_on_the_way_gives_up_no_frame(self, start_server: Any) -> None:
        """It changes the frame to show at the end; a speed interrupts nothing. All known frames are computed again."""
        with stopped(start_server) as (_, client, data, session), ThreadPoolExecutor(2) as pool:
            assert resume(client, session)["goal"] == FAR
            assert steer(client, session, "speed", speed=2)["goal"] == FAR
            first = pool.submit(steer, client, session, "step")
            wait_for(lambda: get(client, session)["goal_position"] == FAR - 4)
            second = pool.submit(steer, client, session, "seek", frame=2)
            assert first.result()["goal"] == FAR
            wait_for(lambda: get(client, session)["goal_position"] == 2)
            allow(data)
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
