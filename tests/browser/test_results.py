"""Results of other trackers in the browser: a recording with its clip, and a table whose columns nobody knows."""

from tests.browser.accessible import check, fits
from tests.browser.conftest import Complaints
from tests.browser.host import Server
from tests.browser.views import Gallery, SessionPage

FRAMES = 12


def test_a_person_says_what_the_columns_are(gallery: Gallery, server: Server, complaints: Complaints) -> None:
    """A table in another language is asked about, with its first lines in sight, and then opens."""
    complaints.expected = ("the server responded with a status of 422",)
    page = gallery.page
    lines = ["bild;links;oben;breit;hoch", *(f"{t};{10 + t};20;30;40" for t in range(FRAMES))]
    gallery.choose("gang.csv", "\n".join(lines).encode(), "text/csv")
    page.get_by_text("What are the columns of gang.csv?").wait_for()
    assert page.locator(".columns-rows td").first.inner_text() == "0"
    check(page)
    fits(page)
    for meaning, column in (("frame", "bild"), ("x", "links"), ("y", "oben"), ("w", "breit"), ("h", "hoch")):
        page.locator(f"#column-{meaning}").select_option(label=column)
    page.locator(".columns button[type=submit]").click()
    go = page.locator("button:has-text('Open it')")
    go.wait_for()
    go.click()
    shown = SessionPage(page, server).ready()
    shown.play_to_the_end()
    assert server.column(shown.id, "estimate")[-1] == [10 + FRAMES - 1 + 14.5, 39.5]
