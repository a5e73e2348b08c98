"""A body's shape in the browser: from the gallery, and from a table of tracks that somebody brings."""

from tests.browser.host import Server
from tests.browser.views import Gallery, SessionPage
from tests.tracks import table


def test_a_shape_is_found_while_one_watches(gallery: Gallery, server: Server) -> None:
    """Opened from the gallery, the shape error falls, and the plots and the world of the shape are there."""
    page = gallery.page
    gallery.preset("structure", "works")
    shown = SessionPage(page, server).ready()
    shown.until(lambda: (shown.position or 0) > 40, "it plays by itself until the first shape is there")
    errors = server.column(shown.id, "error")
    assert errors[40] < errors[5] / 2
    page.get_by_text("depth over its noise").first.wait_for()


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
