"""A class: each follower's frames per second, delay behind the lecturer, and load of the server.

A real server in a process of its own, a session that plays at 30 frames a second, a lecturer's page and a class of bare
sockets. Each follower has two, as a page does: the class and the session. It reports each drawing as painted once the
drawing is complete. The delay is the time from a frame's arrival at the lecturer's socket to its
arrival at a follower's, including the time of the sockets; it is negative if the lecturer is served later. The time
since the frame's first arrival at any socket is given, too. Some followers are slow: they answer half a second late, or
read nothing at all. All sockets share the machine's cores with the server.
"""

from _table import Size, arguments, progress, report, single_threaded

single_threaded()

import asyncio  # noqa: E402
import contextlib  # noqa: E402
import re  # noqa: E402
import urllib.request  # noqa: E402
from collections.abc import Callable, Iterator  # noqa: E402
from dataclasses import dataclass, field  # noqa: E402
from functools import partial  # noqa: E402
from statistics import median  # noqa: E402
from time import perf_counter  # noqa: E402
from urllib.parse import urlsplit  # noqa: E402

import psutil  # noqa: E402
from _bare import BareSocket, open_socket  # noqa: E402
from _server import Server, new_server, percentile, row  # noqa: E402

RATE_HZ = 30.0
LATE_S = 0.5
DRAWING = b"pfd"
FRAME = re.compile(rb'"frame":(\d+)')


@dataclass(slots=True)
class Watcher:
    """One page: arrival of each frame's drawing, and the numbers of messages and bytes."""

    painted: int = 0
    arrived: dict[int, float] = field(default_factory=dict)
    messages: int = 0
    carried: int = 0

    def session(self, late_s: float, socket: BareSocket, now: float, start: bytes, length: int) -> None:
        """Take a message of the session, and report a drawing as painted."""
        found = FRAME.search(start) if start.startswith(DRAWING) else None
        if found is None:
            self.message(socket, now, start, length)
            return
        self.arrived.setdefault(int(found[1]), now)
        self.carried += length
        if late_s:
            asyncio.get_running_loop().call_later(late_s, self._paint, socket)
        else:
            self._paint(socket)

    def message(self, _: BareSocket, __: float, ___: bytes, length: int) -> None:
        """Take another message."""
        self.messages += 1
        self.carried += length

    def _paint(self, socket: BareSocket) -> None:
        self.painted += 1
        socket.send(f'{{"type":"painted","count":{self.painted}}}')


def seat(address: str) -> dict[str, str]:
    """Open the link of a class, and return the headers of that browser."""
    with urllib.request.urlopen(address, timeout=60) as page:  # noqa: S310 - our own server
        return {"Cookie": page.headers["Set-Cookie"].partition(";")[0]}


async def watch(server: Server, prefix: str, session: str, headers: dict[str, str], late_s: float = 0.0) -> Watcher:
    """Open the sockets of one page."""
    watcher = Watcher()
    web = f"{server.url.replace('http', 'ws')}{prefix}/api/v1"
    if prefix:
        await open_socket(f"{web}/follow/stream", watcher.message, headers)
    await open_socket(f"{web}/sessions/{session}/stream?paints=true", partial(watcher.session, late_s), headers)
    return watcher


async def stall(server: Server, prefix: str, session: str, headers: dict[str, str]) -> None:
    """Open the socket of a page that stops reading."""
    address = f"{server.url.replace('http', 'ws')}{prefix}/api/v1/sessions/{session}/stream?paints=true"
    socket = await open_socket(address, partial(Watcher().session, 0.0), headers)
    socket.transport.pause_reading()


@dataclass(frozen=True, slots=True)
class Class:
    """Measurements of one class."""

    rates: list[float]
    delays: list[float]
    spreads: list[float]
    lecturer: float
    late: list[float]
    megabytes_s: float
    joined_s: float
    load: dict[str, float]


async def follow(
    server: Server, session: str, link: str, count: int, slow: int, seconds: float, settling: float
) -> Class:
    """Let a class follow a playing session, and measure it."""
    prefix = urlsplit(link).path
    lecturer = await watch(server, "", session, {})
    seats = [await asyncio.to_thread(seat, link) for _ in range(count + 2 * slow)]
    began = perf_counter()
    followers = await asyncio.gather(*(watch(server, prefix, session, each) for each in seats[:count]))
    joined = perf_counter() - began
    late = [await watch(server, prefix, session, each, LATE_S) for each in seats[count : count + slow]]
    for each in seats[count + slow :]:
        await stall(server, prefix, session, each)
    await asyncio.sleep(settling)
    read = load_of(server)
    before = [(len(each.arrived), each.carried) for each in (lecturer, *followers, *late)]
    first = max(lecturer.arrived)
    began = perf_counter()
    await asyncio.sleep(seconds)
    passed = perf_counter() - began
    load = read()
    after = [(len(each.arrived), each.carried) for each in (lecturer, *followers, *late)]
    rates = [(now[0] - then[0]) / passed for then, now in zip(before, after, strict=True)]
    carried = sum(now[1] - then[1] for then, now in zip(before, after, strict=True))
    seen = {frame: when for frame, when in lecturer.arrived.items() if frame > first}
    delays = [one.arrived[frame] - when for one in followers for frame, when in seen.items() if frame in one.arrived]
    firsts = {frame: min(one.arrived.get(frame, when) for one in followers) for frame, when in seen.items()}
    spreads = [one.arrived[frame] - when for one in followers for frame, when in firsts.items() if frame in one.arrived]
    return Class(
        rates[1 : count + 1], delays, spreads, rates[0], rates[count + 1 :], carried / passed / 1e6, joined, load
    )


def load_of(server: Server) -> Callable[[], dict[str, float]]:
    """Begin to measure; return a function that gives the processor load of server and class since then, %."""
    web, *others = server.family()
    processes = {"web process": [web], "worker": others, "sockets of the class": [psutil.Process()]}
    before = {name: _cpu_s(them) for name, them in processes.items()}
    began = perf_counter()

    def read() -> dict[str, float]:
        passed = perf_counter() - began
        return {name: 100.0 * (_cpu_s(them) - before[name]) / passed for name, them in processes.items()}

    return read


def _cpu_s(processes: list[psutil.Process]) -> float:
    used = 0.0
    for process in processes:
        # A compiling process may have ended meanwhile.
        with contextlib.suppress(psutil.NoSuchProcess):
            times = process.cpu_times()
            used += times.user + times.system
    return used


def measure(server: Server, count: int, slow: int, seconds: float, settling: float) -> Iterator[dict[str, object]]:
    """Measure one class."""
    name = f"{count} followers" + (f", {2 * slow} slow ones" if slow else "")
    progress(name)
    session = server.start(play=True)
    begun = server.ask("POST", "/api/v1/follows", {"sessions": [session], "most_followers": 1000})
    one = asyncio.run(follow(server, session, begun["links"][0]["address"], count, slow, seconds, settling))
    yield row(f"{name}: frames a second of each", median(one.rates), min(one.rates), RATE_HZ)
    yield row(f"{name}: frames a second of the lecturer", one.lecturer, None, RATE_HZ)
    for whom, delays in (("the lecturer", one.delays), ("the first receiver", one.spreads)):
        milliseconds = [1000.0 * delay for delay in delays]
        yield row(f"{name}: delay behind {whom}, ms", median(milliseconds), percentile(milliseconds, 0.95))
    if one.late:
        yield row(f"{name}: frames a second of one that paints in {LATE_S:g} s", median(one.late), min(one.late))
    yield row(f"{name}: all have come after, s", one.joined_s, None)
    yield row(f"{name}: carried, MB/s", one.megabytes_s, None)
    for what, busy in one.load.items():
        yield row(f"{name}: CPU of the {what}, %", busy, None)
    server.ask("DELETE", f"/api/v1/follows/{begun['id']}")
    server.end(session)


def main() -> None:
    """Measure and report."""
    given = arguments(
        __doc__.splitlines()[0],
        followers=Size(150, 2, "number of followers"),
        slow=Size(5, 1, "number of further followers that paint late, and of those that read nothing"),
        seconds=Size(20.0, 0.3, "duration, s"),
        settling=Size(3.0, 0.3, "time until all have settled, s"),
    )
    with new_server() as server:
        rows = [
            *measure(server, 1, 0, given.seconds, given.settling),
            *measure(server, given.followers, 0, given.seconds, given.settling),
            *measure(server, given.followers, given.slow, given.seconds, given.settling),
        ]
    report("A class that follows one session", rows, as_json=given.json)


if __name__ == "__main__":
    main()
