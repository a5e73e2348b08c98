"""Plots and worlds of several experiments: a pose, a face that is lost and found again, chains, trajectories."""

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tests.browser.host import Server
from tests.browser.views import Gallery, SessionPage

Watch = Callable[..., SessionPage]


def series(server: Server, session: str, name: str, branch: str | None = None) -> NDArray[np.float64]:
    rows = server.column(session, "series", branch)
    return np.array([row[name] for row in rows], dtype=np.float64)


def alpha_on_the_page(shown: SessionPage) -> NDArray[np.float64]:
    """Return alpha (frames, features) as it is drawn: the row of a feature is 1 high, and counted from the top.

    A page that plays is looked at row by row; the frames are those that all rows hold.
    """
    drawn = [row["y"] for place in range(1, 9) if (row := shown.trace(f"alpha x{place}")) is not None]
    frames = min(map(len, drawn), default=0)
    rows = np.array([row[:frames] for row in drawn], dtype=np.float64)
    return ((np.arange(len(rows))[:, None] + 1 - 0.12 - rows) / 0.76).T


def test_a_run_of_a_pose_is_drawn(watch: Watch, server: Server) -> None:
    """All that plots show of a pose, in one visit: to the end, with a second branch, and in a small window."""
    shown = watch(experiment="prism", frames=40)
    shown.play_to_the_end()
    alpha_is_a_row_for_each_corner(shown, server)
    a_pose_has_a_band_around_it_and_the_truth_in_it(shown, server)
    a_branch_is_a_second_line_and_alpha_is_of_the_one_that_is_shown(shown)
    calibration_is_the_share_so_far(shown, server)


def alpha_is_a_row_for_each_corner(shown: SessionPage, server: Server) -> None:
    """It is drawn as it was written down, with what is hidden shaded; all corners are recognised in the end."""
    shown.until(lambda: len(alpha_on_the_page(shown)) == 40, "the rows hold all frames")
    assert np.allclose(alpha_on_the_page(shown), series(server, shown.id, "alpha"), atol=1e-6)
    assert "hidden" in shown.plot("alpha").inner_text()
    recognised = lambda: shown.page.inner_text(".readout dl").split("recognised")[1].split()[1:3]  # noqa: E731
    shown.until(lambda: recognised() == ["of", "8"], "it is told how many corners are recognised")


def a_pose_has_a_band_around_it_and_the_truth_in_it(shown: SessionPage, server: Server) -> None:
    """Yaw is drawn as it was written down, within two standard deviations, beside the truth."""
    branch = shown.session["branch"]
    shown.until(lambda: len((shown.trace(f"yaw {branch}") or {"x": []})["x"]) == 40, "yaw is drawn")
    drawn, band, truth = (shown.trace(f"yaw {name}") for name in (branch, "band 0", "truth"))
    yaw, sd = (series(server, shown.id, name) for name in ("yaw_deg", "yaw_deg_sd"))
    assert np.allclose(drawn["y"], yaw)
    assert np.allclose(band["high"], yaw + 2 * sd)
    assert np.allclose(band["low"], yaw - 2 * sd)
    assert np.allclose(truth["y"], series(server, shown.id, "yaw_deg_true"))


def calibration_is_the_share_so_far(shown: SessionPage, server: Server) -> None:
    """How often the truth lay in either band is drawn once it is scrolled to, in percent of all frames so far."""
    for name in ("within_50", "within_95"):
        line = f"calibration {shown.session['branch']} {name}"
        shown.until(lambda line=line: shown.lines.get(line) == 40, "the share is drawn")  # type: ignore[misc]
        drawn = shown.trace(line)
        inside = series(server, shown.id, name).mean(axis=1)
        assert np.allclose(drawn["y"], 100 * np.cumsum(inside) / np.arange(1, 41))


def a_branch_is_a_second_line_and_alpha_is_of_the_one_that_is_shown(shown: SessionPage) -> None:
    """Both branches have a yaw in a colour of their own; of alpha the active one's is drawn."""
    first = shown.session["branch"]
    shown.press("ArrowLeft")
    shown.stands_at(38)
    shown.branch("alpha-1")
    shown.play_to_the_end()
    second = shown.session["branch"]
    shown.until(lambda: shown.lines.get(f"yaw {second}") and shown.lines.get(f"yaw {first}"), "there are two lines")
    colours = {branch["id"]: branch["colour"] for branch in shown.session["branches"]}
    for branch in (first, second):
        drawn = shown.trace(f"yaw {branch}")
        assert drawn["ink"] == colours[branch]
    shown.until(lambda: (shown.trace("alpha x1") or {}).get("ink") == colours[second], "alpha is the second branch's")


def test_a_plot_is_looked_at_more_closely(watch: Watch, server: Server) -> None:
    """The wheel with Ctrl zooms all plots at the pointer, dragging moves them, a double click shows all."""
    shown = watch(frames=60)
    shown.go_to(59)
    page, branch = shown.page, shown.session["branch"]
    shown.until(lambda: shown.lines.get(f"error {branch}") == 60, "the error is drawn")
    frames = "document.querySelector('.plots .figure-view').figure.panels.map(({ x }) => [x.low, x.high])"
    assert {tuple(it) for it in page.evaluate(frames)} == {(0, 59)}

    plot = shown.plot("error").locator(".figure-plot")
    drawn = shown.trace(f"error {branch}")
    plot.hover(position=shown.place_in("error", 30, drawn["y"][30]))
    shown.until(lambda: "frame 30 · error" in page.locator(".tooltip:visible").inner_text(), "the value is told")
    page.keyboard.down("Control")
    page.mouse.wheel(0, -300)
    page.keyboard.up("Control")
    shown.until(lambda: page.evaluate(frames)[0] != [0, 59], "fewer frames are seen")
    shown.until(lambda: len({tuple(it) for it in page.evaluate(frames)}) == 1, "in all plots")
    ((low, high),) = {tuple(it) for it in page.evaluate(frames)}
    assert high - 30 < low < 30 < high

    page.evaluate("clicks = 0; document.querySelector('.plots-figure').addEventListener('click', () => clicks++)")
    area = plot.bounding_box()
    page.mouse.down()
    page.mouse.move(area["x"] + area["width"] - 5, area["y"] + 20)
    page.mouse.up()
    shown.until(lambda: page.evaluate(frames)[0][0] < low, "earlier frames come into sight")
    assert shown.position == 59
    page.mouse.down()
    page.mouse.move(area["x"], 5)
    page.mouse.up()
    plot.click(position={"x": area["width"] / 2, "y": 20})
    shown.until(lambda: page.evaluate("window.clicks") == 1, "only a click that is no drag counts, also after a drag")
    plot.dblclick(position={"x": area["width"] / 2, "y": 20})
    shown.until(lambda: page.evaluate(frames)[0] == [0, 59], "all is seen again")
    page.keyboard.press("+")
    shown.until(lambda: page.evaluate(frames)[0][0] > 20, "the key zooms at the frame that is shown")
    page.keyboard.press("0")
    shown.until(lambda: page.evaluate(frames)[0] == [0, 59], "and shows all")


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


def test_tracks_are_followed_while_one_watches(gallery: Gallery, server: Server) -> None:
    """Opened from the gallery, tracks go straight through outliers, and errors of all of them are plotted."""
    page = gallery.page
    gallery.preset("trajectories", "known")
    shown = SessionPage(page, server).ready()
    shown.until(lambda: (shown.position or 0) > 0, "it plays by itself")
    shown.play_to_the_end()
    assert max(server.column(shown.id, "error")) < 10.0
    page.get_by_text("smoothed px").first.wait_for()
    page.get_by_text("measurements px").first.wait_for()
    shown.resize(800)
    shown.until(lambda: worlds_are_within(page), "both worlds are within the scene's place")


def worlds_are_within(page: Any) -> bool:
    """Return whether two worlds are shown, both whole at their upper and left edges."""
    place = page.locator(".flat-main").bounding_box()
    boxes = [world.bounding_box() for world in page.locator(".world").all()]
    return len(boxes) == 2 and all(box[side] >= place[side] for box in boxes for side in "xy")
