"""A lecturer drags a particle and the estimate in the scene, and the run goes on from there."""

from collections.abc import Callable

import pytest

from tests.browser.conftest import Complaints
from tests.browser.host import Server
from tests.browser.test_inspect import SEEN
from tests.browser.views import SessionPage

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
