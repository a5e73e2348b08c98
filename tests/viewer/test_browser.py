"""The scene in a real browser, inside a frame of a page, as a person uses it.

Software rendering is slow, so content is awaited and never counted by the second.
"""

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from pftrack.core.model.drawing import Mesh
from pftrack_server.core.panel import PanelValues
from tests.browser.views import PARTICLES
from tests.conftest import FRUGAL
from tests.viewer.conftest import NEEDS_CHROMIUM, until
from tests.viewer.host import Session, Site, drawing, f32
from tests.waiting import wait_for

pytestmark = NEEDS_CHROMIUM


@pytest.fixture(scope="module")
def watched() -> Iterator[tuple[Session, Site]]:
    session = Session()
    site = Site(session)
    yield session, site
    site.close()
    session.close()


@pytest.fixture(scope="module")
def opened(chromium: Any, watched: tuple[Session, Site]) -> Iterator[tuple[Any, list[str]]]:
    session, site = watched
    session.show(drawing(), 0)
    context = chromium.new_context(viewport={"width": 1280, "height": 800})
    page = context.new_page()
    page.add_init_script(FRUGAL)
    errors: list[str] = []
    page.on("pageerror", lambda error: errors.append(str(error)))
    page.goto(f"{site.url}/")
    page.frame(url="**/viz/one/**").get_by_text("Occluder width (px)").wait_for(timeout=60_000)
    yield page, errors
    context.close()


@pytest.fixture
def session(watched: tuple[Session, Site], opened: tuple[Any, list[str]]) -> Session:
    """Return the session as it was at first; the page stays open, since software rendering takes seconds to start."""
    session, _ = watched
    page, _ = opened
    page.wait_for_timeout(200)
    session.reset()
    # What the reset has sent must not overtake what the test is going to type: it is taken up before another drawing.
    for count in (799, 800):
        session.show(drawing(0, count), 0)
        until(page.frame(url="**/viz/one/**"), f"{PARTICLES} === {count}")
    page.evaluate("heard.length = 0")
    session.changes.clear()
    return session


@pytest.fixture
def page(session: Session, opened: tuple[Any, list[str]]) -> Any:
    return opened[0]


@pytest.fixture
def scene(page: Any) -> Any:
    return page.frame(url="**/viz/one/**")


KEYS = "parent.heard.filter(({ key }) => key !== undefined)"
PICTURE = """(() => {
    let size = null;
    window.__viserMutable.nodeRefFromName['/picture']?.traverse((item) => {
        const image = item.isMesh && item.material.map?.image;
        if (image) size = `${image.width}x${image.height}`;
    });
    return size;
})()"""


# Where a particle and a place of the picture are seen, CSS pixels of the frame's window.
SEEN = """(place) => {
    const { camera, nodeRefFromName } = window.__viserMutable;
    const canvas = document.querySelector('canvas[data-engine]').getBoundingClientRect();
    let seen = null;
    nodeRefFromName['/particles'].traverse((item) => {
        if (item.isPoints) seen = item.localToWorld(camera.position.clone().set(...place)).project(camera);
    });
    return [canvas.x + (seen.x + 1) / 2 * canvas.width, canvas.y + (1 - seen.y) / 2 * canvas.height];
}"""


POSITION = """(n) => {
    let place = null;
    window.__viserMutable.nodeRefFromName['/particles'].traverse((item) => {
        if (item.isPoints) place = Array.from(item.geometry.attributes.position.array.slice(3 * n, 3 * n + 3));
    });
    return place;
}"""


def box(scene: Any, label: str) -> Any:
    """Return the box in the row of the panel with this label."""
    found = scene.locator(".mantine-Flex-root").filter(has=scene.locator(f"label:text-is('{label}')")).first
    found.wait_for(state="attached")
    # A box that reaches further than its slider stands in the place of that one's own.
    wide = found.locator("xpath=../following-sibling::*[1][.//label[not(node())]]//input[@inputmode]")
    return wide if wide.count() else found.locator(".mantine-NumberInput-input")


def test_picture_and_particles_are_in_the_scene(session: Session, scene: Any, opened: tuple[Any, list[str]]) -> None:
    """What was shown arrives, a change of the number of particles as well, and the policy hinders nothing."""
    until(scene, f"{PICTURE} === '320x240' && {PARTICLES} === 800")
    session.show(drawing(1, 123), 1)
    until(scene, f"{PARTICLES} === 123")
    assert opened[1] == []


def test_presets_move_the_camera(scene: Any) -> None:
    """From the front all corners of the picture are on the canvas, and it fills most of one direction.

    One click shows the cloud and the trail from aside.
    """
    reach = """(() => {
        const { camera, nodeRefFromName } = window.__viserMutable;
        let reach = 0;
        nodeRefFromName['/picture']?.traverse((item) => {
            if (!item.isMesh) return;
            item.geometry.computeBoundingBox();
            for (const corner of [item.geometry.boundingBox.min, item.geometry.boundingBox.max]) {
                const seen = item.localToWorld(corner.clone()).project(camera);
                reach = Math.max(reach, Math.abs(seen.x), Math.abs(seen.y));
            }
        });
        return reach;
    })()"""
    tilt = """(() => {
        const { camera, nodeRefFromName } = window.__viserMutable;
        const gaze = camera.getWorldDirection(camera.position.clone());
        const root = nodeRefFromName[''] ?? nodeRefFromName['/picture'];
        return Math.abs(gaze.dot(gaze.clone().set(0, 0, 1).transformDirection(root.matrixWorld)));
    })()"""
    for name in ("Side", "Oblique"):
        scene.get_by_role("button", name="Front").click()
        until(scene, f"{tilt} > 0.999 && {reach} > 0.9 && {reach} <= 1.0")
        scene.get_by_role("button", name=name).click()
        until(scene, f"{tilt} < 0.9")


def retype(scene: Any, digits: str, delay: int) -> Any:
    """Type other digits into the box of the number of particles, and return the box."""
    field = box(scene, "Particles")
    field.click()
    field.press("Control+a")
    field.press_sequentially(digits, delay=delay)
    return field


def test_a_typed_number_counts_when_it_is_finished(session: Session, page: Any, scene: Any) -> None:
    """On the way from 800 to 250 nobody runs with 2 particles."""
    field = retype(scene, "250", 120)
    assert session.changes == []
    field.press("Enter")
    wait_for(lambda: session.changes == [{"sample_count": 250}])
    retype(scene, "90", 60).press("Tab")
    wait_for(lambda: session.values["sample_count"] == 90)
    assert field.input_value() == "90"


def test_what_is_being_typed_is_not_written_over(session: Session, page: Any, scene: Any) -> None:
    """Another value comes into force in the middle of typing, and the number that was being typed still counts.

    An answer that comes between the click and the first digit does not leave its own digits before it.
    """
    field = retype(scene, "25", 30)
    session.tell(PanelValues({"sample_count": 321, "occlusion_width_px": 77.0}, "h-spf", 7))
    wait_for_value(page, box(scene, "Occluder width (px)"), "77")
    field.press_sequentially("0", delay=30)
    assert field.input_value() == "250"
    field.press("Enter")
    wait_for(lambda: session.changes == [{"sample_count": 250}])
    page.locator("body > input").click()
    field.focus()
    field.evaluate("(element) => element.select()")
    session.tell(PanelValues({"sample_count": 321}, "h-spf", 7))
    wait_for_value(page, field, "321")
    page.keyboard.type("55")
    page.keyboard.press("Enter")
    wait_for(lambda: session.changes == [{"sample_count": 250}, {"sample_count": 55}])


def test_keys_are_handed_to_the_page(page: Any, scene: Any) -> None:
    """With the scene in focus, and after a click on a button, keys steer the run; one of the scene stays there."""
    scene.locator("canvas[data-engine]").click(position={"x": 200, "y": 200})
    pressed = ("Space", "Shift+ArrowRight", "b", "w", "Shift+E", "3", "Escape", "a", "Control+l", "?")
    for key in pressed:
        page.keyboard.press(key)
    until(scene, f"{KEYS}.some(({{ key }}) => key === '?')")
    heard = [(each["key"], each["shiftKey"]) for each in scene.evaluate(KEYS)]
    plain = [("b", False), ("w", False), ("E", True), ("3", False), ("Escape", False)]
    assert heard[:-1] == [(" ", False), ("ArrowRight", True), *plain]
    assert {each["source"] for each in scene.evaluate(KEYS)} == {"pftrack-viser"}
    scene.get_by_role("button", name="Front").click()
    page.keyboard.press("Space")
    until(scene, f"{KEYS}.length === {len(heard) + 1}")


def test_keys_in_a_box_stay_in_the_box(page: Any, scene: Any) -> None:
    """Who types a number does not play the run."""
    box(scene, "Particles").click()
    for key in ("1", "Home", "Escape"):
        page.keyboard.press(key)
    page.wait_for_timeout(200)
    assert page.evaluate("heard") == []


def test_a_frame_without_focus_reconnects_and_its_folds_stay(session: Session, page: Any, scene: Any) -> None:
    """After a lost connection the scene comes back by itself, with what is shown now.

    No control is taken away from those who use it, and none is brought back.
    """

    def disconnect(count: int) -> None:
        page.locator("body > input").click()
        before = set(session.viewer._server.get_clients())
        session.disconnect()
        # It may be back before anybody sees that it was away.
        _await(page, lambda: session.viewer.clients == 1 and not before & set(session.viewer._server.get_clients()))
        session.show(drawing(6, count), 6)
        until(scene, f"{PARTICLES} === {count}")

    width, trail = scene.get_by_text("Occluder width (px)"), scene.get_by_text("Trail", exact=True)
    headings = scene.get_by_text("Scene", exact=True), scene.get_by_text("What to draw", exact=True)
    for shown, hidden, count in ((trail, width, 55), (width, trail, 66)):
        for heading in headings:
            heading.click()
        disconnect(count)
        shown.wait_for()
        hidden.wait_for(state="hidden")


def test_light_and_dark_follow_the_system(chromium: Any, watched: tuple[Session, Site]) -> None:
    """The panel is dark for those who ask for it."""
    context = chromium.new_context(color_scheme="dark")
    context.add_init_script(FRUGAL)
    page = context.new_page()
    page.goto(f"{watched[1].url}/viz/one/?websocket=ws://192.0.2.1/")
    page.get_by_text("Occluder width (px)").wait_for(timeout=60_000)
    assert page.evaluate("document.documentElement.dataset.mantineColorScheme") == "dark"
    context.close()


def test_the_workshop_is_hidden(scene: Any) -> None:
    """Neither viser's settings, its share button nor its logo distract."""
    assert scene.locator(".tabler-icon-adjustments:visible, .tabler-icon-share:visible").count() == 0
    assert scene.locator("[title='About Viser']").count() == 0
    assert scene.get_by_text("Software WebGL").locator("visible=true").count() == 0


def wait_for_value(page: Any, field: Any, value: str) -> None:
    _await(page, lambda: field.input_value() == value)


def _await(page: Any, condition: Callable[[], bool]) -> None:
    wait_for(condition, pause=lambda rest: page.wait_for_timeout(1000 * rest))


def test_a_mesh_has_the_colours_of_its_vertices(session: Session, scene: Any, opened: tuple[Any, list[str]]) -> None:
    """In proportion to light, with opacity, and blended where something is seen through it; and new ones after them."""
    corners = f32((60, 60, 2), (200, 60, 2), (60, 180, 2))
    faces = np.array(((0, 1, 2),), dtype=np.int32)
    colours = np.array(((255, 0, 0), (0, 255, 0), (0, 0, 255)), dtype=np.uint8)
    attributes = """(() => {
        let found = null;
        window.__viserMutable.nodeRefFromName['/mesh']?.traverse((item) => {
            if (!item.isMesh || !item.geometry.attributes.color) return;
            const { color } = item.geometry.attributes;
            const { transparent, vertexColors } = item.material;
            if (!vertexColors) return;
            found = [color.itemSize, color.getX(0), color.getY(1), color.getZ(2), color.getW(2), transparent];
        });
        return JSON.stringify(found);
    })()"""
    shown = drawing(3)
    for opacity in (1.0, 0.5):
        mesh = Mesh(corners, faces, colours, np.full(3, opacity, dtype=np.float32), "estimate")
        session.show(replace(shown, primitives={**shown.primitives, "mesh": mesh}), 3)
        blended = str(opacity < 1.0).lower()
        until(scene, f"{attributes}.replace(/0\\.501\\d+/, '0.5') === '[4,1,1,1,{opacity:g},{blended}]'")
    assert opened[1] == []


def test_a_click_tells_the_page_where_in_the_picture_it_is(session: Session, page: Any, scene: Any) -> None:
    """A place in pixels, with the particle that was hit; turning the scene tells nothing."""
    positions = drawing().primitives["particles"].positions  # type: ignore[union-attr] - they are points
    lone, place = int(np.square(positions[:, :2] - positions[:, :2].mean(axis=0)).sum(axis=1).argmax()), (40.0, 200.0)
    frame = page.query_selector("iframe").bounding_box()

    def click(seen: list[float]) -> dict[str, Any]:
        page.evaluate("heard.length = 0")
        page.mouse.click(frame["x"] + seen[0], frame["y"] + seen[1])
        until(scene, "parent.heard.some(({ pointed }) => pointed === 'press')")
        return page.evaluate("heard.find(({ pointed }) => pointed === 'press')")

    there = click(scene.evaluate(SEEN, [place[0], -place[1], 0.0]))
    assert there["place"] == pytest.approx(place, abs=1.0)
    assert there["particle"] is None
    assert page.evaluate("heard[0].pointed") == "hover"
    hit = click(scene.evaluate(SEEN, list(scene.evaluate(POSITION, lone))))
    assert hit["particle"] == pytest.approx(positions[lone, :2].tolist(), abs=1e-3)
    page.evaluate("heard.length = 0")
    page.mouse.move(frame["x"] + 200, frame["y"] + 200)
    page.mouse.down()
    page.mouse.move(frame["x"] + 260, frame["y"] + 220)
    page.mouse.up()
    hit = click(scene.evaluate(SEEN, list(scene.evaluate(POSITION, lone))))
    assert hit["particle"] == pytest.approx(positions[lone, :2].tolist(), abs=1e-3)
    assert page.evaluate("heard.filter(({ pointed }) => pointed === 'press').length") == 1
