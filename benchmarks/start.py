"""The start: time to the first page and to a running session.

With `--install 1` it is the first start of a new user: a clone of this checkout, without caches, whose `make serve`
installs, serves and compiles; the installation of the same packages alone is measured, too. Otherwise it is a later
start with everything installed and compiled.
"""

from _table import Size, arguments, progress, report, single_threaded

single_threaded()

import os  # noqa: E402
import shutil  # noqa: E402
import signal  # noqa: E402
import subprocess  # noqa: E402
import sys  # noqa: E402
import tempfile  # noqa: E402
import time  # noqa: E402
import urllib.error  # noqa: E402
from collections.abc import Iterator  # noqa: E402
from http import HTTPStatus  # noqa: E402
from pathlib import Path  # noqa: E402
from statistics import median  # noqa: E402

from _server import Server, new_server, row  # noqa: E402

ROOT = Path(__file__).parents[1]
PAGE_S, SESSION_S = 3.0, 6.0
INSTALLED_PAGE_S, INSTALLED_BALL_S = 8.0, 25.0


def time_start() -> dict[str, float]:
    """Start a server as people do; return the times until a page, and until a session with a frame, s."""
    begun = time.perf_counter()
    with new_server() as server:
        server.ask("GET", "/")
        page = time.perf_counter() - begun
        show(server)
        return {"page": page, "session": time.perf_counter() - begun}


def show(server: Server) -> None:
    """Start a session and wait for its picture."""
    session = server.start(play=False)
    server.ask("GET", f"/api/v1/sessions/{session}/frame.png")


def show_when_compiled(server: Server) -> None:
    """Start a session once the server accepts it, and wait for its picture; each refused request has waited a while."""
    while True:
        try:
            show(server)
        except urllib.error.HTTPError as error:
            if error.code != HTTPStatus.SERVICE_UNAVAILABLE:
                raise
        else:
            return


def measure_later_starts(repeats: int) -> Iterator[dict[str, object]]:
    """Measure starts with everything compiled."""
    progress("later starts")
    times = [time_start() for _ in range(repeats + 1)][1:]  # the first one reads files from the disk
    for what, name, goal in (
        ("from the command to the first page, s", "page", PAGE_S),
        ("to the first picture of a session, s", "session", SESSION_S),
    ):
        values = [each[name] for each in times]
        yield row(what, median(values), max(values), goal)


def measure_first_start() -> Iterator[dict[str, object]]:
    """Measure a new user's first start, and the installation alone."""
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        fresh = os.environ | {"UV_CACHE_DIR": f"{place}/uv", "PIP_CACHE_DIR": f"{place}/pip", "PFTRACK_BASE_PATH": ""}
        progress("the installation alone")
        begun = time.perf_counter()
        subprocess.run([sys.executable, "-m", "venv", place / "alone"], check=True)
        python = place / "alone" / "bin" / "python"
        subprocess.run([python, "-m", "pip", "install", "--quiet", "uv"], check=True, env=fresh)
        install = [
            python,
            "-m",
            "uv",
            "pip",
            "install",
            "--quiet",
            "--python",
            python,
            "-c",
            "constraints.txt",
            "-e",
            ".",
        ]
        subprocess.run(install, check=True, cwd=ROOT, env=fresh)
        alone = time.perf_counter() - begun
        for cache in ("uv", "pip"):
            shutil.rmtree(place / cache, ignore_errors=True)
        yield row("the installation alone, s", alone, None)

        subprocess.run(["git", "clone", "--quiet", ROOT, place / "clone"], check=True)  # noqa: S607 - whichever git is here
        progress("make serve")
        begun = time.perf_counter()
        command = ["make", "serve", "PORT=0", f"DATA={place / 'data'}"]
        server = Server("", command=command, cwd=place / "clone", env=fresh)
        try:
            server.ask("GET", "/")
            page = time.perf_counter() - begun
            yield row("make serve to the first page, s", page, None, alone + INSTALLED_PAGE_S)
            show_when_compiled(server)
            yield row("to a ball that is tracked, s", time.perf_counter() - begun, None, alone + INSTALLED_BALL_S)
            while not server.ask("GET", "/api/v1/compilation")["finished"]:
                time.sleep(0.5)
            yield row("to all experiments, s", time.perf_counter() - begun, None)
        finally:
            server.close()


def main() -> None:
    """Measure and report."""
    given = arguments(
        "Time until a server is ready.",
        repeats=Size(5, 1, "starts"),
        install=Size(0, 0, "1 to measure a first start too, which installs everything again"),
    )
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))
    rows = [*measure_later_starts(given.repeats)]
    if given.install:
        rows += measure_first_start()
    report("The start of a server", rows, as_json=given.json)


if __name__ == "__main__":
    main()
