"""One's own video: from the drop zone over the box of the target to a running session."""

import pytest

from tests.browser.accessible import check, fits
from tests.browser.host import Server
from tests.browser.views import Gallery, SessionPage
from tests.making import disc_film

FRAMES = 30


@pytest.fixture(scope="module")
def clip() -> bytes:
    """A red disc that walks to the right over grey, 160 x 120 px."""
    return disc_film(FRAMES)


def test_a_clip_becomes_a_session_that_tracks(gallery: Gallery, server: Server, clip: bytes) -> None:
    """Choose file and start, draw the box by mouse, correct it by keyboard, go; the disc is followed."""
    page = gallery.page
    gallery.choose("walk.mp4", clip, "video/mp4")
    surface = page.locator(".mark-surface")
    surface.wait_for()
    assert "walk.mp4" in page.inner_text(".target header")
    go = page.locator("button:has-text('Track it')")
    assert go.is_disabled()
    check(page)
    fits(page)
    page.set_viewport_size({"width": 1280, "height": 800})

    page.reload()
    surface.wait_for()
    page.locator("#target-start").fill("5")
    gallery.until(lambda: "/frames/5." in (page.get_attribute(".mark-surface img", "src") or ""), "frame 5 is shown")
    gallery.until(lambda: page.evaluate("document.querySelector('.mark-surface img').complete"), "the picture is there")
    area = surface.bounding_box()
    scale = area["width"] / 160
    words = lambda: " ".join(page.inner_text(".target-choices").split())  # noqa: E731 - one line of reading
    gallery.until(lambda: "picture 5 of 30, frame 0 of the session" in words(), "both numbers are told")
    page.mouse.move(area["x"] + 40 * scale, area["y"] + 50 * scale)
    page.mouse.down()
    page.mouse.move(area["x"] + 58 * scale, area["y"] + 70 * scale, steps=4)
    page.mouse.up()
    gallery.until(lambda: page.inner_text(".picture-words").startswith("18 × 20 px"), "the box is as drawn")
    page.keyboard.press("ArrowRight")
    page.keyboard.press("d")
    page.keyboard.press("D")
    page.keyboard.press("A")
    page.keyboard.press("Shift+ArrowRight")
    page.keyboard.press("Shift+ArrowLeft")
    page.keyboard.press("Shift+ArrowUp")
    page.keyboard.press("Shift+ArrowDown")
    gallery.until(lambda: page.inner_text(".picture-words") == "19 × 20 px at 41, 50", "the keys moved and resized it")
    page.select_option("#target-tracker", "h-spf")
    go.click()

    shown = SessionPage(page, server).ready()
    footage = shown.session["recipe"]["footage"]
    assert footage["mark"] == {"kind": "box", "x": 41, "y": 50, "width": 19, "height": 20}
    assert footage["start"] == 5
    shown.press("ArrowRight")
    shown.stands_at(1)
    assert page.inner_text(".counter").endswith("picture 6 of the clip")
    shown.play_to_the_end()
    last = shown.session["frames"] - 1
    u, v = server.column(shown.id, "estimate")[last]
    assert abs(u - (40 + 2 * (5 + last))) < 9
    assert abs(v - 60) < 9


def test_what_is_no_video_is_refused_with_a_reason(gallery: Gallery) -> None:
    """The page says what was wrong, and offers one way on."""
    page = gallery.page
    gallery.choose("notes.mp4", b"these are words, not pictures\n" * 40, "video/mp4")
    page.locator(".wrong").wait_for()
    assert "notes.mp4 was not accepted" in page.inner_text(".drop")
    assert len(page.inner_text(".wrong")) > 20
    page.click("text=Choose another file")
    page.locator("text=Drop a video here").wait_for()


@pytest.fixture(autouse=True)
def _refusals_are_told_on_the_console(complaints: object) -> None:
    """Chromium lists every answer with an error status."""
    complaints.expected = ("the server responded with a status of 4",)  # type: ignore[attr-defined]
