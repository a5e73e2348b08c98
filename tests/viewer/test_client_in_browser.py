"""What the scripts and the style sheet of the adapter look for in viser's client is there, in a real browser."""

import re
from collections.abc import Iterator
from typing import Any

import pytest
import viser

from pftrack_server.viewer.client_page import CLIENT
from tests.viewer.conftest import NEEDS_CHROMIUM, until
from tests.viewer.host import Session, Site, drawing

pytestmark = NEEDS_CHROMIUM

SELECTORS = sorted(
    {
        selector
        for file in CLIENT.iterdir()
        for selector in re.findall(r"\.mantine-\w+-\w+|\.tabler-icon-[\w-]+|\[data-dock-header\]", file.read_text())
    }
    | {"canvas[data-engine]"}
)
MEMBERS = dict.fromkeys(("nodeRefFromName", "camera", "scene", "messageQueue"), "object") | dict.fromkeys(
    ("drainMessageQueue", "requestRender"), "function"
)


@pytest.fixture(scope="module")
def scene(chromium: Any) -> Iterator[Any]:
    session = Session()
    site = Site(session)
    session.show(drawing(), 0)
    context = chromium.new_context(viewport={"width": 1280, "height": 800})
    page = context.new_page()
    page.goto(f"{site.url}/viz/one/")
    until(page, "window.pftrackScene.drawn() === 'in place'", 60)
    yield page
    context.close()
    site.close()
    session.close()


def test_what_the_scripts_read_of_the_scene_is_there(scene: Any) -> None:
    """Without it frames would be drawn late, without colours, or never be known as drawn.

    `colours.js` takes the colours of vertices from the bytes of points. A picture is told from a mesh by its material,
    also before its image has been unpacked.
    """
    for member, kind in MEMBERS.items():
        found = scene.evaluate(f"typeof window.__viserMutable.{member}")
        assert found == kind, f"in viser {viser.__version__} __viserMutable.{member} is {found}, expected {kind}"
    found = scene.evaluate("""(() => {
        const found = [];
        const nodes = window.__viserMutable.nodeRefFromName;
        nodes['/picture'].traverse((item) => item.isMesh && found.push(item.material.type));
        nodes['/particles'].traverse((item) => {
            if (item.isPoints) found.push(item.geometry.attributes.color.array.constructor.name);
        });
        return found;
    })()""")
    assert found == ["MeshBasicMaterial", "Uint8Array"], (
        f"viser {viser.__version__} shows picture and points by {found}"
    )


def test_the_scene_calls_before_it_draws(scene: Any) -> None:
    """`colours.js` gives meshes their colours then."""
    scene.evaluate("""(() => {
        const { scene, requestRender } = window.__viserMutable;
        const dress = scene.onBeforeRender;
        scene.onBeforeRender = function (...given) {
            window.drawnOnce = true;
            scene.onBeforeRender = dress;
            return dress.apply(this, given);
        };
        requestRender();
    })()""")
    until(scene, "window.drawnOnce === true")


def test_what_the_style_sheet_and_the_scripts_look_for_is_there(scene: Any) -> None:
    """A selector that finds nothing leaves the panel as viser has it, or a number to be taken digit by digit."""
    missing = [each for each in SELECTORS if not scene.evaluate(f"document.querySelectorAll({each!r}).length")]
    assert not missing, f"the client of viser {viser.__version__} has no element {missing}; see viewer/client"


def test_the_scene_says_whether_it_is_drawn(scene: Any) -> None:
    """With a picture it is in place when the camera frames it; nothing but viser's own nodes is nothing."""
    assert scene.evaluate("pftrackScene.drawn()") == "in place"
    found = scene.evaluate("""(() => {
        const nodes = window.__viserMutable.nodeRefFromName;
        const kept = Object.entries(nodes).filter(([name]) => name !== "" && name !== "/WorldAxes");
        for (const [name] of kept) delete nodes[name];
        const found = pftrackScene.drawn();
        Object.assign(nodes, Object.fromEntries(kept));
        return found;
    })()""")
    assert found is None
