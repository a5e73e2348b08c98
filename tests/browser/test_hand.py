"""A hand in the browser: the tree of what is kept, a film on which an open hand is found, and a real one."""

import numpy as np
import pytest

from pftrack.core.model.source import History
from pftrack.experiments.hand.scene import HandSceneParameters, HandSource
from tests.browser.host import Server
from tests.browser.views import Gallery, SessionPage
from tests.making import encoded

FRAMES = 6
SCENE = HandSceneParameters(motion="occlusion")
HAND = HandSource(1, SCENE)
"""Row of the scene's picture at which a hand without an arm ends."""


@pytest.fixture(scope="module")
def film() -> bytes:
    """The simulated hand, encoded."""
    history = History(((0, SCENE),))
    return encoded([np.array(HAND.frame(frame, history).image_rgb) for frame in range(FRAMES)], 10)


def test_a_hand_is_kept_by_four_hypotheses_and_the_tree_shows_each(gallery: Gallery, server: Server) -> None:
    """Of the four hands that are kept a click shows one of the others."""
    page = gallery.page
    gallery.preset("hand", "wrist")
    kept = SessionPage(page, server).ready()
    kept.go_to_the_end()
    kept.until(lambda: kept.verdict == "held (by truth)", "the turn is survived")
    rows = server.column(kept.id, "series")
    frame, hands = next((place, row["hands"]) for place, row in enumerate(rows) if len(row["hands"]["weights"]) == 4)
    count = sum(len(row["hands"]["weights"]) for row in rows)
    kept.until(lambda: len((kept.trace("hands") or {"y": []})["y"]) == count, "all hands are nodes")
    kept.plot("hands").locator(".figure-plot").click(position=kept.place_in("hands", frame, 3))
    kept.stands_at(frame)
    said = f"hand 3 of 4, {100 * hands['weights'][2]:.0f} %"
    kept.until(lambda: said in page.inner_text(".flat-caption"), "the third hand is drawn and told")
    assert len(kept.session["branches"]) == 1


def test_an_open_hand_is_found_on_a_film_and_followed(gallery: Gallery, server: Server, film: bytes) -> None:
    """Nothing is marked: the form finds the five tips and says how well the hand covers what is seen."""
    page = gallery.page
    gallery.choose("hand.mp4", film, "video/mp4")
    gallery.until(lambda: page.input_value("#target-experiment") == "hand", "it is proposed")
    page.select_option("#target-experiment", "hand")  # and chosen again
    gallery.until(lambda: page.locator(".point[data-handle]").count() == 5, "five tips are found")
    gallery.until(lambda: "5 fingers are seen" in page.inner_text(".suits-words"), "it is judged")
    go = page.locator("button:has-text('Track it')")
    gallery.until(go.is_enabled, "what was found is a mark")
    go.click()
    shown = SessionPage(page, server).ready()
    shown.play_to_the_end()
    rows = server.column(shown.id, "series")
    assert max(row["difference"] for row in rows[1:]) < 15.0
