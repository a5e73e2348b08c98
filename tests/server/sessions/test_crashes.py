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
from tests.server.host import Server, begin, change_values, command, error_of, steer
from tests.server.sessions.test_duplex import changes, has_changed, hear, until
from tests.waiting import wait_for


def state(client: httpx.Client, session: str) -> str:
    return str(client.get(f"/api/v1/sessions/{session}").json()["state"])


def diagnostics(client: httpx.Client, session: str) -> dict[str, Any]:
    columns: dict[str, Any] = client.get(f"/api/v1/sessions/{session}/diagnostics").json()["columns"]
    # How long a step took is the only thing that is not the same each time.
    return {name: column for name, column in columns.items() if name != "step_ms"}


class TestKilledWorkers:
    def test_others_go_on_and_it_resumes_where_it_was(self, server: Server, client: httpx.Client) -> None:
        """A killed worker ends its own session alone, says so, and the session continues where it was."""
        victim, other = begin(client), begin(client, seed=8)
        steer(client, other["id"], "play")
        steer(client, victim["id"], "seek", frame=30)
        steer(client, victim["id"], "seek", frame=20)
        before = diagnostics(client, victim["id"])
        with connect(f"{server.ws}/api/v1/sessions/{victim['id']}/stream") as socket:
            hear(socket)
            os.kill(server.pid_of(victim["id"]), signal.SIGKILL)
            told = changes(until(socket, has_changed(state="crashed"))[-1])
            assert "killed" in told["message"]
            head = client.get(f"/api/v1/sessions/{other['id']}").json()["computed"]
            wait_for(lambda: client.get(f"/api/v1/sessions/{other['id']}").json()["computed"] > head + 5)
            error_of(change_values(client, victim["id"], {"sample_count": 9}), 409)
            assert diagnostics(client, victim["id"]) == before
            resumed = client.post(f"/api/v1/sessions/{victim['id']}/resume").json()
            assert (resumed["state"], resumed["position"], resumed["computed"]) == ("ready", 20, 30)
            until(socket, lambda message: message["type"] == "hello")
        assert diagnostics(client, victim["id"]) == before

    def test_no_process_can_be_made(
        self, server: Server, client: httpx.Client, session: dict[str, Any], monkeypatch: pytest.MonkeyPatch
    ) -> None:
        """While the fork server does not come up, a resume asks to try again, and the next one succeeds."""
        os.kill(server.pid_of(session["id"]), signal.SIGKILL)
        wait_for(lambda: state(client, session["id"]) == "crashed")
        with monkeypatch.context() as patched:
            patched.setattr(worker_handle, "FORK_SERVER", ForkServer("no_such_module"))
            refused = client.post(f"/api/v1/sessions/{session['id']}/resume")
        assert "could not start a process; try again" in error_of(refused, 503)["message"]
        assert client.post(f"/api/v1/sessions/{session['id']}/resume").json()["state"] == "ready"

    @pytest.mark.slow
    def test_the_fork_server(self, server: Server, client: httpx.Client, session: dict[str, Any]) -> None:
        """A session whose fork server was killed, as a filter may do, resumes where it was."""
        steer(client, session["id"], "seek", frame=20)
        before = diagnostics(client, session["id"])
        os.kill(psutil.Process(server.pid_of(session["id"])).ppid(), signal.SIGKILL)
        wait_for(lambda: state(client, session["id"]) == "crashed")
        assert client.post(f"/api/v1/sessions/{session['id']}/resume").json()["position"] == 20
        assert diagnostics(client, session["id"]) == before

    def test_a_request_under_way_is_answered(self, server: Server, client: httpx.Client) -> None:
        """A request that waits for a worker that dies is answered with a clear error."""
        session = begin(client, frames=20_000)
        pid, waiting = server.pid_of(session["id"]), server.manager.get(session["id"]).worker._waiting
        os.kill(pid, signal.SIGSTOP)
        before = len(waiting)
        with ThreadPoolExecutor(1) as pool:
            answer = pool.submit(command, client, session["id"], "step")
            wait_for(lambda: len(waiting) > before, 30)
            os.kill(pid, signal.SIGKILL)
            assert "killed" in error_of(answer.result(), 503)["message"]


class TestBudgets:
    def test_a_hung_worker(self, start_server: Any) -> None:
        """A worker that gives no sign of life is ended, and its session says so and can be resumed."""
        with start_server(hang_seconds=2) as (server, client):
            session = begin(client)
            steer(client, session["id"], "seek", frame=10)
            os.kill(server.pid_of(session["id"]), signal.SIGSTOP)
            wait_for(lambda: state(client, session["id"]) == "crashed", 60)
            found = client.get(f"/api/v1/sessions/{session['id']}").json()
            assert "did not respond for 2 s" in found["message"]
            assert client.post(f"/api/v1/sessions/{session['id']}/resume").json()["position"] == 10

    def test_a_worker_that_compiles_is_not_hung(self, start_server: Any) -> None:
        """It is silent for as long as a function takes, and has the patience that one has which starts."""
        with start_server(hang_seconds=1, start_seconds=4) as (server, client):
            session = begin(client)
            active = server.manager.get(session["id"]).spec.active
            os.kill(server.pid_of(session["id"]), signal.SIGSTOP)
            active.run = active.run.model_copy(update={"compiling": 3})
            wait_for(lambda: state(client, session["id"]) == "crashed", 60)
            assert "did not respond for 4 s" in client.get(f"/api/v1/sessions/{session['id']}").json()["message"]

    def test_a_paused_worker_is_not_hung(self, start_server: Any) -> None:
        """A worker that has nothing to do still gives signs of life."""
        with start_server(hang_seconds=4) as (server, client):
            session = begin(client)
            first = server.manager.get(session["id"]).worker.heard
            wait_for(lambda: server.manager.get(session["id"]).worker.heard > first + 5, 60)
            assert state(client, session["id"]) == "ready"

    def test_processor_time(self, start_server: Any) -> None:
        """A worker that used up its processor time is ended, and its session says so."""
        with start_server(worker_cpu_seconds=1) as (_, client):
            session = begin(client, frames=20_000, parameters={"sample_count": 5000})
            steer(client, session["id"], "speed", speed=0)
            steer(client, session["id"], "play")
            wait_for(lambda: state(client, session["id"]) == "crashed", 30)
            assert "1 s of processor time" in client.get(f"/api/v1/sessions/{session['id']}").json()["message"]

    def test_memory(self, server: Server, client: httpx.Client) -> None:
        """A worker may allocate what it is allowed and no more."""
        session = begin(client)
        soft, _ = psutil.Process(server.pid_of(session["id"])).rlimit(psutil.RLIMIT_AS)
        used = psutil.Process(server.pid_of(session["id"])).memory_info().vms
        assert used < soft < used + 1.1 * server.app.state.services.settings.worker_memory_bytes


class TestSuspending:
    def test_idle_sessions_are_suspended_and_go_on(self, start_server: Any) -> None:
        """A session without visitors is suspended, frees its worker, and goes on when somebody comes."""
        with start_server(idle_seconds=1) as (server, client):
            session = begin(client)
            steer(client, session["id"], "seek", frame=25)
            before = diagnostics(client, session["id"])
            pid = server.pid_of(session["id"])
            wait_for(lambda: state(client, session["id"]) == "suspended")
            wait_for(lambda: not psutil.pid_exists(pid))
            assert "paused after inactivity" in client.get(f"/api/v1/sessions/{session['id']}").json()["message"]
            with connect(f"{server.ws}/api/v1/sessions/{session['id']}/stream") as socket:
                until(socket, lambda m: m["type"] == "hello" and m["session"]["state"] == "ready")
                visited = server.manager.get(session["id"]).left
                wait_for(lambda: server.manager.get(session["id"]).left > visited + 2, 60)
                assert state(client, session["id"]) == "ready"
            assert diagnostics(client, session["id"]) == before

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
            session = begin(client, seed=11)
            steer(client, session["id"], "seek", frame=20)
            client.post(f"/api/v1/sessions/{session['id']}/bookmarks", json={"note": "keep me"})
            with closing(sqlite3.connect(tmp_path / "data" / "pftrack.sqlite")) as database:
                (spec,) = database.execute("SELECT spec FROM sessions").fetchone()
            assert '"note":"keep me"' in spec
            command(client, session["id"], "branch", frame=10, values={"tracker": "apf"}, title="B")
            steer(client, session["id"], "seek", frame=18)
            before = diagnostics(client, session["id"])
        with start_server() as (_, client):
            (found,) = client.get("/api/v1/sessions").json()
            assert (found["id"], found["state"]) == (session["id"], "suspended")
            assert found["bookmarks"][0]["note"] == "keep me"
            assert [branch["title"] for branch in found["branches"]] == ["Main", "B"]
            resumed = client.post(f"/api/v1/sessions/{session['id']}/resume").json()
            assert (resumed["position"], resumed["tracker"], resumed["recipe"]["seed"]) == (18, "apf", 11)
            assert diagnostics(client, session["id"]) == before


def test_a_mistake_in_a_tracker(start_server: Any) -> None:
    """A mistake in the computation is told without its stack, which is in the log, and the session can be resumed."""
    with start_server() as (server, client):
        session = begin(client)
        steer(client, session["id"], "seek", frame=5)
        link = server.manager.get(session["id"]).worker
        # What the web process never sends, which is as good as a mistake of the worker's own.
        link._end.send(Request(999, None))
        wait_for(lambda: state(client, session["id"]) == "crashed")
        message = client.get(f"/api/v1/sessions/{session['id']}").json()["message"]
        assert "Traceback" not in message
        assert "computation failed" in message
        assert client.post(f"/api/v1/sessions/{session['id']}/resume").json()["position"] == 5
