"""A chain in the browser: regions split while one watches and one is refuted; arms on films are followed."""

from pathlib import Path

import numpy as np

from tests.arm import FRAMES, film, joints
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


def test_an_arm_is_marked_and_followed(gallery: Gallery, server: Server, tmp_path: Path) -> None:
    """A film is chosen, the four points are offered where the arm has them, and they are followed."""
    film(tmp_path / "arm.mp4")
    page = gallery.page
    gallery.choose("arm.mp4", (tmp_path / "arm.mp4").read_bytes(), "video/mp4")
    page.locator(".mark-surface").wait_for()
    page.select_option("#target-experiment", "linkage")
    gallery.until(lambda: page.locator(".point[data-handle]").count() == 4, "four points are offered")
    tip = page.locator(".point[data-handle='points.tip']")
    for key in ("ArrowUp", "ArrowDown"):
        tip.press(key)
    go = page.locator("button:has-text('Track it')")
    gallery.until(go.is_enabled, "what was touched is a mark")
    go.click()
    shown = SessionPage(page, server).ready()
    assert shown.session["recipe"]["footage"]["mark"]["kind"] == "points"
    shown.play_to_the_end()
    rows = server.column(shown.id, "series")
    lengths = np.array([rows[-1][f"length_{link}"] for link in (1, 2, 3)])
    seen = np.linalg.norm(np.diff(joints(0), axis=0), axis=1)
    assert (lengths[:, 1] > seen).all()
    assert len(rows) == FRAMES
