"""Plots of a pose and of hypotheses, and a closer look at plots."""

from tests.browser.conftest import Watch
from tests.browser.host import Server
from tests.browser.views import Gallery, SessionPage


def test_a_pose_and_its_branch_are_drawn(watch: Watch, server: Server) -> None:
    """Each corner has a row and each angle a band; a branch is a second line in its own colour."""
    shown = watch(experiment="prism", frames=12)
    shown.go_to(11)
    first = shown.session["branch"]
    shown.until(lambda: shown.lines.get(f"yaw {first}") == 12, "yaw is drawn")
    last = server.column(shown.id, "series")[-1]
    assert shown.trace("yaw band 0")["high"][-1] == last["yaw_deg"] + 2 * last["yaw_deg_sd"]
    assert shown.trace("alpha x1")["values"][-1] == last["alpha"][0]
    assert "hidden" in shown.plot("alpha").inner_text()
    recognised = lambda: shown.page.inner_text(".readout dl").split("recognised")[1].split()[1:3]  # noqa: E731
    shown.until(lambda: recognised() == ["of", "8"], "the recognised corners are counted")
    shown.go_to(9)
    shown.branch("alpha-1")
    shown.go_to(11)
    colours = [branch["colour"] for branch in shown.session["branches"]]
    shown.until(lambda: (shown.trace("alpha x1") or {}).get("ink") == colours[1], "alpha is the second branch's")
    second = shown.session["branch"]
    assert [shown.trace(f"yaw {branch}")["ink"] for branch in (first, second)] == colours
    calibration = f"calibration {second} within_95"
    shown.until(lambda: shown.lines.get(calibration) == 12, "a plot out of sight is drawn too")


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
    shown.until(lambda: "frame 30 · error" in page.locator(".tooltip:visible").inner_text(), "the value is shown")
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
    shown.until(lambda: page.evaluate("window.clicks") == 1, "a drag is not a click")
    plot.dblclick(position={"x": area["width"] / 2, "y": 20})
    shown.until(lambda: page.evaluate(frames)[0] == [0, 59], "all is seen again")
    page.keyboard.press("+")
    shown.until(lambda: page.evaluate(frames)[0][0] > 20, "the key zooms at the frame that is shown")
    page.keyboard.press("0")
    shown.until(lambda: page.evaluate(frames)[0] == [0, 59], "and shows all")


def test_a_tree_of_hypotheses_is_steered(gallery: Gallery, server: Server) -> None:
    """A click goes to a hypothesis's frame and shows it, arrow keys choose another one, and no branch is made.

    The scrubber names the split, and both worlds fit a narrow window.
    """
    page = gallery.page
    gallery.preset("linkage", "mirror3")
    shown = SessionPage(page, server).ready()
    shown.until(lambda: (shown.position or 0) > 0, "it plays by itself")
    page.get_by_text("tree of hypotheses").first.wait_for()
    shown.play_to_the_end()
    rows = server.column(shown.id, "series")
    split = next(frame for frame, row in enumerate(rows) if row["split"])
    shown.press("Home")
    shown.stands_at(0)
    shown.plot("tree").locator(".figure-plot").click(position=shown.place_in("tree", split, 2))
    shown.stands_at(split)
    scrubber = page.locator(".scrubber")
    shown.until(lambda: "split" in (scrubber.get_attribute("aria-valuetext") or ""), "the scrubber names the event")
    choice = lambda: shown.session["parameters"]["shown_hypothesis"]  # noqa: E731 - one line of reading
    shown.until(lambda: choice() == 2, "the click chooses the second hypothesis")
    node = page.get_by_role("slider", name="shown hypothesis")
    shown.until(lambda: node.input_value() == "2", "the keyboard's handle has it")
    node.press("ArrowUp")
    shown.until(lambda: choice() == 1, "an arrow key chooses the one above")
    assert (len(shown.session["branches"]), shown.position) == (1, split)
    shown.resize(800)
    place = page.locator(".flat-main")
    boxes = lambda: [it.bounding_box() for it in (place, *page.locator(".world").all())]  # noqa: E731
    inside = lambda around, *worlds: [all(box[side] >= around[side] for side in "xy") for box in worlds]  # noqa: E731
    shown.until(lambda: inside(*boxes()) == [True, True], "both worlds are within the picture's place")
