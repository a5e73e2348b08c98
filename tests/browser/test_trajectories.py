"""Trajectories in the browser: simulated ones from the gallery, and a path that somebody brings as a table."""

from typing import Any

from tests.browser.host import Server
from tests.browser.views import Gallery, SessionPage

JUMPS = (20, 40)


def path() -> str:
    """A path of sixty frames without frames or names, with two jumps and a gap."""
    lines = ["x,y"]
    for frame in range(60):
        aside = 70.0 if frame in JUMPS else 0.0
        lines.append(f"{100 + 4 * frame},{'' if frame == 30 else 80 + 0.05 * frame**2 + aside}")
    return "\n".join(lines) + "\n"


def test_tracks_are_followed_while_one_watches(gallery: Gallery, server: Server) -> None:
    """Opened from the gallery, tracks go straight through outliers, and errors of all of them are plotted."""
    page = gallery.page
    card = gallery.card("trajectories")
    card.locator("summary").click()
    card.locator("[data-preset=known]").click()
    shown = SessionPage(page, server).ready()
    shown.until(lambda: (shown.position or 0) > 0, "it plays by itself")
    shown.play_to_the_end()
    assert max(server.column(shown.id, "error")) < 10.0
    page.get_by_text("smoothed px").first.wait_for()
    page.get_by_text("measurements px").first.wait_for()
    page.set_viewport_size({"width": 800, "height": 800})
    shown.until(lambda: worlds_are_within(page), "both worlds are within the scene's place")


def worlds_are_within(page: Any) -> bool:
    """Return whether there are two worlds, neither of which is cut off above or at the left."""
    place = page.locator(".flat-main").bounding_box()
    boxes = [world.bounding_box() for world in page.locator(".world").all()]
    return len(boxes) == 2 and all(box[side] >= place[side] for box in boxes for side in "xy")


def test_a_path_is_brought_in_and_smoothed(gallery: Gallery, server: Server) -> None:
    """A table of a single path is chosen as a file; jumps and a gap are bridged, and the smoothed path can be taken."""
    page = gallery.page
    gallery.choose("mouse.csv", path().encode(), "text/csv")
    go = page.locator("button:has-text('Track it')")
    go.wait_for()
    assert "mouse.csv, 60 frames of tracks" in page.inner_text(".target header")
    choice = page.locator("#target-experiment")
    assert choice.input_value() == "trajectories"
    choice.select_option("structure")
    assert page.locator("#target-truth").count() == 0
    choice.select_option("trajectories")
    page.locator("img.target-picture").wait_for()
    go.click()
    shown = SessionPage(page, server).ready()
    shown.play_to_the_end()
    outliers = [row.get("outlier_share") for row in server.column(shown.id, "series")]
    assert [outliers[frame] for frame in JUMPS] == [1.0, 1.0]
    table = server.export(shown.id, "paths").text.splitlines()
    smoothed = [float(line.split(",")[7]) for line in table[1:]]
    assert len(smoothed) == 60
    assert all(abs(y - 80 - 0.05 * frame**2) < 6.0 for frame, y in enumerate(smoothed[:40]))
