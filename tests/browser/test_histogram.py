"""A window by its colours in the browser: from the gallery, and on a film that somebody brings."""

from tests.browser.host import Server
from tests.browser.test_suitability import draw, grade
from tests.browser.test_upload import clip as clip  # noqa: PLC0414 - a fixture
from tests.browser.views import Gallery, SessionPage


def test_the_lawn_and_a_film_are_tracked_live(gallery: Gallery, server: Server, clip: bytes) -> None:
    """A preset plays with its plot of the likeness; a disc in a box drawn on a film is followed to its end."""
    page = gallery.page
    gallery.preset("histogram", "works")
    shown = SessionPage(page, server).ready()
    shown.until(lambda: (shown.position or 0) > 20, "it plays by itself")
    assert max(server.column(shown.id, "error")[:20]) < 8
    page.get_by_text("likeness").first.wait_for()

    page.goto(server.url)
    gallery.choose("walk.mp4", clip, "video/mp4")
    page.locator(".mark-surface").wait_for()
    page.locator("#target-experiment").select_option("histogram")
    gallery.until(lambda: page.evaluate("document.querySelector('.mark-surface img').complete"), "the picture is there")
    draw(page, 31, 51, 19, 19)
    gallery.until(lambda: grade(page) == "well", "the disc separates well")
    page.locator("button:has-text('Track it')").click()
    shown = SessionPage(page, server).ready()
    shown.play_to_the_end()
    last = len(server.column(shown.id, "estimate")) - 1
    column, row = server.column(shown.id, "estimate")[last]
    assert abs(column - (40 + 2 * last)) < 4
    assert abs(row - 60) < 4
