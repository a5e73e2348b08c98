"""Results of other trackers in the browser: a recording with its clip, and a table whose columns nobody knows."""

from pathlib import Path

from tests.browser.accessible import usable
from tests.browser.conftest import Complaints
from tests.browser.host import Server
from tests.browser.views import Gallery, SessionPage
from tests.server.uploads.test_beliefs import FRAMES, recording


def test_a_recording_is_looked_at_like_a_run(gallery: Gallery, server: Server, tmp_path: Path) -> None:
    """It is named as what it is, plays to its end, and has a plot of its overlap."""
    page = gallery.page
    gallery.choose("mine.pft", recording(tmp_path), "application/octet-stream")
    go = page.locator("button:has-text('Open it')")
    go.wait_for()
    assert "12 frames of recorded beliefs" in page.inner_text(".target header")
    go.click()
    shown = SessionPage(page, server).ready()
    shown.play_to_the_end()
    page.get_by_text("overlap (IoU)").first.wait_for()


def test_a_person_says_what_the_columns_are(gallery: Gallery, server: Server, complaints: Complaints) -> None:
    """A table in another language is asked about, with its first lines in sight, and then opens."""
    complaints.expected = ("the server responded with a status of 422",)
    page = gallery.page
    lines = ["bild;links;oben;breit;hoch", *(f"{t};{10 + t};20;30;40" for t in range(FRAMES))]
    gallery.choose("gang.csv", "\n".join(lines).encode(), "text/csv")
    page.get_by_text("What are the columns of gang.csv?").wait_for()
    assert page.locator(".columns-rows td").first.inner_text() == "0"
    usable(page)
    for meaning, column in (("frame", "bild"), ("x", "links"), ("y", "oben"), ("w", "breit"), ("h", "hoch")):
        page.locator(f"#column-{meaning}").select_option(label=column)
    page.locator(".columns button[type=submit]").click()
    go = page.locator("button:has-text('Open it')")
    go.wait_for()
    go.click()
    shown = SessionPage(page, server).ready()
    shown.play_to_the_end()
    assert server.column(shown.id, "estimate")[-1] == [10 + FRAMES - 1 + 14.5, 39.5]
