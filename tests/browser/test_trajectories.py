"""Trajectories in the browser: simulated ones from the gallery, and a path that somebody brings as a table."""

from typing import Any

from tests.browser.host import Server
from tests.browser.views import Gallery, SessionPage


def test_tracks_are_followed_while_one_watches(gallery: Gallery, server: Server) -> None:
    """Opened from the gallery, tracks go straight through outliers, and errors of all of them are plotted."""
    page = gallery.page
    card = gallery.card("trajectories")
    card.locator("summary").click()
    card.locator("[data-preset=known]").click()
    shown = SessionPage(page, server).ready()
    shown.until(lambda: (shown.position or 0) > 0, "it plays by itself")
    shown.play_to_the_end()
    assert max(server.column(shown.id, "error")) < 10.0
    page.get_by_text("smoothed px").first.wait_for()
    page.get_by_text("measurements px").first.wait_for()
    page.set_viewport_size({"width": 800, "height": 800})
    shown.until(lambda: worlds_are_within(page), "both worlds are within the scene's place")


def worlds_are_within(page: Any) -> bool:
    """Return whether there are two worlds, neither of which is cut off above or at the left."""
    place = page.locator(".flat-main").bounding_box()
    boxes = [world.bounding_box() for world in page.locator(".world").all()]
    return len(boxes) == 2 and all(box[side] >= place[side] for box in boxes for side in "xy")
