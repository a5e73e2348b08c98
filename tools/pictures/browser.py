"""Chromium with a page of a fixed size, and films of it."""

import io
import shutil
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import av
import numpy as np
from PIL import Image
from playwright.sync_api import sync_playwright

__all__ = ["animate", "chromium", "film", "find_chromium", "open_page"]

FLAGS = [
    "--headless",
    "--no-sandbox",
    "--disable-background-networking",
    "--enable-unsafe-swiftshader",
    "--hide-scrollbars",
]
SIZE = 1280, 800
POSTER = 30
"""The frame that is a film's poster until it is played."""


def find_chromium() -> str | None:
    """Return the path of Chromium, or None."""
    names = ("chromium-headless-shell", "chromium", "chromium-browser", "google-chrome")
    return next((found for name in names if (found := shutil.which(name))), None)


@contextmanager
def chromium() -> Iterator[Any]:
    """Open a browser.

    Raises:
        RuntimeError: No browser is installed.
    """
    place = find_chromium()
    if place is None:
        raise RuntimeError("no Chromium was found; on Debian install chromium-headless-shell")
    with sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=place, args=FLAGS)
        yield browser
        browser.close()


@contextmanager
def open_page(browser: Any, address: str, size: tuple[int, int] = SIZE, *, dark: bool = False) -> Iterator[Any]:
    """Open a page in a new window whose visitor has seen the tour."""
    scheme = "dark" if dark else "light"
    context = browser.new_context(
        viewport={"width": size[0], "height": size[1]}, color_scheme=scheme, reduced_motion="reduce", locale="en-GB"
    )
    context.add_init_script("try { localStorage.setItem('pftrack-tour', 'done') } catch {}")
    context.set_default_timeout(180_000)  # software rendering of a scene takes its time on a loaded machine
    page = context.new_page()
    page.goto(address)
    yield page
    context.close()


def film(pictures: Iterable[bytes], path: Path, *, frame_rate_hz: int) -> None:
    """Write pictures, each a file, as a film that browsers play (H.264)."""
    with av.open(str(path), "w", options={"movflags": "+faststart"}) as container:
        stream = container.add_stream("libx264", rate=frame_rate_hz)
        stream.pix_fmt = "yuv420p"
        stream.options = {"crf": "26", "preset": "slow"}
        for at, content in enumerate(pictures):
            image_rgb = np.asarray(Image.open(io.BytesIO(content)).convert("RGB"))
            if at == 0:
                stream.height, stream.width = (2 * (side // 2) for side in image_rgb.shape[:2])
            if at == POSTER:
                Image.open(io.BytesIO(content)).convert("RGB").save(path.with_suffix(".png"), optimize=True)
            image_rgb = np.ascontiguousarray(image_rgb[: stream.height, : stream.width])
            container.mux(stream.encode(av.VideoFrame.from_ndarray(image_rgb, format="rgb24")))
        container.mux(stream.encode())


def animate(source: Path, path: Path) -> None:
    """Write a film as an animated WebP, which also plays where a page may only show pictures."""
    with av.open(str(source)) as container:
        duration_ms = round(1000 / float(container.streams.video[0].average_rate or 1))
        first, *rest = (frame.to_image() for frame in container.decode(video=0))
    first.save(path, save_all=True, append_images=rest, duration=duration_ms, loop=0, quality=70, method=6)
