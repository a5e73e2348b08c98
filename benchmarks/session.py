"""Sessions: how soon one is seen, how soon a slider moves the picture, how many run at once, what each one weighs.

A real server in a process of its own. What a person sees is measured in Debian's Chromium, headless with software
rendering: from the browser's own event (its time stamp) to the moment when the texture of the picture plane holds a
frame that shows the change. The crowd is read by plain websockets, which draw nothing: each session has a reader of its
diagnostics and one of its scene, and must compute and deliver 30 frames a second.
"""

from _table import arguments, progress, report, single_threaded

single_threaded()

import asyncio  # noqa: E402
import contextlib  # noqa: E402
import json  # noqa: E402
import shutil  # noqa: E402
import struct  # noqa: E402
import subprocess  # noqa: E402
import sys  # noqa: E402
import tempfile  # noqa: E402
import time  # noqa: E402
import urllib.request  # noqa: E402
from collections.abc import Iterator  # noqa: E402
from statistics import median  # noqa: E402
from typing import Any  # noqa: E402

import psutil  # noqa: E402
from websockets.asyncio.client import ClientConnection, connect  # noqa: E402
from websockets.typing import Origin, Subprotocol  # noqa: E402

RATE_HZ = 30.0
LONG = 18_000
FLAGS = ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--disable-background-networking"]

WATCH = """() => {
    const canvas = document.createElement('canvas');
    const context = canvas.getContext('2d', { willReadFrequently: true });
    let image = null, width = null, began = null;
    window.__latencies = [];
    const picture = () => {
        let found = null;
        window.__viserMutable?.nodeRefFromName['/picture']?.traverse((item) => {
            found = (item.isMesh && item.material.map?.image) || found;
        });
        return found;
    };
    const pillar = (shown) => {
        canvas.width = shown.width;
        canvas.height = 1;
        context.drawImage(shown, 0, -8);
        const { data } = context.getImageData(0, 0, shown.width, 1);
        let dark = 0;
        for (let x = 0; x < shown.width; x += 1) dark += data[4 * x] < 80 ? 1 : 0;
        return dark;
    };
    const start = (event) => { began ??= event.timeStamp; };
    window.__arm = () => { began = null; };
    addEventListener('keydown', start, true);
    addEventListener('pointermove', (event) => { if (event.buttons) start(event); }, true);
    setInterval(() => {
        const shown = picture();
        if (!shown || shown === image) return;
        image = shown;
        const now = pillar(shown);
        if (width !== null && now !== width && began !== null) {
            window.__latencies.push(performance.now() - began);
            began = null;
        }
        width = now;
    }, 1);
}"""
SEEN = """() => {
    let seen = false;
    window.__viserMutable?.nodeRefFromName['/picture']?.traverse((item) => {
        seen ||= Boolean(item.isMesh && item.material.map?.image);
    });
    return seen;
}"""


class Server:
    """A server in a process of its own, and the requests that the benchmarks make."""

    def __init__(self, folder: str) -> None:
        command = [sys.executable, "-m", "pftrack", "serve", "--port", "0", "--data-dir", folder]
        self.process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
        line = self.process.stdout.readline() if self.process.stdout else ""
        if "http://" not in line:
            raise SystemExit("the server did not start")
        self.url = line[line.index("http://") :].strip().rstrip("/")

    def ask(self, method: str, path: str, body: object = None) -> Any:
        """Make a request and return its JSON."""
        data = None if body is None else json.dumps(body).encode()
        headers = {"Content-Type": "application/json", "Origin": self.url}
        request = urllib.request.Request(f"{self.url}{path}", data, headers, method=method)  # noqa: S310 - our own server
        with urllib.request.urlopen(request, timeout=60) as answer:  # noqa: S310
            content = answer.read()
            wanted = content and answer.headers.get_content_type() == "application/json"
            return json.loads(content) if wanted else content

    def start(self, *, play: bool, **fields: object) -> str:
        """Start a long ball session and return its name."""
        session = str(self.ask("POST", "/api/v1/sessions", {"experiment": "ball", "frames": LONG, **fields})["id"])
        if play:
            self.ask("POST", f"/api/v1/sessions/{session}/transport", {"action": "play"})
        return session

    def end(self, session: str) -> None:
        """End a session."""
        self.ask("DELETE", f"/api/v1/sessions/{session}")

    def family(self) -> list[psutil.Process]:
        """Return the web process and all below it."""
        web = psutil.Process(self.process.pid)
        return [web, *web.children(recursive=True)]

    def close(self) -> None:
        """End the server."""
        self.process.terminate()
        self.process.wait(timeout=30)


@contextlib.contextmanager
def chromium() -> Iterator[Any]:
    """Open a browser, or None where there is none."""
    place = shutil.which("chromium")
    try:
        from playwright.sync_api import sync_playwright
    except ImportError:
        place = None
    if place is None:
        progress("no chromium or no playwright: what a browser sees is not measured")
        yield None
        return
    with sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=place, args=FLAGS)
        yield browser
        browser.close()


def until(frame: Any, expression: str, seconds: float = 60.0) -> None:
    """Ask a page again and again; its policy forbids Playwright's own way of waiting."""
    end = time.perf_counter() + seconds
    while not frame.evaluate(expression):
        if time.perf_counter() > end:
            raise TimeoutError(expression)
        time.sleep(0.005)


def scene_of(page: Any) -> Any:
    """Wait for the frame of the scene and return it."""
    while (frame := page.frame(url="**/viz/**")) is None:
        page.wait_for_timeout(5)
    return frame


def visible(server: Server, browser: Any, repeats: int) -> dict[str, list[float]]:
    """Time from asking for a session until the server can show it, and until a browser has its first picture."""
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
            page.goto(f"{server.url}/session/{session}", wait_until="commit")
            until(scene_of(page), SEEN)
            times["browser"].append(time.perf_counter() - begun)
            page.close()
            server.end(session)
    if context is not None:
        context.close()
    return times


def slider(server: Server, browser: Any, repeats: int) -> dict[str, list[float]]:
    """Latencies in ms of the occluder's slider while the run plays, by keyboard and by dragging."""
    session = server.start(play=True, parameters={"distracter_radius_px": 0})
    page = browser.new_page(viewport={"width": 1280, "height": 800})
    page.goto(f"{server.url}/session/{session}")
    scene = scene_of(page)
    until(scene, SEEN)
    page.wait_for_timeout(3_000)
    scene.evaluate(WATCH)
    row = scene.locator(".mantine-Flex-root").filter(has=scene.locator("label:text-matches('Occluder width')")).first
    handle = row.locator("[role=slider]")
    handle.scroll_into_view_if_needed()
    handle.focus()
    found: dict[str, list[float]] = {}
    for index in range(repeats):
        scene.evaluate("() => window.__arm()")
        page.keyboard.press("ArrowRight" if index % 20 < 10 else "ArrowLeft")
        page.wait_for_timeout(250 + 7 * (index % 13))
    found["keyboard"] = scene.evaluate("() => window.__latencies.splice(0)")
    track = row.locator(".mantine-Slider-track").bounding_box()
    middle = track["y"] + track["height"] / 2
    page.mouse.move(track["x"] + 2, middle)
    page.mouse.down()
    for index in range(repeats):
        scene.evaluate("() => window.__arm()")
        page.mouse.move(track["x"] + 10 + (index % 20) * (track["width"] - 20) / 40, middle)
        page.wait_for_timeout(250 + 7 * (index % 13))
    page.mouse.up()
    found["drag"] = scene.evaluate("() => window.__latencies.splice(0)")
    page.close()
    server.end(session)
    return found


async def crowd(server: Server, sessions: list[str], seconds: float) -> list[tuple[float, float]]:
    """Return (frames computed, pictures delivered) a second of each session."""
    import viser
    import zstandard

    web = server.url.replace("http", "ws")
    protocol = Subprotocol(f"viser-v{viser.__version__}")
    counts = {session: [0, 0] for session in sessions}

    async def diagnostics(session: str, stream: ClientConnection) -> None:
        async for text in stream:
            message = json.loads(text)
            counts[session][0] += {"frame": 1, "frames": len(message.get("rows", ()))}.get(message["type"], 0)

    async def pictures(session: str, scene: ClientConnection) -> None:
        async for message in scene:
            plain, packed = struct.unpack_from("<QQ", message)  # type: ignore[arg-type] # viser speaks binary
            inner = zstandard.ZstdDecompressor().decompress(message[16 : 16 + packed], max_output_size=plain)
            counts[session][1] += b"/picture" in inner

    async with contextlib.AsyncExitStack() as stack:

        async def join(path: str, **options: Any) -> ClientConnection:
            opening = connect(f"{web}{path}", origin=Origin(server.url), max_size=None, open_timeout=60, **options)
            return await stack.enter_async_context(opening)

        readers = []
        for session in sessions:
            stream = await join(f"/api/v1/sessions/{session}/stream")
            scene = await join(f"/viz/{session}", subprotocols=[protocol], compression=None)
            readers += [
                asyncio.create_task(diagnostics(session, stream)),
                asyncio.create_task(pictures(session, scene)),
            ]
        await asyncio.sleep(2.0)
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


def memory_mib(processes: list[psutil.Process]) -> float:
    """Memory of processes, shared pages counted once."""
    return sum(process.memory_full_info().pss for process in processes) / 2**20


def percentile(values: list[float], share: float) -> float:
    """Return a percentile."""
    return sorted(values)[min(len(values) - 1, int(share * len(values)))]


def main() -> None:
    """Measure and report."""
    given = arguments(
        __doc__.splitlines()[0],
        sessions={"type": int, "default": 16, "help": "how many run at once"},
        seconds={"type": float, "default": 15.0, "help": "for how long"},
        only={"choices": ["browser", "crowd"], "help": "one half of the benchmark"},
        repeats={"type": int, "default": 60, "help": "moves of the slider"},
    )
    with tempfile.TemporaryDirectory() as folder:
        server = Server(folder)
        try:
            rows: list[dict[str, object]] = []
            if given.only != "crowd":
                rows += seen(server, given.repeats)
            if given.only != "browser":
                rows += crowded(server, given.sessions, given.seconds)
        finally:
            server.close()
    report("Sessions, measured from outside", rows, as_json=given.json)


def row(what: str, typical: float | None, worst: float | None, goal: float | None = None) -> dict[str, object]:
    """Build a row; `of goal` is the worst figure as a share of the goal."""
    judged = typical if worst is None else worst
    share = judged / goal if goal and judged is not None else None
    return {"what": what, "median": typical, "p95 or worst": worst, "goal": goal, "of goal": share}


def seen(server: Server, repeats: int) -> Iterator[dict[str, object]]:
    """Measure what a person sees."""
    with chromium() as browser:
        progress("new sessions")
        for where, times in visible(server, browser, 5).items():
            if times:
                yield row(f"first session, {where}, s", times[0], None)
                yield row(f"new session visible, {where}, s", median(times[1:]), max(times[1:]), 0.5)
        if browser is not None:
            progress("slider to picture")
            for way, latencies in slider(server, browser, repeats).items():
                if latencies:
                    yield row(f"slider to picture, {way}, ms", median(latencies), percentile(latencies, 0.95), 100.0)


def crowded(server: Server, count: int, seconds: float) -> Iterator[dict[str, object]]:
    """Measure many sessions at once."""
    progress(f"{count} sessions")
    alone = memory_mib(server.family())
    sessions = [server.start(play=True) for _ in range(count)]
    family = server.family()
    for process in family:
        process.cpu_percent()
    rates = asyncio.run(crowd(server, sessions, seconds))
    busy = sum(process.cpu_percent() for process in family)
    computed, delivered = ([rate[i] for rate in rates] for i in (0, 1))
    yield row(f"{count} sessions, frames computed a second", median(computed), min(computed), RATE_HZ)
    yield row(f"{count} sessions, pictures delivered a second", median(delivered), min(delivered), RATE_HZ)
    yield row(f"{count} sessions, CPU of the server, %", busy, None)
    yield row("memory of a session, MiB", (memory_mib(server.family()) - alone) / count, None)
    yield row("memory of the server without sessions, MiB", alone, None)
    for session in sessions:
        server.end(session)


if __name__ == "__main__":
    main()
