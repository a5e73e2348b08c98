"""A solid in the scene: its camera from aside, and a second run beside it."""

from collections.abc import Callable

import pytest

from tests.browser.host import Server
from tests.browser.views import SessionPage

pytestmark = pytest.mark.scene


def shows(view: SessionPage, node: str) -> bool:
    """Whether a node of the scene is there and visible."""
    return bool(view.in_scene(f"window.__viserMutable?.nodeRefFromName['/{node}']?.visible === true", otherwise=False))


# tests/viewer has what a scene draws.
@pytest.mark.slow
def test_a_solid_in_the_scene(watch: Callable[..., SessionPage], server: Server) -> None:
    """Where another tracker goes its own way, the solid of the run that was left is drawn as well.

    From the front there is the picture and nothing across it; a click on Side shows the camera that took it.
    """
    view = watch(experiment="prism")
    the_camera_is_seen_from_aside(view)
    server.seek(view.id, 30)
    view.stands_at(30)
    view.press("Home")
    view.stands_at(0)
    assert not shows(view, "second edges")
    view.branch("alpha-1")
    view.press("Shift+ArrowRight")
    view.stands_at(10)
    view.until(lambda: shows(view, "second edges"), "the second run's solid is seen")
    view.until(lambda: shows(view, "estimated edges"), "and so is the first one's")
    view.press("Home")
    view.until(lambda: not shows(view, "second edges"), "where both are the same, one is drawn")


def the_camera_is_seen_from_aside(view: SessionPage) -> None:
    view.until(lambda: not shows(view, "camera"), "nothing is across the picture")
    view.scene.get_by_role("button", name="Side").click()
    view.until(lambda: shows(view, "camera"), "the camera is seen")
    view.scene.get_by_role("button", name="Front").click()
    view.until(lambda: not shows(view, "camera"), "the camera is out of the way")
