"""A chain in the browser: regions split while one watches and one is refuted; arms on films are followed."""

from tests.browser.host import Server
from tests.browser.views import Gallery, SessionPage

"""In the first of these frames: cuff, wrist, knuckles and ball, px."""


def test_regions_split_and_one_is_refuted_while_one_watches(gallery: Gallery, server: Server) -> None:
    """Opened from the gallery two regions are followed from a split until one is refuted; the scrubber marks both."""
    page = gallery.page
    gallery.preset("linkage", "mirror3")
    shown = SessionPage(page, server).ready()
    shown.until(lambda: (shown.position or 0) > 0, "it plays by itself")
    page.get_by_text("tree of hypotheses").first.wait_for()
    shown.play_to_the_end()
    rows = server.column(shown.id, "series")
    split, refuted = (next(frame for frame, row in enumerate(rows) if row[name]) for name in ("split", "refuted"))
    assert split < refuted
    counts = [row["hypothesis_count"] for row in rows]
    assert set(counts[split:refuted]) == {2}
    assert counts[refuted] == 1
    assert all(row["contained"] == 1 for row in rows)
    scrubber = page.locator(".scrubber")
    shown.until(lambda: "events" in (scrubber.get_attribute("data-rows") or ""), "the scrubber has a row of events")
    box = scrubber.bounding_box()
    scrubber.focus()
    page.keyboard.press("Home")
    shown.stands_at(0)
    left, width = box["x"] + 104, box["width"] - 114
    page.mouse.click(left + width * split / (len(rows) - 1), box["y"] + 60)
    shown.stands_at(split)
    shown.until(lambda: "split" in (scrubber.get_attribute("aria-valuetext") or ""), "the scrubber says what happened")
    page.locator(".world").nth(1).wait_for()
