"""A body's shape in the browser: from a table of tracks that somebody brings."""

from tests.browser.host import Server
from tests.browser.views import Gallery, SessionPage
from tests.tracks import table


def test_a_table_of_tracks_is_brought_in(gallery: Gallery, server: Server) -> None:
    """A table is chosen as a file, nothing is to be marked, and its points are followed."""
    page = gallery.page
    gallery.choose("prism.csv", table().encode(), "text/csv")
    go = page.locator("button:has-text('Track it')")
    go.wait_for()
    assert "prism.csv, 26 frames of tracks" in page.inner_text(".target header")
    page.locator("#target-experiment").select_option("structure")
    assert page.locator("#target-truth").count() == 0
    page.locator("img.target-picture").wait_for()
    go.click()
    shown = SessionPage(page, server).ready()
    shown.play_to_the_end()
    assert shown.session["recipe"]["footage"]["name"] == "prism.csv"
    assert len(server.column(shown.id, "estimate")[25]) == 3 * 14
