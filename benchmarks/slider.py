"""Slider to picture: from the move of a control to the frame that shows it, while the run plays at 30 Hz.

Measured three times in one run. Two are in Debian's Chromium, headless with software rendering, from the event's time
stamp until a frame shows the change: in the 3-D scene in the texture of the picture plane, in the flat view on the
canvas. Most of the scene's figure is drawing without a graphics card, so the time between two frames of the display is
measured in both. The third is by a plain websocket that imitates viser's client and decodes the pictures: the time of
server, worker and wire. Half a frame, 17 ms, is the mean wait for the next frame in all three.
"""

from _table import Size, arguments, progress, report, single_threaded

single_threaded()

import contextlib  # noqa: E402
import time  # noqa: E402
from collections.abc import Iterator  # noqa: E402
from itertools import pairwise  # noqa: E402
from statistics import median  # noqa: E402
from typing import Any  # noqa: E402

import cv2  # noqa: E402
import msgspec  # noqa: E402
import numpy as np  # noqa: E402
from _server import (  # noqa: E402
    CAMERA,
    PROTOCOL,
    SEEN,
    Server,
    chromium,
    echoes,
    new_server,
    percentile,
    row,
    scene_of,
    unpack,
    until,
)
from websockets.sync.client import ClientConnection, connect  # noqa: E402
from websockets.typing import Origin  # noqa: E402

LABEL = "Occluder width"
GOAL_MS = 100.0
RATE_HZ = 30.0

# Notes the time from a move of the slider to a picture in which the occluder has another width.
WATCH = """() => {
    const newest = %s;
    let last = null, width = null, began = null, seen = true;
    window.__latencies = [];
    const start = (event) => { began ??= event.timeStamp + parent.performance.timeOrigin - performance.timeOrigin; };
    window.__arm = () => { began = null; seen = false; };
    window.__seen = () => seen;
    parent.addEventListener('keydown', start, true);
    parent.addEventListener('pointermove', (event) => { if (event.buttons) start(event); }, true);
    setInterval(() => {
        const shown = newest();
        if (!shown || shown.is === last) return;
        last = shown.is;
        const { data } = shown.row();
        let now = 0;
        for (let at = 0; at < data.length; at += 4) now += data[at] < 80 ? 1 : 0;
        if (width !== null && now !== width && began !== null) {
            window.__latencies.push(performance.now() - began);
            began = null;
            seen = true;
        }
        width = now;
    }, 1);
}"""

# The newest picture of the scene: its identity, and a row of its pixels.
SCENE_PICTURE = """(() => {
    const canvas = document.createElement('canvas');
    const context = canvas.getContext('2d', { willReadFrequently: true });
    return () => {
        let found = null;
        window.__viserMutable?.nodeRefFromName['/picture']?.traverse((item) => {
            found = (item.isMesh && item.material.map?.image) || found;
        });
        return found && { is: found, row: () => {
            canvas.width = found.width;
            canvas.height = 1;
            context.drawImage(found, 0, -8);
            return context.getImageData(0, 0, found.width, 1);
        } };
    };
})()"""

FLAT_PICTURE = """(() => {
    const canvas = document.querySelector('.flat-canvas');
    const row = () => canvas.getContext('2d').getImageData(0, Math.round(canvas.height / 30), canvas.width, 1);
    return () => ({ is: canvas.dataset.frame, row });
})()"""

FRAMES = """() => new Promise((resolve) => {
    const times = [];
    const next = () => {
        times.push(performance.now());
        if (times.length > 60) resolve(times); else requestAnimationFrame(next);
    };
    requestAnimationFrame(next);
})"""


def in_page(server: Server, browser: Any, repeats: int, view: str) -> dict[str, list[float]]:
    """Latencies of the slider next to a view while the run plays, ms, by keyboard and by dragging."""
    session = server.start(play=True, distracter_radius_px=0)
    page = browser.new_page(viewport={"width": 1280, "height": 800})
    page.goto(f"{server.url}/session/{session}?view={view}")
    slider = page.locator(f"input[type=range][aria-label^='{LABEL}']")
    slider.wait_for()
    frame = scene_of(page) if view == "scene" else page
    until(frame, SEEN if view == "scene" else "() => document.querySelector('.flat-canvas').dataset.frame > 0")
    page.wait_for_timeout(3_000)
    frame.evaluate(WATCH % (SCENE_PICTURE if view == "scene" else FLAT_PICTURE))
    found = time_moves(page, frame, slider, repeats)
    page.close()
    server.end(session)
    return found


def time_moves(page: Any, frame: Any, slider: Any, repeats: int) -> dict[str, list[float]]:
    """Move a slider by keyboard and by dragging, and return the measured latencies, ms."""
    slider.scroll_into_view_if_needed()
    slider.focus()
    found: dict[str, list[float]] = {}
    for index in range(repeats):
        frame.evaluate("() => window.__arm()")
        page.keyboard.press("ArrowRight" if index % 20 < 10 else "ArrowLeft")
        wait_for_change(frame)
        page.wait_for_timeout(7 * (index % 13))
    found["keyboard"] = frame.evaluate("() => window.__latencies.splice(0)")
    place = slider.bounding_box()
    middle = place["y"] + place["height"] / 2
    page.mouse.move(place["x"] + 2, middle)
    page.mouse.down()
    page.wait_for_timeout(1_000)
    for index in range(repeats):
        frame.evaluate("() => window.__arm()")
        page.mouse.move(place["x"] + 10 + (index % 20) * (place["width"] - 20) / 40, middle)
        wait_for_change(frame)
        page.wait_for_timeout(7 * (index % 13))
    page.mouse.up()
    found["drag"] = frame.evaluate("() => window.__latencies.splice(0)")
    frames = frame.evaluate(FRAMES)
    found["between two frames of the display"] = [after - before for before, after in pairwise(frames)]
    return found


def wait_for_change(scene: Any) -> None:
    """Wait until the last move is visible; a move that never is is left out and reported."""
    with contextlib.suppress(TimeoutError):
        until(scene, "() => window.__seen()", 5.0)


def by_websocket(server: Server, repeats: int) -> list[float]:
    """Latencies in ms of the same slider, without a browser."""
    session = server.start(play=True, distracter_radius_px=0)
    address = f"{server.url.replace('http', 'ws')}/viz/{session}"
    latencies: list[float] = []
    with connect(address, subprotocols=[PROTOCOL], origin=Origin(server.url), max_size=None, compression=None) as scene:
        scene.send(CAMERA)
        uuid, width = "", None
        end = time.perf_counter() + 20
        while not (uuid and width) and time.perf_counter() < end:
            for message in messages(scene):
                label = str((message.get("props") or {}).get("label", ""))
                uuid = message["uuid"] if label.startswith(LABEL) else uuid
                width = pillar(message) or width
        for index in range(repeats):
            wanted = 20.0 + 4.0 * (index % 20)
            update = {"type": "GuiUpdateMessage", "uuid": uuid, "updates": {"value": wanted}}
            begun = time.perf_counter()
            scene.send(msgspec.msgpack.encode(update))
            while time.perf_counter() < begun + 5.0:
                shown = [found for message in messages(scene) if (found := pillar(message)) is not None]
                if any(abs(found - wanted) <= 1 for found in shown):
                    latencies.append(1e3 * (time.perf_counter() - begun))
                    break
            pause = time.perf_counter() + 0.2 + 0.007 * (index % 13)
            while time.perf_counter() < pause:
                messages(scene)
            time.sleep((index % 11) / 11 / RATE_HZ)  # not in step with the frames
    server.end(session)
    return latencies


def messages(scene: ClientConnection) -> list[dict[str, Any]]:
    """Return the scene's next messages, and answer its questions; empty after a while of silence."""
    try:
        inner = unpack(scene.recv(timeout=0.1))  # type: ignore[arg-type] # viser speaks binary
    except TimeoutError:
        return []
    for answer in echoes(inner):
        scene.send(answer)
    return list(msgspec.msgpack.decode(inner)["messages"])


def pillar(message: dict[str, Any]) -> int | None:
    """Return the number of picture columns as dark as the occluder; None if the message has no picture."""
    if message.get("name") != "/picture":
        return None
    data = (message.get("updates") or message.get("props") or {}).get("_data")
    if not isinstance(data, bytes):
        return None
    picture = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_GRAYSCALE)
    return None if picture is None else int((picture[8] < 80).sum())


def measure(server: Server, repeats: int) -> Iterator[dict[str, object]]:
    """Yield the rows of the table."""
    progress("by websocket")
    ways = {"by websocket": by_websocket(server, repeats)}
    with chromium() as browser:
        if browser is not None:
            for where, view in (("in the flat view", "flat"), ("in the scene", "scene")):
                progress(where)
                ways |= {f"{where}, {way}": found for way, found in in_page(server, browser, repeats, view).items()}
    for way, latencies in ways.items():
        if latencies:
            goal = None if "between" in way else GOAL_MS
            seen = f" ({len(latencies)} of {repeats} seen)" if goal else ""
            yield row(f"{way}, ms{seen}", median(latencies), percentile(latencies, 0.95), goal)


def main() -> None:
    """Measure and report."""
    given = arguments(__doc__.splitlines()[0], repeats=Size(60, 2, "moves of the slider"))
    with new_server() as server:
        rows = list(measure(server, given.repeats))
    report("Slider to picture", rows, as_json=given.json)


if __name__ == "__main__":
    main()
