"""A lecturer drags a particle and the estimate in the scene, and the run goes on from there."""

from collections.abc import Callable

import pytest

from tests.browser.conftest import Complaints
from tests.browser.host import Server
from tests.browser.views import SessionPage

# Of the particles within the picture the furthest from all: its place there, and where it is seen, CSS pixels.
SEEN = """() => {
    const { camera, nodeRefFromName } = window.__viserMutable ?? {};
    const canvas = document.querySelector('canvas[data-engine]')?.getBoundingClientRect();
    let found = null;
    nodeRefFromName?.['/particles']?.traverse((item) => {
        if (!item.isPoints) return;
        const { array, count } = item.geometry.attributes.position;
        const place = (n) => [array[3 * n], array[3 * n + 1], array[3 * n + 2]];
        const all = Array.from({ length: count }, (_, n) => place(n));
        const [middle, level] = [0, 1].map((axis) => all.reduce((sum, each) => sum + each[axis], 0) / count);
        const off = ([x, y]) => Math.hypot(x - middle, y - level);
        const inside = all.filter(([x, y]) => x > 20 && x < 300 && y < -20 && y > -220);
        const furthest = inside.reduce((one, other) => (
            off(one) < off(other) ? other : one));
        const seen = item.localToWorld(camera.position.clone().set(...furthest)).project(camera);
        const [x, y] = [(seen.x + 1) / 2 * canvas.width, (1 - seen.y) / 2 * canvas.height];
        found = { at: [furthest[0], -furthest[1]], x, y };
    });
    return found;
}"""
GRIPS = "Boolean(window.__viserMutable?.nodeRefFromName?.['/grips'])"
EYE = "window.__viserMutable.camera.position.toArray().map((value) => Math.round(value))"


@pytest.mark.scene
def test_a_particle_is_dragged_with_shift_and_the_camera_turns_without(
    watch: Callable[..., SessionPage], server: Server, complaints: Complaints
) -> None:
    """The change stands on the timeline, the particle is drawn there, and the next frame begins with it."""
    # viser asks for it at each grip that is pressed, from a listener that cannot.
    complaints.expected = ("Unable to preventDefault inside passive event listener",)
    view = watch(tracker="condensation", seed=3)
    server.seek(view.id, 20)
    view.stands_at(20)
    view.until(lambda: view.in_scene("window.pftrackScene?.drawn()", None) == "in place", "the picture stands still")
    view.until(lambda: view.in_scene(GRIPS, False), "there are grips")
    frame, mouse = view.page.locator(".scene-frame").bounding_box(), view.page.mouse
    seen = view.in_scene(f"({SEEN})()", None)
    at = frame["x"] + seen["x"], frame["y"] + seen["y"]
    a_click_takes_the_particle_that_it_hits(view, at, seen["at"])

    def drag(across: float, down: float) -> None:
        mouse.move(*at)
        mouse.down()
        for share in (0.2, 0.6, 1.0):
            mouse.move(at[0] + share * across, at[1] + share * down)
            view.page.wait_for_timeout(100)
        mouse.up()

    mouse.move(*at)
    view.page.wait_for_timeout(500)
    view.page.keyboard.down("Shift")
    eye = view.in_scene(EYE, None)
    drag(0.0, -60.0)
    view.page.keyboard.up("Shift")
    view.until(lambda: view.session["timeline"], "it is a change of the run")
    (change,) = view.session["timeline"]
    assert (change["frame"], change["moved"][0][:9]) == (21, "Particle ")
    assert view.in_scene(EYE, None) == eye
    view.until(lambda: (view.in_scene(f"({SEEN})()", None) or seen)["at"] != seen["at"], "it is drawn elsewhere")
    drag(40.0, -60.0)
    view.until(lambda: view.in_scene(EYE, None) != eye, "the camera turns")
    assert view.session["timeline"] == [change]


def a_click_takes_the_particle_that_it_hits(view: SessionPage, at: tuple[float, float], place: list[float]) -> None:
    """In three dimensions as in the flat picture: the particle that is hit is told."""
    view.press("i")
    view.page.get_by_role("button", name="Particle", exact=True).click()
    card = view.page.locator(".inspection-card")
    view.until(lambda: "drawn by" in card.inner_text(), "some particle is told")
    view.page.mouse.click(*at)
    wanted = "particle at {:.1f}, {:.1f} px".format(*place)
    view.until(lambda: wanted in card.inner_text(), f"the {wanted} is told")
    view.press("i")
    card.wait_for(state="hidden")
