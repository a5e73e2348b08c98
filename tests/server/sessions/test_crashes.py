"""Workers that are killed, hang, or take too much, and servers that stop: nobody else notices, nothing is lost."""

import os
import signal
import sqlite3
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing
from pathlib import Path
from typing import Any

import httpx
import psutil
import pytest
from websockets.sync.client import connect

from pftrack.process import ForkServer
from pftrack_server.sessions import worker_handle
from pftrack_server.sessions.worker.protocol import Request
from tests.server.asking import diagnostics, get, kill, resume
from tests.server.host import Server, begin, change_values, command, error_of, steer
from tests.server.sessions.test_duplex import changes, has_changed, hear, until
from tests.waiting import wait_for


def state(client: httpx.Client, session: str) -> str:
    return str(get(client, session)["state"])


class TestKilledWorkers:
    def test_others_go_on_and_it_resumes_where_it_was(self, server: Server, client: httpx.Client) -> None:
        """A killed worker ends its own session alone, says so, and the session continues where it was."""
        victim, other = begin(client)["id"], begin(client, seed=8)["id"]
        steer(client, other, "play")
        steer(client, victim, "seek", frame=30)
        steer(client, victim, "seek", frame=20)
        before = diagnostics(client, victim)
        with connect(f"{server.ws}/api/v1/sessions/{victim}/stream") as socket:
            hear(socket)
            kill(server, client, victim)
            assert "killed" in changes(until(socket, has_changed(state="crashed"))[-1])["message"]
            head = get(client, other)["computed"]
            wait_for(lambda: get(client, other)["computed"] > head + 5)
            error_of(change_values(client, victim, {"sample_count": 9}), 409)
            assert diagnostics(client, victim) == before
            resumed = resume(client, victim)
            assert (resumed["state"], resumed["position"], resumed["computed"]) == ("ready", 20, 30)
            until(socket, lambda message: message["type"] == "hello")
        assert diagnostics(client, victim) == before

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

    @pytest.mark.slow
    def test_the_fork_server(self, server: Server, client: httpx.Client, session: dict[str, Any]) -> None:
        """A session whose fork server was killed, as a filter may do, resumes where it was."""
        steer(client, session["id"], "seek", frame=20)
        before = diagnostics(client, session["id"])
        os.kill(psutil.Process(server.pid_of(session["id"])).ppid(), signal.SIGKILL)
        wait_for(lambda: state(client, session["id"]) == "crashed")
        assert resume(client, session["id"])["position"] == 20
        assert diagnostics(client, session["id"]) == before

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
    @pytest.mark.parametrize(("compiling", "seconds"), [(None, 1), (3, 3)])
    def test_a_hung_worker(self, start_server: Any, compiling: int | None, seconds: int) -> None:
        """A worker that gives no sign of life is ended, and its session says so and can be resumed.

        One that compiles is silent for as long as a function takes, and has the patience that one has which starts.
        """
        with start_server(hang_seconds=1, start_seconds=3) as (server, client):
            session = begin(client)["id"]
            steer(client, session, "seek", frame=10)
            active = server.manager.get(session).spec.active
            os.kill(server.pid_of(session), signal.SIGSTOP)
            active.run = active.run.model_copy(update={"compiling": compiling})
            wait_for(lambda: state(client, session) == "crashed")
            assert f"did not respond for {seconds} s" in get(client, session)["message"]
            assert resume(client, session)["position"] == 10

    def test_a_paused_worker_is_not_hung(self, start_server: Any) -> None:
        """A worker that has nothing to do still gives signs of life."""
        with start_server(hang_seconds=4) as (server, client):
            session = begin(client)["id"]
            first = server.manager.get(session).worker.heard
            wait_for(lambda: server.manager.get(session).worker.heard > first + 5)
            assert state(client, session) == "ready"

    def test_processor_time_and_memory(self, start_server: Any) -> None:
        """A worker that used up its processor time is ended, and its session says so.

        It may allocate what it is allowed and no more.
        """
        with start_server(worker_cpu_seconds=1) as (server, client):
            session = begin(client, frames=20_000, parameters={"sample_count": 5000})["id"]
            worker = psutil.Process(server.pid_of(session))
            (soft, _), used = worker.rlimit(psutil.RLIMIT_AS), worker.memory_info().vms
            assert used < soft < used + 1.1 * server.app.state.services.settings.worker_memory_bytes
            steer(client, session, "speed", speed=0)
            steer(client, session, "play")
            wait_for(lambda: state(client, session) == "crashed")
            assert "1 s of processor time" in get(client, session)["message"]


class TestSuspending:
    def test_idle_sessions_are_suspended_and_go_on(self, start_server: Any) -> None:
        """A session without visitors is suspended, frees its worker, and goes on when somebody comes."""
        with start_server(idle_seconds=1) as (server, client):
            session = begin(client)["id"]
            steer(client, session, "seek", frame=25)
            before, pid = diagnostics(client, session), server.pid_of(session)
            wait_for(lambda: state(client, session) == "suspended" and not psutil.pid_exists(pid))
            assert "paused after inactivity" in get(client, session)["message"]
            with connect(f"{server.ws}/api/v1/sessions/{session}/stream") as socket:
                until(socket, lambda m: m["type"] == "hello" and m["session"]["state"] == "ready")
                visited = server.manager.get(session).left
                wait_for(lambda: server.manager.get(session).left > visited + 2)
                assert state(client, session) == "ready"
            assert diagnostics(client, session) == before

    def test_sessions_outlive_the_server(self, start_server: Any, tmp_path: Path) -> None:
        """After a restart of the server its sessions are suspended and go on where they were; what was ended is gone.

        What people made is in the database before its request is answered.
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
        with start_server() as (_, client):
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
