"""The scene in a real browser, inside a frame of a page, as a person uses it.

Software rendering is slow, so the tests wait for content and never measure seconds. All share one page.
"""

import itertools
import re
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import viser

from pftrack.core.model.drawing import Drawing, Mesh, Picture, Points
from pftrack_server.core.panel import PanelValues
from pftrack_server.viewer.client_page import CLIENT
from tests.browser.views import PARTICLES
from tests.conftest import FRUGAL
from tests.viewer.conftest import NEEDS_CHROMIUM, until
from tests.viewer.host import Session, Site, drawing, f32
from tests.waiting import wait_for

pytestmark = NEEDS_CHROMIUM

# How tests look into viser's scene.
EYES = """
window.first = (name, is) => {
    let found = null;
    window.__viserMutable?.nodeRefFromName[name]?.traverse((item) => (found ??= is(item) ? item : null));
    return found;
};
window.plane = () => first('/picture', (item) => item.isMesh && item.material.map?.image);
window.points = () => first('/particles', (item) => item.isPoints);
window.light = () => {
    const pen = (window.pen ??= document.createElement('canvas').getContext('2d', { willReadFrequently: true }));
    if (!plane()) return null;
    pen.drawImage(plane().material.map.image, 0, 0);
    return pen.getImageData(0, 0, 1, 1).data[0];
};
window.seen = (item, place) => item.localToWorld(place.clone()).project(window.__viserMutable.camera);
window.tilt = () => {
    const { camera, nodeRefFromName } = window.__viserMutable;
    const gaze = camera.getWorldDirection(camera.position.clone());
    const root = nodeRefFromName[''] ?? nodeRefFromName['/picture'];
    return Math.abs(gaze.dot(gaze.clone().set(0, 0, 1).transformDirection(root.matrixWorld)));
};
window.view = () => JSON.stringify(window.__viserMutable.camera.matrixWorldInverse.elements);
window.stands = async () => {
    for (let [last, frames] = ['', 0]; frames < 5; last = view()) {
        await new Promise(requestAnimationFrame);
        frames = view() === last ? frames + 1 : 0;
    }
};
window.reach = () => {
    const { geometry } = plane();
    geometry.computeBoundingBox();
    const corners = [geometry.boundingBox.min, geometry.boundingBox.max].map((corner) => seen(plane(), corner));
    return Math.max(...corners.flatMap(({ x, y }) => [Math.abs(x), Math.abs(y)]));
};"""
KEYS = "parent.heard.filter(({ key }) => key !== undefined)"


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
    context = chromium.new_context(viewport={"width": 1280, "height": 800}, color_scheme="dark")
    page = context.new_page()
    page.add_init_script(FRUGAL)
    page.add_init_script(EYES)
    errors: list[str] = []
    page.on("pageerror", lambda error: errors.append(str(error)))
    page.goto(f"{site.url}/")
    page.frame(url="**/viz/one/**").get_by_text("Occluder width (px)").wait_for(timeout=60_000)
    yield page, errors
    context.close()


@pytest.fixture
def session(watched: tuple[Session, Site], opened: tuple[Any, list[str]]) -> Session:
    """Return the session in its first state; the page stays open, since software rendering takes seconds to start."""
    session, _ = watched
    page, _ = opened
    page.wait_for_timeout(200)
    session.reset()
    # The page must process the reset before the test types.
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


def box(scene: Any, label: str) -> Any:
    """Return the box in the row of the panel with this label."""
    found = scene.locator(".mantine-Flex-root").filter(has=scene.locator(f"label:text-is('{label}')")).first
    found.wait_for(state="attached")
    # A box that reaches further than its slider replaces the slider's own box.
    wide = found.locator("xpath=../following-sibling::*[1][.//label[not(node())]]//input[@inputmode]")
    return wide if wide.count() else found.locator(".mantine-NumberInput-input")


def test_picture_and_particles_are_in_the_scene(session: Session, scene: Any, opened: tuple[Any, list[str]]) -> None:
    """The policy blocks nothing; the panel is dark like the system, without viser's settings, share button and logo."""
    until(scene, f"plane()?.material.map.image.width === 320 && {PARTICLES} === 800")
    session.show(drawing(1, 123), 1)
    until(scene, f"{PARTICLES} === 123")
    assert scene.evaluate("!window.__viserMutable.scene.environment"), "software takes seconds to filter one"
    assert scene.evaluate("document.documentElement.dataset.mantineColorScheme") == "dark"
    assert scene.locator(".tabler-icon-adjustments:visible, .tabler-icon-share:visible").count() == 0
    assert scene.locator("[title='About Viser']").count() == 0
    assert scene.get_by_text("Software WebGL").locator("visible=true").count() == 0
    assert opened[1] == []


def test_presets_move_the_camera(scene: Any) -> None:
    """From the front the picture fills most of the canvas and all of it is visible; from aside there is depth."""
    scene.get_by_role("button", name="Front").click()
    until(scene, "tilt() > 0.999 && reach() > 0.9 && reach() <= 1.0")
    scene.get_by_role("button", name="Side").click()
    until(scene, "tilt() < 0.9")


def test_a_typed_number_counts_when_it_is_finished(session: Session, page: Any, scene: Any) -> None:
    """Neither its first digits nor another value that comes meanwhile interfere with it.

    A value that comes between the click and the first digit does not leave its own digits in front.
    """
    field = box(scene, "Particles")
    field.click()
    field.press("Control+a")
    field.press_sequentially("25", delay=30)
    assert session.changes == []
    session.tell(PanelValues({"sample_count": 321, "occlusion_width_px": 77.0}, "h-spf", 7))
    _await(page, lambda: box(scene, "Occluder width (px)").input_value() == "77")
    field.press_sequentially("0", delay=30)
    assert field.input_value() == "250"
    field.press("Enter")
    wait_for(lambda: session.changes == [{"sample_count": 250}])
    page.locator("body > input").click()
    field.focus()
    field.evaluate("(element) => element.select()")
    session.tell(PanelValues({"sample_count": 321}, "h-spf", 7))
    _await(page, lambda: field.input_value() == "321")
    page.keyboard.type("55")
    page.keyboard.press("Tab")
    wait_for(lambda: session.changes == [{"sample_count": 250}, {"sample_count": 55}])


def test_keys_go_to_the_page(page: Any, scene: Any) -> None:
    """They steer the run from the scene and from a button; keys typed into a box and keys of the scene do not."""
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
    box(scene, "Particles").click()
    for key in ("1", "Home", "Escape"):
        page.keyboard.press(key)
    page.wait_for_timeout(200)
    assert len(scene.evaluate(KEYS)) == len(heard) + 1


def test_a_frame_without_focus_reconnects_and_its_folds_stay(session: Session, page: Any, scene: Any) -> None:
    """After a lost connection the scene returns with the present drawing; folded controls stay folded."""
    width, trail = scene.get_by_text("Occluder width (px)"), scene.get_by_text("Trail", exact=True)
    headings = scene.get_by_text("Scene", exact=True), scene.get_by_text("What to draw", exact=True)
    for heading in headings:
        heading.click()
    page.locator("body > input").click()
    before = set(session.viewer._server.get_clients())
    session.disconnect()
    # It may be back before anybody sees that it was away.
    _await(page, lambda: session.viewer.clients == 1 and not before & set(session.viewer._server.get_clients()))
    session.show(drawing(6, 55), 6)
    until(scene, f"{PARTICLES} === 55")
    trail.wait_for()
    width.wait_for(state="hidden")
    for heading in headings:
        heading.click()
    width.wait_for()


def _await(page: Any, condition: Callable[[], bool]) -> None:
    wait_for(condition, pause=lambda rest: page.wait_for_timeout(1000 * rest))


def test_a_mesh_has_the_colours_of_its_vertices(session: Session, scene: Any, opened: tuple[Any, list[str]]) -> None:
    """In linear light, with opacity, blended only where it is translucent; later colours replace them."""
    corners = f32((60, 60, 2), (200, 60, 2), (60, 180, 2))
    faces = np.array(((0, 1, 2),), dtype=np.int32)
    colours = np.array(((255, 0, 0), (0, 255, 0), (0, 0, 255)), dtype=np.uint8)
    attributes = """(() => {
        const mesh = first('/mesh', (item) => item.isMesh && item.geometry.attributes.color);
        if (!mesh?.material.vertexColors) return '';
        const { color } = mesh.geometry.attributes;
        const values = [color.itemSize, color.getX(0), color.getY(1), color.getZ(2), color.getW(2)];
        return JSON.stringify([...values, mesh.material.transparent]);
    })()"""
    shown = drawing(3)
    for opacity in (1.0, 0.5):
        mesh = Mesh(corners, faces, colours, np.full(3, opacity, dtype=np.float32), "estimate")
        session.show(replace(shown, primitives={**shown.primitives, "mesh": mesh}), 3)
        blended = str(opacity < 1.0).lower()
        until(scene, f"{attributes}.replace(/0\\.501\\d+/, '0.5') === '[4,1,1,1,{opacity:g},{blended}]'")
    assert opened[1] == []


def test_a_click_reports_its_place_in_the_picture(session: Session, page: Any, scene: Any) -> None:
    """A place in pixels, with the particle that was hit; turning the scene reports nothing."""
    positions = drawing().primitives["particles"].positions  # type: ignore[union-attr] - they are points
    lone, place = int(np.square(positions[:, :2] - positions[:, :2].mean(axis=0)).sum(axis=1).argmax()), (40.0, 200.0)
    frame = page.query_selector("iframe").bounding_box()
    pixel = """async (place) => {
        const canvas = (await stands(), document.querySelector('canvas[data-engine]')).getBoundingClientRect();
        const { x, y } = seen(points(), window.__viserMutable.camera.position.clone().set(...place));
        return [canvas.x + (x + 1) / 2 * canvas.width, canvas.y + (1 - y) / 2 * canvas.height];
    }"""

    def click(place: list[float]) -> dict[str, Any]:
        across, down = scene.evaluate(pixel, place)
        page.mouse.click(frame["x"] + across, frame["y"] + down)
        until(scene, "parent.heard.some(({ pointed }) => pointed === 'press')")
        return page.evaluate("heard.find(({ pointed }) => pointed === 'press')")

    there = click([place[0], -place[1], 0.0])
    assert there["place"] == pytest.approx(place, abs=1.0)
    assert there["particle"] is None
    assert page.evaluate("heard[0].pointed") == "hover"
    page.evaluate("heard.length = 0")
    before = scene.evaluate("view()")
    page.mouse.move(frame["x"] + 200, frame["y"] + 200)
    page.mouse.down()
    for step in range(1, 30):
        page.mouse.move(frame["x"] + 200 + 10 * step, frame["y"] + 200 + 4 * step)
        page.wait_for_timeout(50)
        if scene.evaluate("view()") != before:
            break
    page.mouse.up()
    hit = click(scene.evaluate(f"[...points().geometry.attributes.position.array.slice({3 * lone}, {3 * lone + 3})]"))
    assert hit["particle"] == pytest.approx(positions[lone, :2].tolist(), abs=1e-3)
    assert page.evaluate("heard.filter(({ pointed }) => pointed === 'press').length") == 1


def coded(light: int) -> Drawing:
    """Return a drawing whose picture has this light, and whose cloud has as many particles."""
    positions = np.zeros((light, 3), dtype=np.float32)
    points = Points(positions, np.zeros((light, 3), dtype=np.uint8), 2.0)
    return Drawing(320, 240, {"picture": Picture(np.full((240, 320, 3), light, dtype=np.uint8)), "particles": points})


def test_picture_and_particles_belong_to_one_frame(session: Session, page: Any, scene: Any) -> None:
    """Frames come faster than software rendering draws; every rendered one has picture and particles of one frame."""
    lights = itertools.cycle(range(20, 241, 20))
    session.show(coded(next(lights)), 1)
    until(scene, f"light() === 20 && {PARTICLES} === 20")
    scene.evaluate(f"""(() => {{
        const {{ scene }} = window.__viserMutable;
        const dress = scene.onBeforeRender, now = performance.now.bind(performance);
        performance.now = () => 0.05 * now();  // on a loaded machine, too, frames.js waits for pictures
        window.rendered = [];
        window.stopWatching = () => {{
            scene.onBeforeRender = dress;
            performance.now = now;
        }};
        scene.onBeforeRender = function (...given) {{
            rendered.push([light(), {PARTICLES}]);
            return dress.apply(this, given);
        }};
    }})()""")
    for light in itertools.islice(lights, 300):
        session.show(coded(light), light)
        page.wait_for_timeout(20)
        if scene.evaluate("rendered.length") > 8:
            break
    until(scene, "rendered.length > 4")
    pairs = scene.evaluate("stopWatching(), rendered")
    assert [pair for pair in pairs if pair[0] != pair[1]] == []
    assert len({light for light, _ in pairs}) > 2


def test_a_picture_is_decoded_while_the_last_frame_is_drawn(session: Session, scene: Any) -> None:
    """Drawing takes long without a graphics card, so a picture that comes meanwhile is not kept waiting."""
    scene.evaluate("""(() => {
        const draw = window.requestAnimationFrame, held = [];
        window.requestAnimationFrame = (callback) => held.push(callback);
        window.letDraw = () => {
            window.requestAnimationFrame = draw;
            for (const callback of held) draw(callback);
        };
    })()""")
    session.show(coded(60), 2)
    until(scene, "light() === 60")
    scene.evaluate("letDraw()")


# What the adapter's scripts and style sheet look for in viser's client.

WRITTEN = "".join(file.read_text() for file in CLIENT.iterdir())
SELECTORS = {
    *re.findall(r"\.mantine-\w+-\w+|\.tabler-icon-[\w-]+|\[data-dock-header\]", WRITTEN),
    "canvas[data-engine]",
}
MEMBERS = dict.fromkeys(("nodeRefFromName", "camera", "scene", "messageQueue"), "object")
MEMBERS |= dict.fromkeys(("drainMessageQueue", "requestRender"), "function")


def test_the_client_has_what_the_scripts_and_the_style_sheet_look_for(scene: Any) -> None:
    """Otherwise frames would be drawn late, without colours or never, and the panel would look like viser's."""
    for member, kind in MEMBERS.items():
        found = scene.evaluate(f"typeof window.__viserMutable.{member}")
        assert found == kind, f"in viser {viser.__version__} __viserMutable.{member} is {found}, expected {kind}"
    found = scene.evaluate("[plane().material.type, points().geometry.attributes.color.array.constructor.name]")
    shown = f"viser {viser.__version__} shows picture and points by {found}"
    assert found == ["MeshBasicMaterial", "Uint8Array"], shown
    missing = [each for each in SELECTORS if not scene.evaluate(f"document.querySelectorAll({each!r}).length")]
    assert not missing, f"the client of viser {viser.__version__} has no element {missing}; see viewer/client"


def test_the_scene_reports_whether_it_is_drawn(scene: Any) -> None:
    """A picture is in place when the camera is at its preset; viser's own nodes alone do not count."""
    scene.get_by_role("button", name="Front").click()
    until(scene, "pftrackScene.drawn() === 'in place'")
    found = scene.evaluate("""(() => {
        const nodes = window.__viserMutable.nodeRefFromName;
        const kept = Object.entries(nodes).filter(([name]) => name !== "" && name !== "/WorldAxes");
        for (const [name] of kept) delete nodes[name];
        const found = pftrackScene.drawn();
        Object.assign(nodes, Object.fromEntries(kept));
        return found;
    })()""")
    assert found is None
