"""Before tracking: the form of an upload says whether a target can be followed, and shows where it would be seen."""

from typing import Any

import pytest

from tests.browser.test_upload import clip as clip  # noqa: PLC0414 - a fixture
from tests.browser.views import Gallery


def draw(page: Any, x: float, y: float, width: float, height: float) -> None:
    """Draw a box on the picture of 160 px by mouse."""
    area = page.locator(".mark-surface").bounding_box()
    scale = area["width"] / 160
    page.mouse.move(area["x"] + x * scale, area["y"] + y * scale)
    page.mouse.down()
    page.mouse.move(area["x"] + (x + width) * scale, area["y"] + (y + height) * scale, steps=3)
    page.mouse.up()


def drag_corner_by_touch(page: Any, far: float) -> None:
    """Drag the lower right corner of the box outwards with a finger, which is further from it than a mouse may be."""
    box = page.locator(".mark-line").bounding_box()
    x, y = box["x"] + box["width"] + 9, box["y"] + box["height"] + 9
    fingers = page.context.new_cdp_session(page)
    for kind, way in (("touchStart", 0.0), ("touchMove", far), ("touchEnd", None)):
        at = [] if way is None else [{"x": x + way, "y": y + way}]
        fingers.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": at})
    fingers.detach()


def grade(page: Any) -> str:
    return str(page.get_attribute(".suits-words", "data-grade"))


def test_a_box_is_judged_as_soon_as_it_is_drawn(gallery: Gallery, clip: bytes) -> None:
    """The disc separates well, with a map of the likelihood; the ground not at all, and what would help is said.

    A box with the disc in its corner, and ground for the most part, is replaced by the one that is proposed.
    """
    page = gallery.page
    gallery.choose(f"w{'a' * 90}lk.mp4", clip, "video/mp4")  # a name as phones give, without a place to break it
    page.locator(".mark-surface").wait_for()
    page.locator(".suits-words", has_text="Mark the target to see").wait_for()
    assert page.locator(".suits-picture").is_hidden()
    gallery.until(lambda: page.evaluate("document.querySelector('.mark-surface img').complete"), "the picture is there")

    draw(page, 31, 51, 19, 19)
    gallery.until(lambda: grade(page) == "well", "the disc separates well")
    assert page.inner_text(".suits-remark").startswith("Separates well: ")
    gallery.until(
        lambda: page.evaluate("document.querySelector('.suits-picture').naturalWidth") == 160, "its map is there"
    )
    the_map_keeps_its_proportions(gallery, 1280)

    draw(page, 29, 49, 44, 44)
    better = page.locator("[data-role=better]")
    better.wait_for()
    better.click()
    gallery.until(lambda: page.inner_text(".picture-words").startswith("22 × 22 px"), "the smaller box is drawn")
    gallery.until(lambda: grade(page) in {"well", "poorly"}, "it separates better")
    the_map_keeps_its_proportions(gallery, 390)

    draw(page, 100, 20, 30, 30)
    gallery.until(lambda: grade(page) == "not at all", "the ground does not")
    assert "separates not at all" in page.inner_text(".suits-remark").lower()
    assert "No smaller box separates better" in page.inner_text(".suits-words")
    drag_corner_by_touch(page, 20)
    gallery.until(lambda: not page.inner_text(".picture-words").startswith("30 × 30 px"), "a finger takes the corner")
    assert int(page.inner_text(".picture-words").split()[0]) > 30
    gallery.until(lambda: page.evaluate("document.documentElement.scrollWidth") <= 390, "nothing sticks out")
    assert page.locator("button:has-text('Track it')").is_enabled()


def the_map_keeps_its_proportions(gallery: Gallery, width: int) -> None:
    """In a window of a width, of which nothing sticks out."""
    gallery.page.set_viewport_size({"width": width, "height": 800})
    gallery.until(lambda: gallery.page.evaluate("innerWidth") == width, "the window has its width")
    gallery.until(lambda: gallery.page.evaluate("document.documentElement.scrollWidth") <= width, "nothing sticks out")
    shown = gallery.page.locator(".suits-picture").bounding_box()
    assert shown["width"] / shown["height"] == pytest.approx(160 / 120, rel=0.02)
