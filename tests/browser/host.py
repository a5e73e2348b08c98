"""A real server process, as `pftrack serve` starts it, and requests to it and harm of it."""

import os
import subprocess
import sys
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import httpx
import psutil

from tests.installing import environment
from tests.server.follow_jobs import taken
from tests.session_requests import session_request
from tests.waiting import wait_for

START_S = 240.0


class Server:
    """`pftrack serve` on a free port; a second start serves the same data at the same place."""

    def __init__(self, data: Path, installed: Path | None = None, token: str | None = None, **variables: str) -> None:
        """Start it on a folder of data, beside packages in another folder, with its own variables."""
        self.token = token
        if token is not None:
            variables["PFTRACK_TOKEN"] = token
        self.data = data
        inherited = environment(installed) if installed else os.environ
        self._environment = {**inherited, "PYTHONUNBUFFERED": "1", **variables}
        self._port = 0
        self.base = ""
        self._born: dict[str, set[int]] = {}
        self._process: subprocess.Popen[str] | None = None
        # Without certificates, which take 20 ms to read; and no connection outlives the server, which may be restarted.
        self._http = httpx.Client(
            verify=False,  # noqa: S501
            timeout=60,
            limits=httpx.Limits(max_keepalive_connections=0),
            headers={"Authorization": f"Bearer {token}"} if token else {},
        )
        self.log = data / "pftrack_server.core.log"
        self.start()

    @property
    def origin(self) -> str:
        return f"http://127.0.0.1:{self._port}"

    @property
    def url(self) -> str:
        return self.origin + self.base

    def start(self) -> None:
        """Start and wait until the link is printed."""
        with self.log.open("a") as log:
            self._process = subprocess.Popen(
                self.command(), stdout=subprocess.PIPE, stderr=log, text=True, env=self._environment
            )
        line = self._process.stdout.readline()
        if "http://" not in line:
            self.stop()
            raise AssertionError(f"the server did not start: {self.log.read_text()[-2000:]}")
        link = urlsplit(line.split()[-1])
        self._port = link.port or 0
        self.base = link.path.rstrip("/")
        until(lambda: self._http.get(f"{self.url}/healthz").is_success, "the server answers", START_S)

    def command(self) -> list[str]:
        """Return the command line."""
        return [sys.executable, "-m", "pftrack", "serve", "--port", str(self._port), "--data-dir", str(self.data)]

    @property
    def pid(self) -> int | None:
        return self._process.pid if self._process else None

    def kill(self) -> None:
        """Kill the server's own process, as the kernel does when memory runs out; its children live on."""
        if self._process is not None:
            self._process.kill()
            self._forget()

    def stop(self) -> None:
        """Stop it as a service manager does."""
        if self._process is None:
            return
        self._process.terminate()
        try:
            self._process.wait(20)
        except subprocess.TimeoutExpired:
            self._process.kill()
        self._forget()

    def _forget(self) -> None:
        if self._process is not None and self._process.stdout is not None:
            self._process.wait(10)
            self._process.stdout.close()
        self._process = None

    # ------------------------------------------------------------ REST

    def get(self, path: str) -> Any:
        return self._answer("GET", path)

    def post(self, path: str, body: dict[str, Any] | None = None) -> Any:
        return self._answer("POST", path, body or {})

    def patch(self, path: str, body: dict[str, Any]) -> Any:
        return self._answer("PATCH", path, body)

    def delete(self, path: str) -> None:
        self._answer("DELETE", path)

    def export(self, session: str, name: str) -> httpx.Response:
        """Return a file of a session."""
        with httpx.Client(base_url=self.url, headers=self._http.headers, verify=False, timeout=60) as http:  # noqa: S501
            return taken(http, session, name)

    def start_session(self, **wish: Any) -> dict[str, Any]:
        """Start a session, by default the ball's."""
        before = set(descendants(self._process.pid))
        wanted = session_request({"experiment": "ball", "seed": 5, "frames": 90, **wish})
        session: dict[str, Any] = self.post("sessions", wanted)
        self._born[session["id"]] = set(descendants(self._process.pid)) - before
        if "position" in wish:
            until(lambda: self.session(session["id"])["goal"] is None, "the session is at its frame")
        return session

    def upload(self, name: str, content: bytes) -> str:
        """Upload a clip, and return its number."""
        answer = self._http.post(f"{self.url}/api/v1/uploads", files={"file": (name, content)})
        return str(answer.raise_for_status().json()["id"])

    def session(self, session: str) -> dict[str, Any]:
        return self.get(f"sessions/{session}")

    def seek(self, session: str, frame: int) -> None:
        self.post(f"sessions/{session}/commands", {"kind": "seek", "frame": frame})

    def column(self, session: str, name: str, branch: str | None = None) -> list[Any]:
        """Return one column of the diagnostics of a branch, by default the active one."""
        branch = branch or self.session(session)["branch"]
        return self.get(f"sessions/{session}/diagnostics?branch={branch}")["columns"][name]

    def end_sessions(self, keep: int = 0) -> None:
        """End all sessions but the newest `keep`."""
        for session in self.get("sessions")[keep:]:
            self._http.delete(f"{self.url}/api/v1/sessions/{session['id']}")

    def _answer(self, method: str, path: str, body: dict[str, Any] | None = None) -> Any:
        answer = self._http.request(method, f"{self.url}/api/v1/{path}", json=body)
        assert answer.is_success, f"{method} {path}: {answer.status_code} {answer.text}"
        return answer.json() if answer.content else None

    # ------------------------------------------------------------ harm

    def kill_worker(self, session: str) -> None:
        """Kill the process that runs a session's tracker: the newest one that appeared when the session began."""
        living = self._born[session] & set(descendants(self._process.pid))
        assert living, "the worker has ended already"
        newest(living).kill()


def newest(pids: Iterable[int]) -> psutil.Process:
    """Return the process that was started last; numbers begin anew when the system has used them up."""
    return max((psutil.Process(pid) for pid in pids), key=lambda process: (process.create_time(), process.pid))


def descendants(pid: int) -> list[int]:
    """Return all processes below a process."""
    below: dict[int, list[int]] = {}
    for stat in Path("/proc").glob("[0-9]*/stat"):
        try:
            fields = stat.read_text().rsplit(")", 1)[1].split()
        except OSError:
            continue
        below.setdefault(int(fields[1]), []).append(int(stat.parent.name))
    found, waiting = [], [pid]
    while waiting:
        children = below.get(waiting.pop(), [])
        found += children
        waiting += children
    return found


def until(holds: Callable[[], object], what: str, seconds: float = 90.0) -> None:
    """Ask again and again until something holds."""

    def holds_by_now() -> object:
        try:
            return holds()
        except httpx.TransportError:
            return False

    wait_for(holds_by_now, seconds, what)
