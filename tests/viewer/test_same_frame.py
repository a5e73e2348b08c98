"""What a browser shows while a run plays: picture and particles of one frame, never of two.

Both carry the number of their frame as a row of dark and light spots, the picture in its upper half and the particles
in its lower, and screenshots are read back. Frames come faster than software rendering can draw, as they do on a busy
machine.
"""

import io
import threading
import time
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from PIL import Image

from pftrack.core.model.drawing import Drawing, Picture, Points
from tests.conftest import FEW_PIXELS
from tests.viewer.conftest import NEEDS_CHROMIUM, until
from tests.viewer.host import Session, Site

pytestmark = NEEDS_CHROMIUM

BITS = 8
PITCH, RADIUS = 38, 12
UPPER, LOWER = 70, 170
RATE_HZ = 30.0
SHOTS = 8

CORNERS = """(() => {
    const { camera, nodeRefFromName } = window.__viserMutable ?? {};
    if (!nodeRefFromName) return null;
    let corners = null;
    nodeRefFromName['/picture']?.traverse((item) => {
        if (!item.isMesh || !item.material.map?.image) return;
        item.geometry.computeBoundingBox();
        const canvas = document.querySelector('canvas[data-engine]').getBoundingClientRect();
        corners = [item.geometry.boundingBox.min, item.geometry.boundingBox.max].map((corner) => {
            const seen = item.localToWorld(corner.clone()).project(camera);
            return [canvas.x + (seen.x + 1) / 2 * canvas.width, canvas.y + (1 - seen.y) / 2 * canvas.height];
        });
    });
    return corners;
})()"""


def coded(frame: int) -> Drawing:
    """Return a drawing that says twice which frame it is."""
    picture = np.full((240, 320, 3), 128, dtype=np.uint8)
    lights = [255 * (frame >> bit & 1) for bit in range(BITS)]
    for bit, light in enumerate(lights):
        picture[UPPER - RADIUS : UPPER + RADIUS, _column(bit) - RADIUS : _column(bit) + RADIUS] = light
    spread = np.random.default_rng(1).uniform(-RADIUS, RADIUS, (100, 2))
    positions = np.zeros((BITS * 100, 3), dtype=np.float32)
    for bit in range(BITS):
        positions[100 * bit : 100 * bit + 100, :2] = np.array([_column(bit), LOWER]) + spread
    colours = np.repeat(np.uint8(lights), 100)[:, None].repeat(3, axis=1)
    return Drawing(320, 240, {"picture": Picture(picture), "particles": Points(positions, colours, 8.0)})


def _column(bit: int) -> int:
    return 27 + PITCH * bit


@pytest.fixture
def playing(session: Session) -> Iterator[None]:
    """Show a frame 30 times a second."""
    ended = threading.Event()

    def play() -> None:
        begun = time.monotonic()
        while not ended.wait(1.0 / RATE_HZ):
            frame = int((time.monotonic() - begun) * RATE_HZ)
            session.show(coded(frame), frame)

    thread = threading.Thread(target=play)
    thread.start()
    yield
    ended.set()
    thread.join()


# A count over many screenshots.
@pytest.mark.slow
def test_picture_and_particles_are_of_one_frame(session: Session, site: Site, chromium: Any, playing: None) -> None:
    """Every screenshot of a playing run shows one frame, and the run goes on from one to the next."""
    page = chromium.new_page(viewport={"width": 930, "height": 560})
    page.add_init_script(FEW_PIXELS)
    page.goto(f"{site.url}/viz/one/")
    until(page, f"{CORNERS} !== null && !!document.querySelector('.pf-caption')", seconds=60.0)
    page.get_by_role("button", name="Front").click()
    page.wait_for_timeout(500)
    corners = page.evaluate(CORNERS)
    seen = [_read(page.screenshot(), corners) for _ in range(SHOTS)]
    page.close()
    apart = [(upper - lower + 128) % 256 - 128 for upper, lower in seen]
    assert apart == [0] * SHOTS
    assert len(set(seen)) > SHOTS / 4


STOPPABLE = """(() => {
    const draw = window.requestAnimationFrame.bind(window);
    window.requestAnimationFrame = (callback) => draw((time) => window.__stopped || callback(time));
})()"""
BRIGHTNESS = """(() => {
    let found = null;
    window.__viserMutable?.nodeRefFromName['/picture']?.traverse((item) => {
        found = (item.isMesh && item.material.map?.image) || found;
    });
    if (!found) return null;
    const context = document.createElement('canvas').getContext('2d');
    context.drawImage(found, 0, 0);
    return context.getImageData(0, 0, 1, 1).data[0];
})()"""


def test_a_frame_is_taken_up_without_waiting_for_the_last_one_to_be_drawn(
    session: Session, site: Site, chromium: Any
) -> None:
    """Drawing takes long without a graphics card: a picture that comes meanwhile is unpacked at once."""

    def show(light: int) -> None:
        picture = np.full((240, 320, 3), light, dtype=np.uint8)
        session.show(Drawing(320, 240, {"picture": Picture(picture)}), light)

    show(50)
    page = chromium.new_page(viewport={"width": 930, "height": 560})
    page.add_init_script(FEW_PIXELS)
    page.add_init_script(STOPPABLE)
    page.goto(f"{site.url}/viz/one/")
    until(page, f"{BRIGHTNESS} === 50", seconds=60.0)
    page.evaluate("window.__stopped = true")
    show(200)
    until(page, f"{BRIGHTNESS} === 200", seconds=60.0)
    page.close()


def _read(png: bytes, corners: list[list[float]]) -> tuple[int, int]:
    shot = np.asarray(Image.open(io.BytesIO(png)).convert("L"), dtype=float)
    (left, right), (top, bottom) = (sorted(pair) for pair in zip(*corners, strict=True))

    def number(y: int) -> int:
        row = round(top + (y + 0.5) / 240 * (bottom - top))
        columns = [round(left + (_column(bit) + 0.5) / 320 * (right - left)) for bit in range(BITS)]
        lights = [float(shot[row - 2 : row + 3, column - 2 : column + 3].mean()) for column in columns]
        return sum(1 << bit for bit, light in enumerate(lights) if light > 128)

    return number(UPPER), number(LOWER)
