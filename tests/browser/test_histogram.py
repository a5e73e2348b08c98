"""A window by its colours in the browser; films are followed in tests/experiments/test_histogram.py."""

from tests.browser.host import Server
from tests.browser.views import Gallery, SessionPage


def test_the_lawn_is_tracked_live(gallery: Gallery, server: Server) -> None:
    """A preset plays with its plot of the likeness."""
    page = gallery.page
    gallery.preset("histogram", "works")
    shown = SessionPage(page, server).ready()
    shown.until(lambda: (shown.position or 0) > 20, "it plays by itself")
    assert max(server.column(shown.id, "error")[:20]) < 8
    page.get_by_text("likeness").first.wait_for()
