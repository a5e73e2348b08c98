"""Memory of a server, a session, a follower and a worker of a sweep.

It is the proportional set size: the processes' private memory, and their share of shared memory. So the server's figure
holds if no other process of pftrack runs. A session plays unwatched; followers follow one session, each with the three
sockets of a page. A worker's figure is the difference of `pftrack sweep` with two workers and with one.
"""

from _table import Size, arguments, progress, report, single_threaded

single_threaded()

import asyncio  # noqa: E402
import subprocess  # noqa: E402
import sys  # noqa: E402
import tempfile  # noqa: E402
import time  # noqa: E402
from collections.abc import Iterator  # noqa: E402
from pathlib import Path  # noqa: E402
from urllib.parse import urlsplit  # noqa: E402

import psutil  # noqa: E402
from _server import Server, memory_mib, new_server, row  # noqa: E402
from follow import seat, watch  # noqa: E402

IDLE_MIB = 250.0
SWEEP = ("sweep", "ball", "--axis", "occlusion_width_px=5:95:1", "--trackers", "h-spf", "--trials", "1000", "--json")


def measure_server(count: int, followers: int, settling: float) -> Iterator[dict[str, object]]:
    """Measure a server without and with sessions, and with a class."""
    progress("a server")
    with new_server() as server:
        time.sleep(settling)
        idle = memory_mib(server.family())
        yield row("a server without sessions, MiB", idle, None, IDLE_MIB)
        sessions = [server.start(play=True) for _ in range(count)]
        time.sleep(settling)
        busy = memory_mib(server.family())
        yield row("each session, MiB", (busy - idle) / count, None)
        progress("a class")
        yield row("each follower, MiB", asyncio.run(follow(server, sessions[0], followers, settling)), None)


async def follow(server: Server, session: str, count: int, settling: float) -> float:
    """Return the memory of each follower of a session, MiB."""
    begun = server.ask("POST", "/api/v1/follows", {"sessions": [session], "most_followers": 1000})
    link = begun["links"][0]["address"]
    before = memory_mib(server.family())
    for _ in range(count):
        await watch(server, urlsplit(link).path, session, await asyncio.to_thread(seat, link))
    await asyncio.sleep(settling)
    return (memory_mib(server.family()) - before) / count


def measure_sweep(settling: float) -> Iterator[dict[str, object]]:
    """Measure a sweep with one worker, and the increase by a second one."""
    progress("a sweep")
    one, two = (memory_of_sweep(jobs, settling) for jobs in (1, 2))
    yield row("a sweep with one worker, MiB", one, None)
    yield row("each other worker of a sweep, MiB", two - one, None)


def memory_of_sweep(jobs: int, settling: float) -> float:
    """Return the memory of a sweep, MiB, while all its workers compute."""
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-m", "pftrack", *SWEEP, "--jobs", str(jobs), "--out", f"{folder}/out.parquet"]
        sweep = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        try:
            while not any(Path(folder).rglob("*.parquet")):  # the first chunk
                if sweep.poll() is not None:
                    raise SystemExit("the sweep ended by itself")
                time.sleep(0.1)
            time.sleep(settling)
            process = psutil.Process(sweep.pid)
            return memory_mib([process, *process.children(recursive=True)])
        finally:
            sweep.terminate()
            sweep.wait(timeout=30)


def main() -> None:
    """Measure and report."""
    given = arguments(
        __doc__.splitlines()[0],
        sessions=Size(4, 1, "number of playing sessions"),
        followers=Size(50, 2, "number of followers of one of them"),
        settling=Size(5.0, 0.3, "time to settle before each measurement, s"),
    )
    rows = [*measure_server(given.sessions, given.followers, given.settling), *measure_sweep(given.settling)]
    report("Memory", rows, as_json=given.json)


if __name__ == "__main__":
    main()
