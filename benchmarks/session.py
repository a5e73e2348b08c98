"""Sessions: time to the first picture, many sessions at once, and the effect of an exploration on a session.

A real server in a process of its own. The time to the first picture is measured in Debian's Chromium, headless with
software rendering, and without a browser up to the server's first picture. Plain websockets, which draw nothing, read
many sessions: each session has a reader of its diagnostics and one of its scene, and must compute and deliver 30 frames
a second; the readers use the same cores. A session that has lost its target plays on, at 30 frames a second and at full
speed, without and with a what-if exploration.
"""

from _table import Size, arguments, progress, report, single_threaded

single_threaded()

import asyncio  # noqa: E402
import contextlib  # noqa: E402
import json  # noqa: E402
import threading  # noqa: E402
import time  # noqa: E402
from collections.abc import Iterator  # noqa: E402
from concurrent.futures import ThreadPoolExecutor  # noqa: E402
from statistics import median  # noqa: E402
from typing import Any  # noqa: E402

from _server import (  # noqa: E402
    CAMERA,
    PROTOCOL,
    SEEN,
    Server,
    chromium,
    echoes,
    new_server,
    row,
    scene_of,
    unpack,
    until,
)
from websockets.asyncio.client import ClientConnection, connect  # noqa: E402
from websockets.typing import Origin  # noqa: E402

RATE_HZ = 30.0
PILLAR_PX, LOST = 100, 20
"""Width of a pillar behind which the ball is lost, and a frame after the loss."""
POLL_S = 0.5

EXPERIMENT = "ball"

# Notes the times, by the page's clock, of the click on a card, of the first visible picture of the run, of viser's
# scene, of the plots, and of all of them. A person sees the element at the middle of the scene's place.
WITNESS = """(() => {
    const now = () => performance.timeOrigin + performance.now();
    addEventListener('click', (event) => {
        sessionStorage.setItem('clicked', performance.timeOrigin + event.timeStamp);
    }, true);
    if (top !== window || !location.pathname.includes('/session/')) return;
    const drawn = (scene) => {
        let found = false;
        scene?.__viserMutable?.nodeRefFromName['/picture']?.traverse((item) => {
            found ||= Boolean(item.isMesh && item.material.map?.image);
        });
        return found;
    };
    const since = Number(sessionStorage.getItem('clicked'));
    const seen = window.__seen = {};
    const look = () => {
        const place = document.querySelector('.scene')?.getBoundingClientRect();
        if (place) {
            const middle = document.elementFromPoint(place.x + place.width / 2, place.y + place.height / 2);
            const still = middle instanceof HTMLImageElement && middle.naturalWidth > 0;
            const scene = middle instanceof HTMLIFrameElement && drawn(middle.contentWindow);
            if (still || scene) seen.picture ??= (now() - since) / 1000;
            if (scene) seen.scene ??= (now() - since) / 1000;
        }
        if (document.querySelector(".plots .figure-view[data-shown]")) seen.plots ??= (now() - since) / 1000;
        if (seen.scene && seen.plots) seen.whole = Math.max(seen.scene, seen.plots);
        else requestAnimationFrame(look);
    };
    look();
})()"""


def visible(server: Server, browser: Any, repeats: int) -> dict[str, list[float]]:
    """Time from the request for a session until the server can show it, and until a browser has its first picture."""
    times: dict[str, list[float]] = {"server": [], "browser": []}
    context = browser.new_context(viewport={"width": 1280, "height": 800}) if browser else None
    for _ in range(repeats + 1):
        begun = time.perf_counter()
        session = server.start(play=False)
        server.ask("GET", f"/api/v1/sessions/{session}/frame.png")
        times["server"].append(time.perf_counter() - begun)
        server.end(session)
        if context is not None:
            page = context.new_page()
            begun = time.perf_counter()
            session = server.start(play=False)
            page.goto(f"{server.url}/session/{session}?view=scene", wait_until="commit")
            until(scene_of(page), SEEN)
            times["browser"].append(time.perf_counter() - begun)
            page.close()
            server.end(session)
    if context is not None:
        context.close()
    return times


def time_clicks(server: Server, browser: Any, repeats: int, reading: float) -> dict[str, list[float]]:
    """Time from the click on an experiment in the gallery to the run's first picture, its plots, its scene, and all."""
    times: dict[str, list[float]] = {"first picture": [], "plots": [], "scene": [], "whole": []}
    context = browser.new_context(viewport={"width": 1280, "height": 800})
    context.add_init_script(WITNESS)
    context.add_init_script("localStorage.setItem('pftrack-view', 'scene')")
    for _ in range(repeats + 1):
        page = context.new_page()
        page.goto(server.url)
        card = page.locator(f"[data-experiment={EXPERIMENT}] h4 a")
        card.wait_for()
        page.wait_for_timeout(1000 * reading)
        card.click(no_wait_after=True)
        page.wait_for_url("**/session/*", wait_until="commit")
        until(page, "() => window.__seen?.whole > 0")
        seen = page.evaluate("() => window.__seen")
        for what, name in (("first picture", "picture"), ("plots", "plots"), ("scene", "scene"), ("whole", "whole")):
            times[what].append(seen[name])
        page.close()
        for session in server.ask("GET", "/api/v1/sessions"):
            server.end(session["id"])
    context.close()
    return times


async def crowd(server: Server, sessions: list[str], seconds: float, settling: float) -> list[tuple[float, float]]:
    """Return (frames computed, pictures delivered) per second of each session."""
    web = server.url.replace("http", "ws")
    counts = {session: [0, 0] for session in sessions}

    async def diagnostics(session: str, stream: ClientConnection) -> None:
        async for text in stream:
            counts[session][0] += len(json.loads(text).get("rows", ()))

    async def pictures(session: str, scene: ClientConnection) -> None:
        await scene.send(CAMERA)
        async for message in scene:
            inner = unpack(message)  # type: ignore[arg-type] # viser speaks binary
            counts[session][1] += b"/picture" in inner
            for answer in echoes(inner):
                await scene.send(answer)

    async with contextlib.AsyncExitStack() as stack:

        async def join(path: str, **options: Any) -> ClientConnection:
            opening = connect(f"{web}{path}", origin=Origin(server.url), max_size=None, open_timeout=60, **options)
            return await stack.enter_async_context(opening)

        readers = []
        for session in sessions:
            stream = await join(f"/api/v1/sessions/{session}/stream")
            scene = await join(f"/viz/{session}", subprotocols=[PROTOCOL], compression=None)
            readers += [
                asyncio.create_task(diagnostics(session, stream)),
                asyncio.create_task(pictures(session, scene)),
            ]
        await asyncio.sleep(settling)
        before = {session: tuple(count) for session, count in counts.items()}
        begun = time.perf_counter()
        await asyncio.sleep(seconds)
        passed = time.perf_counter() - begun
        rates = [
            ((counts[session][0] - before[session][0]) / passed, (counts[session][1] - before[session][1]) / passed)
            for session in sessions
        ]
        for reader in readers:
            reader.cancel()
    return rates


def measure_crowd(server: Server, count: int, seconds: float, settling: float) -> Iterator[dict[str, object]]:
    """Measure many sessions at once."""
    progress(f"{count} sessions")
    sessions = [server.start(play=True) for _ in range(count)]
    family = server.family()
    for process in family:
        process.cpu_percent()
    rates = asyncio.run(crowd(server, sessions, seconds, settling))
    busy = sum(process.cpu_percent() for process in family)
    computed, delivered = ([rate[i] for rate in rates] for i in (0, 1))
    yield row(f"{count} sessions, frames computed a second", median(computed), min(computed), RATE_HZ)
    yield row(f"{count} sessions, pictures delivered a second", median(delivered), min(delivered), RATE_HZ)
    yield row(f"{count} sessions, CPU of the server, %", busy, None)
    for session in sessions:
        server.end(session)


def explore(server: Server, path: str, end: threading.Event) -> int:
    """Repeat a what-if exploration of a session until the end, and return the number of trials."""
    trials = 0
    while not end.is_set():
        told: Any = server.ask("POST", f"{path}/explorations", {"kind": "what-if", "seconds": 60})
        while told["state"] == "working" and not end.wait(POLL_S):
            told = server.ask("GET", f"/api/v1/jobs/{told['id']}")
        trials += sum(each["runs"] for each in (told["result"] or {}).get("findings", ()))
    return trials


def measure_exploration(server: Server, seconds: float, settling: float) -> Iterator[dict[str, object]]:
    """Measure a playing session without and with an exploration."""
    for pace, speed in ((f"{RATE_HZ:g} frames/s", 1), ("full speed", 0)):
        for beside in ("alone", "beside an exploration"):
            progress(f"{pace}, {beside}")
            session = server.start(play=False, occlusion_width_px=PILLAR_PX)
            path = f"/api/v1/sessions/{session}"
            for command in ({"kind": "seek", "frame": LOST}, {"kind": "speed", "speed": speed}, {"kind": "play"}):
                server.ask("POST", f"{path}/commands", command)
            end = threading.Event()
            with ThreadPoolExecutor(1) as threads:
                exploring = None if beside == "alone" else threads.submit(explore, server, path, end)
                [(computed, _)] = asyncio.run(crowd(server, [session], seconds, settling))
                end.set()
            yield row(f"{pace}, {beside}, frames computed a second", computed, None, RATE_HZ if speed else None)
            if exploring is not None:
                yield row(f"{pace}, trials of it a second", exploring.result() / (seconds + settling), None)
            server.end(session)


def measure_start(server: Server, repeats: int, reading: float) -> Iterator[dict[str, object]]:
    """Measure the time until a new session is visible."""
    progress("new sessions")
    with chromium() as browser:
        for where, times in visible(server, browser, repeats).items():
            if times:
                yield row(f"first session, {where}, s", times[0], None)
            if times[1:]:
                yield row(f"new session visible, {where}, s", median(times[1:]), max(times[1:]), 0.5)
        if browser is not None:
            for what, times in time_clicks(server, browser, repeats, reading).items():
                yield row(f"first click to {what}, s", times[0], None)
                goal = 0.5 if what == "first picture" else None
                if times[1:]:
                    yield row(f"click to {what}, s", median(times[1:]), max(times[1:]), goal)


def main() -> None:
    """Measure and report."""
    given = arguments(
        __doc__.splitlines()[0],
        repeats=Size(5, 0, "sessions opened one after the other, after the first one"),
        reading=Size(1.5, 0.1, "time that a person looks at the gallery before choosing, s"),
        sessions=Size(16, 1, "number of concurrent sessions"),
        seconds=Size(15.0, 0.3, "for how long"),
        settling=Size(2.0, 0.3, "how long before they all have come to rest, s"),
    )
    with new_server() as server:
        rows = [
            *measure_start(server, given.repeats, given.reading),
            *measure_crowd(server, given.sessions, given.seconds, given.settling),
            *measure_exploration(server, given.seconds, given.settling),
        ]
    report("Sessions, measured from outside", rows, as_json=given.json)


if __name__ == "__main__":
    main()
