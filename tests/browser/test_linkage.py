"""A chain in the browser: regions split while one watches and one is refuted; arms on films are followed."""

from typing import Any

from tests.browser.host import Server
from tests.browser.views import Gallery, SessionPage


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
    what_it_reports_is_drawn_as_it_was_written_down(shown, rows)
    a_node_of_the_tree_is_shown_in_its_frame(shown, split)


def what_it_reports_is_drawn_as_it_was_written_down(shown: SessionPage, rows: list[Any]) -> None:
    """Each hypothesis is a node of the tree, and an interval has both ends, beside the truth."""
    count = sum(len(row["hypotheses"]["weights"]) for row in rows)
    shown.until(lambda: len((shown.trace("tree") or {"y": []})["y"]) == count, "all hypotheses are drawn")
    shown.until(lambda: shown.trace("length-3 band 0") is not None, "the interval is drawn")
    found, truth = shown.trace("length-3 band 0"), shown.trace("length-3 truth")
    assert list(zip(found["low"], found["high"], strict=True)) == [tuple(row["length_3"]) for row in rows]
    assert truth["y"] == [row["true_length_3"] for row in rows]


def a_node_of_the_tree_is_shown_in_its_frame(shown: SessionPage, frame: int) -> None:
    """A click goes to the frame of a hypothesis and shows it, arrows choose another one, and no branch comes of it."""
    shown.plot("tree").locator(".figure-plot").click(position=shown.place_in("tree", frame, 2))
    shown.until(lambda: shown.session["parameters"]["shown_hypothesis"] == 2, "the second hypothesis is shown")
    ring = lambda: shown.trace("tree shown") or {"x": []}  # noqa: E731
    shown.until(lambda: (ring()["x"], ring().get("y")) == ([frame], [2]), "it has a ring")
    tree = shown.page.get_by_role("slider", name="shown hypothesis")
    shown.until(lambda: tree.input_value() == "2", "it is told to who cannot see it")
    tree.press("ArrowUp")
    shown.until(lambda: shown.session["parameters"]["shown_hypothesis"] == 1, "the arrow chooses the one above")
    assert len(shown.session["branches"]) == 1
    assert shown.position == frame
