"""The pictures and films by name: each a function of a server and a browser that writes a file."""

import io
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from tools.pictures.browser import film, open_page
from tools.pictures.server import Server

__all__ = ["FILMS", "PICTURES", "take"]

LOST = {"experiment": "ball", "tracker": "condensation", "seed": 7, "frames": 60}
"""A ball that the bootstrap filter loses behind the occluder, while the auxiliary filter holds it."""
SWEEP = {
    "experiment": "ball",
    "axes": [
        {"name": "occlusion_width_px", "values": [5, 15, 25, 35, 45, 55, 65, 75, 85, 95]},
        {"name": "distracter_radius_px", "values": [1, 4, 7, 10, 13, 16, 19]},
    ],
    "trackers": ["h-spf", "s-spf", "pc-pf"],
    "trials": 10,
    "frames": 60,
}
FLAT = ".flat-canvas"
PHONE = 390, 844


def _painted(page: Any, frame: int) -> None:
    """Wait until the flat view shows a frame."""
    page.locator(f'{FLAT}[data-frame="{frame}"]').first.wait_for(timeout=60_000)
    page.wait_for_timeout(250)


def _start(server: Server, browser: Any) -> Iterator[bytes]:
    with open_page(browser, f"{server.url}/") as page:
        page.locator("[data-experiment=ball] img").wait_for()
        page.wait_for_load_state("networkidle")
        page.wait_for_timeout(1000)
        yield page.screenshot()


def _session(server: Server, browser: Any) -> Iterator[bytes]:
    name = server.session(130, experiment="head", tracker="pf-asd", seed=0, frames=900)
    with open_page(browser, f"{server.url}/session/{name}") as page:
        _painted(page, 130)
        page.get_by_role("button", name="Close this message").wait_for(state="detached", timeout=60_000)
        yield page.screenshot()


def _lost(server: Server, browser: Any) -> Iterator[bytes]:
    name = server.session(**LOST)
    with open_page(browser, f"{server.url}/session/{name}") as page:
        for frame in range(60):
            server.seek(name, frame)
            _painted(page, frame)
            yield page.screenshot()


def _slider(server: Server, browser: Any) -> Iterator[bytes]:
    """Widen the occluder while the run plays."""
    name = server.session(experiment="ball", tracker="h-spf", seed=5, frames=90)
    with open_page(browser, f"{server.url}/session/{name}") as page:
        for frame in range(60):
            if 10 < frame <= 40 and frame % 5 == 0:
                width = 40 + 2 * (frame - 10)
                server.ask(
                    "POST", f"sessions/{name}/commands", {"kind": "change", "values": {"occlusion_width_px": width}}
                )
            server.seek(name, frame)
            _painted(page, frame)
            yield page.screenshot()


def _dark(server: Server, browser: Any) -> Iterator[bytes]:
    name = server.session(40, experiment="ball", tracker="h-spf", seed=5, frames=90)
    with open_page(browser, f"{server.url}/session/{name}", dark=True) as page:
        _painted(page, 40)
        yield page.screenshot()


def _lesson(server: Server, browser: Any) -> Iterator[bytes]:
    with open_page(browser, f"{server.url}/learn/sir") as page:
        page.locator(".lesson-show canvas").first.wait_for()
        page.wait_for_timeout(2000)
        yield page.screenshot()


def _learn(server: Server, browser: Any) -> Iterator[bytes]:
    with open_page(browser, f"{server.url}/learn") as page:
        page.locator("main a").first.wait_for()
        page.wait_for_timeout(1000)
        yield page.screenshot()


def _failure(server: Server, browser: Any) -> Iterator[bytes]:
    with open_page(browser, f"{server.url}/failures/sample-impoverishment") as page:
        page.locator(FLAT).first.wait_for(timeout=60_000)
        page.wait_for_timeout(4000)
        yield page.screenshot()


def _compare(server: Server, browser: Any) -> Iterator[bytes]:
    name = server.session(59, **LOST)
    branch = str(server.ask("GET", f"sessions/{name}")["branch"])
    with open_page(browser, f"{server.url}/compare?runs={name}:{branch},{name}:{branch}:apf&frame=30") as page:
        page.locator(FLAT).first.wait_for(timeout=60_000)
        page.wait_for_timeout(2000)
        _painted(page, 30)
        page.wait_for_timeout(2000)
        yield page.screenshot()


def _sweep(server: Server, browser: Any) -> Iterator[bytes]:
    name = server.ask("POST", "sweeps", SWEEP)["id"]
    with open_page(browser, f"{server.url}/sweep/{name}") as page:
        page.get_by_text("Complete").first.wait_for(timeout=300_000)
        map_of_cells = page.locator("[data-map=h-spf] .figure-plot")
        box = map_of_cells.evaluate("(plot) => ({ ...plot.dataset })")
        left, top, width, height = (float(box[name]) for name in ("left", "top", "width", "height"))
        map_of_cells.click(position={"x": left + 0.55 * width, "y": top + 0.5 * height})
        page.locator("[data-part=runs] a").first.wait_for()
        page.wait_for_timeout(1000)
        yield page.screenshot()


def _class(server: Server, browser: Any) -> Iterator[bytes]:
    name = server.session(30, experiment="ball", tracker="h-spf", seed=5, frames=90)
    with open_page(browser, f"{server.url}/session/{name}") as page:
        _painted(page, 30)
        page.locator(".follow-chip:enabled").click()
        page.get_by_role("button", name="Begin").click()
        page.locator("[data-role=class-link]").wait_for()
        page.wait_for_timeout(500)
        yield page.screenshot()


def _phone(server: Server, browser: Any) -> Iterator[bytes]:
    name = server.session(30, experiment="ball", tracker="h-spf", seed=5, frames=90)
    links = server.ask("POST", "follows", {"sessions": [name]})
    link = next(value for value in _texts(links) if "/f/" in value)
    with open_page(browser, f"{server.url}/f/{link.rpartition('/f/')[2]}", PHONE) as page:
        page.locator(FLAT).first.wait_for(timeout=60_000)
        page.wait_for_timeout(1500)
        yield page.screenshot()


def _views(server: Server, browser: Any, *, experiment: str, frame: int) -> Iterator[bytes]:
    """Show a frame flat, and in 3-D next to it."""
    name = server.session(frame, experiment=experiment, seed=0)
    with open_page(browser, f"{server.url}/session/{name}") as page:
        _painted(page, frame)
        scene = page.get_by_role("region", name="Scene")
        flat = scene.screenshot()
        page.get_by_title("The scene in three dimensions").click()
        page.frame_locator("iframe").locator("canvas[data-engine]").wait_for(timeout=60_000)
        page.wait_for_timeout(5000)
        views = [np.asarray(Image.open(io.BytesIO(it)).convert("RGB")) for it in (flat, scene.screenshot())]
    beside = io.BytesIO()
    Image.fromarray(np.hstack(views)).save(beside, "png")
    yield beside.getvalue()


def _texts(value: Any) -> Iterator[str]:
    if isinstance(value, dict):
        value = list(value.values())
    if isinstance(value, list):
        for each in value:
            yield from _texts(each)
    elif isinstance(value, str):
        yield value


Shot = Callable[[Server, Any], Iterator[bytes]]
VIEWS = {
    "sine": 60,
    "ball": 20,
    "histogram": 20,
    "trajectories": 12,
    "fish": 20,
    "head": 130,
    "prism": 40,
    "structure": 60,
    "linkage": 40,
    "hand": 12,
    "recorded": 20,
}
"""The experiments, and an interesting frame of each."""
PICTURES: dict[str, Shot] = {
    "start": _start,
    "session": _session,
    "dark": _dark,
    "learn": _learn,
    "lesson": _lesson,
    "failure": _failure,
    "compare": _compare,
    "sweep": _sweep,
    "class": _class,
    "phone": _phone,
    **{f"views-{name}": partial(_views, experiment=name, frame=frame) for name, frame in VIEWS.items()},
}
FILMS: dict[str, Shot] = {"lost": _lost, "slider": _slider}
FRAME_RATE_HZ = 10


def take(name: str, server: Server, browser: Any, folder: Path) -> None:
    """Make a picture or a film."""
    if name in FILMS:
        film(FILMS[name](server, browser), folder / f"{name}.mp4", frame_rate_hz=FRAME_RATE_HZ)
    else:
        (content,) = PICTURES[name](server, browser)
        (folder / f"{name}.png").write_bytes(content)
