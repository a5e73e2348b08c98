"""A fish that bends, in the browser: on a film of one's own."""

import cv2
import numpy as np
import pytest

from pftrack.experiments.fish.model import FishShape, body_points, tail_corners
from tests.browser.clips import encoded
from tests.browser.host import Server
from tests.browser.views import Gallery, SessionPage

FRAMES, SIZE = 24, (320, 240)
SHAPE = FishShape(24.0, 10.0, 32.0)


def pose(frame: int) -> np.ndarray:
    """Where the editor begins: head at three fifths of the width, root of the tail at 45 %; it swims to the right."""
    return np.array([167.5 + 3.0 * frame, 119.5, 0.02 * frame, 0.2 * np.sin(0.4 * frame)])


@pytest.fixture(scope="module")
def film() -> bytes:
    """An orange fish over blue, which beats its tail."""
    pictures = np.full((FRAMES, SIZE[1], SIZE[0], 3), (90, 120, 150), np.uint8)
    for frame, picture in enumerate(pictures):
        for corners in (body_points(pose(frame), SHAPE, 60), tail_corners(pose(frame), SHAPE)):
            cv2.fillPoly(picture, [np.rint(corners).astype(np.int32)], (235, 105, 40))
    return encoded(pictures, rate=15)


def test_what_is_only_drawn_is_nothing_to_sweep_over(gallery: Gallery) -> None:
    """The number of particles may be varied, and not which mode a ghost shows."""
    gallery.card("fish").get_by_text("Sweep over conditions").click()
    offered = gallery.page.get_by_label("Varied parameter").first.locator("option")
    offered.first.wait_for(state="attached")
    titles = offered.all_inner_texts()
    assert "Particles" in titles
    assert not {"Shown mode", "Along the mode, sd", "Swaying mode"} & set(titles)


# test_linkage.py and test_hand.py follow films from marks.
@pytest.mark.slow
def test_a_film_is_followed_from_the_mark(gallery: Gallery, server: Server, film: bytes) -> None:
    """The editor offers head, root and tip; the form says how well the fish stands out; then it is tracked."""
    page = gallery.page
    gallery.choose("pond.mp4", film, "video/mp4")
    page.locator(".mark-surface").wait_for()
    page.select_option("#target-experiment", "fish")
    gallery.until(lambda: page.locator(".point[data-handle]").count() == 3, "three points are offered")
    head = page.locator(".point[data-handle=head]")
    for key in ("ArrowUp", "ArrowDown"):
        head.press(key)
    go = page.locator("button:has-text('Track it')")
    gallery.until(go.is_enabled, "what was touched is a mark")
    gallery.until(lambda: "told from the water by its colour" in page.inner_text(".suits-words"), "it is judged")
    go.click()
    shown = SessionPage(page, server).ready()
    assert shown.session["recipe"]["footage"]["mark"]["kind"] == "body"
    shown.play_to_the_end()
    a, b = server.column(shown.id, "estimate")[FRAMES - 1]
    assert np.hypot(*(np.array([a, b]) - pose(FRAMES - 1)[:2])) < 8
