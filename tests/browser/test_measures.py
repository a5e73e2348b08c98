"""Measures on the page of a session: the one that decides in a line, all others on request, in words and units."""

from collections.abc import Callable
from typing import Any

from tests.browser.host import Server
from tests.browser.views import SessionPage

Watch = Callable[..., SessionPage]


def box(place: Any) -> dict[str, float]:
    found: dict[str, float] = place.bounding_box()
    return found


def test_the_run_so_far_is_measured(watch: Watch, server: Server) -> None:
    """The ball is not lost by Bando's limit, and stands beside the ball in some frames; both are to be read."""
    shown = watch()
    server.seek(shown.id, 59)
    shown.stands_at(59)
    leading = shown.page.locator(".measures")
    shown.until(lambda: "hit rate" in leading.inner_text() and "100 %" in leading.inner_text(), "it is said first")
    leading.locator("summary").click()
    listed = shown.page.locator(".measures dl")
    shown.until(lambda: "of 60" in listed.inner_text(), "frames to failure are told of how many")
    # The numbers of the frame, which stand in the same place, can still be read.
    above = lambda: box(listed)["y"] + box(listed)["height"] <= box(shown.page.locator(".readout > dl"))["y"]  # noqa: E731
    for width in (1280, 800):
        shown.page.set_viewport_size({"width": width, "height": 800})
        shown.until(lambda width=width: shown.page.evaluate("innerWidth") == width and above(), "both can be read")
    words = listed.inner_text()
    known = server.get(f"sessions/{shown.id}")["measured"]
    assert f"inside the true box\n{100 * known['inside_share']:.0f} %" in words
    assert f"{known['median_error_px']:.1f} px" in words
    shown.page.locator(".measures dt .term").first.hover()
    shown.page.locator("#meaning").get_by_text("inside the true box").wait_for()
