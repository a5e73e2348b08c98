"""A temporary server in a process of its own, on an empty data folder."""

import json
import os
import subprocess
import sys
import tempfile
import time
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

__all__ = ["Server", "serve"]

ROOT = Path(__file__).parents[2]


class Server:
    """A server, and the requests that set the scene for a picture."""

    def __init__(self, url: str) -> None:
        self.url = url

    def ask(self, method: str, path: str, body: object = None) -> Any:
        """Make a request of the interface and return its JSON."""
        data = None if body is None else json.dumps(body).encode()
        headers = {"Content-Type": "application/json"}
        request = urllib.request.Request(f"{self.url}/api/v1/{path}", data, headers, method=method)  # noqa: S310 - our own server
        with urllib.request.urlopen(request, timeout=120) as answer:  # noqa: S310
            content = answer.read()
        return json.loads(content) if content else None

    def session(self, frame: int = 0, **recipe: object) -> str:
        """Start a session, compute it up to a frame, and return its name."""
        name = str(self.ask("POST", "sessions", {"recipe": recipe})["id"])
        self.seek(name, frame)
        return name

    def seek(self, session: str, frame: int) -> None:
        """Go to a frame of a session."""
        self.ask("POST", f"sessions/{session}/commands", {"kind": "seek", "frame": frame})

    def until(self, path: str, done: str, *, seconds: float = 300) -> Any:
        """Poll until a field of the answer is true, and return the answer."""
        end = time.monotonic() + seconds
        while not (answer := self.ask("GET", path))[done]:
            if time.monotonic() > end:
                raise TimeoutError(f"{path} has not finished in {seconds:g} s")
            time.sleep(0.2)
        return answer


@contextmanager
def serve() -> Iterator[Server]:
    """Start a server and end it again."""
    with tempfile.TemporaryDirectory() as folder:
        places = os.pathsep.join((str(ROOT), str(ROOT / "server"), os.environ.get("PYTHONPATH", "")))
        process = subprocess.Popen(
            [sys.executable, "-m", "pftrack", "serve", "--port", "0", "--data-dir", folder],
            cwd=ROOT,
            env={**os.environ, "PFTRACK_BASE_PATH": "", "PYTHONPATH": places, "PYTHONUNBUFFERED": "1"},
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
        )
        try:
            line = next((line for line in process.stdout or () if "http://" in line), None)
            if line is None:
                raise RuntimeError("the server did not start")
            server = Server(line[line.index("http://") :].strip().rstrip("/"))
            server.until("compilation", "finished")
            yield server
        finally:
            process.terminate()
            process.wait(30)
