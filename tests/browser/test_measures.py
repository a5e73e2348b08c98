"""Measures on the page of a session: the one that decides in a line, all others on request, in words and units."""

from collections.abc import Callable

from tests.browser.host import Server
from tests.browser.views import SessionPage

Watch = Callable[..., SessionPage]


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
    words = listed.inner_text()
    known = server.get(f"sessions/{shown.id}")["measured"]
    assert f"inside the true box\n{100 * known['inside_share']:.0f} %" in words
    assert f"{known['median_error_px']:.1f} px" in words
    shown.page.locator(".measures dt .term").first.hover()
    shown.page.locator("#meaning").get_by_text("inside the true box").wait_for()
