"""A sweep on its pages: planned in the form, watched while its map fills, and followed back to the run that failed."""

from collections.abc import Callable
from typing import Any

import pytest

from tests.browser.accessible import fits, usable
from tests.browser.conftest import Complaints
from tests.browser.host import Server, until
from tests.browser.views import SessionPage, View
from tests.server.uploads.test_uploads import video

AXES = {"occlusion_width_px": [5, 55, 105], "distracter_radius_px": [1, 20]}
SMALL: dict[str, Any] = {
    "experiment": "ball",
    "axes": [{"name": name, "values": values} for name, values in AXES.items()],
    "trackers": ["h-spf", "pc-pf"],
    "trials": 5,
    "frames": 40,
    "parameters": {"sample_count": 100},
}
ACROSS, UP = 3, 2
FAILING = {"i": 1, "j": 1}
BARE = [0, 0, 0, 0]
"""The colour of a cell in which nothing has been computed yet: the page shows through."""


class SweepPage(View):
    """The page of a sweep."""

    @property
    def id(self) -> str:
        return str(self.page.url.split("?")[0].rsplit("/", 1)[1])

    @property
    def words(self) -> str:
        return str(self.page.inner_text(".bar-words"))

    def complete(self) -> None:
        self.until(lambda: self.words.startswith("Complete"), "the sweep is complete")

    def centre(self, method: str, i: int, j: int) -> tuple[float, float]:
        """Where the middle of a cell is in the map's canvas, px."""
        plot = self.page.locator(f"[data-map='{method}'] .figure-plot")
        self.until(lambda: plot.get_attribute("data-left") is not None, "the map is drawn")
        box = plot.evaluate("(plot) => ({ ...plot.dataset })")
        left, top, width, height = (float(box[name]) for name in ("left", "top", "width", "height"))
        return left + (i + 0.5) * width / ACROSS, top + (UP - j - 0.5) * height / UP

    def colours(self, method: str) -> list[list[int]]:
        """The colours of a map's cells, taken a little beside the figures that stand there."""
        read = """(canvas, [x, y]) => {
            const scale = canvas.width / canvas.clientWidth;
            return [...canvas.getContext("2d").getImageData((x - 14) * scale, (y - 14) * scale, 1, 1).data];
        }"""
        canvas = self.page.locator(f"[data-map='{method}'] canvas")
        return [canvas.evaluate(read, list(self.centre(method, i, j))) for j in range(UP) for i in range(ACROSS)]

    def click_cell(self, method: str, cell: dict[str, int], place: str) -> None:
        """Have the runs of a cell listed, which is at a place in words."""
        x, y = self.centre(method, **cell)
        self.page.locator(f"[data-map='{method}'] .figure-picture").click(position={"x": x, "y": y})
        self.until(lambda: place in self.page.inner_text(".sweep-side h2"), "it is the cell")
        self.run.wait_for()

    def show(self, words: str) -> None:
        self.page.get_by_role("group", name="Quantity").get_by_role("button", name=words).click()

    @property
    def run(self) -> Any:
        """The first of the runs that are listed."""
        return self.page.locator("li.run").first


class Form(View):
    """The form of a new sweep."""

    def fills(self, **fields: str) -> None:
        for field, value in fields.items():
            self.page.locator(f"[data-field={field}] input").fill(value)

    def says(self, runs: str) -> None:
        self.until(lambda: self.page.inner_text(".plan-size .figure >> nth=0") == runs, f"the plan has {runs}")

    def start(self) -> SweepPage:
        self.page.get_by_role("button", name="Start the sweep").click()
        self.page.wait_for_url("**/sweep/*")
        return SweepPage(self.page)


@pytest.fixture(scope="module")
def complete(server: Server) -> dict[str, Any]:
    """A small sweep that is complete."""
    begun: dict[str, Any] = server.post("sweeps", SMALL)
    until(lambda: server.get(f"sweeps/{begun['id']}")["state"] == "done", "the sweep is complete")
    return begun


@pytest.fixture
def sweep(complete: dict[str, Any], page: Any) -> SweepPage:
    """The page of a small sweep that is complete."""
    page.goto(complete["page"])
    shown = SweepPage(page)
    shown.until(lambda: page.locator(".map .figure-plot[data-left]").count() == 2, "the maps are drawn")
    shown.complete()
    return shown


def test_a_session_becomes_a_sweep(page: Any, server: Server) -> None:
    """A session leads to a sweep with its tracker and values over what was moved last; it begins with a curve."""
    moved = [{"frame": 0, "values": {"ball_radius_px": 7}}, {"frame": 3, "values": {"occlusion_width_px": 60}}]
    session = server.start_session(tracker="condensation", timeline=moved)
    page.goto(session["page"])
    SessionPage(page, server).ready().menu("sweep")
    page.wait_for_selector(".plan-size")
    assert page.locator("[data-field=trackers] input:checked").get_attribute("value") == "condensation"
    assert page.locator("[data-field=parameters] input").input_value() == "7"
    told = [page.get_by_label(it, exact=True).input_value() for it in ("Varied parameter", "From", "To", "Step")]
    assert told == ["occlusion_width_px", "0", "120", "12"]
    page.get_by_label("Trials in each cell").fill("1")
    page.get_by_label("Frames of a run").fill("8")
    form = Form(page)
    form.says("11 runs")
    form.start().complete()
    page.get_by_role("img", name="Success rate over Occluder width").wait_for()
    page.locator("[data-map=condensation] [role=application]").wait_for()


def test_from_the_form_to_the_frame_of_the_loss(page: Any, server: Server, complaints: Complaints) -> None:
    """A sweep started from the form fills its map; a click on a failing cell and run shows that run fail as told."""
    complaints.expected = ("422",)
    page.goto("work?show=sweeps")
    page.click("text=New sweep")
    page.wait_for_selector(".plan-size")
    form = Form(page)
    errors_stand_beside_their_field(form)
    for index, values in enumerate(["5, 55, 105", "1, 20"]):
        page.locator(f"[data-field='axes.{index}.values']").fill(values)
    form.fills(trials="8", frames="60")
    form.says("144 runs")
    form.until(lambda: page.inner_text("[data-role=time]").endswith("to compute"), "the form tells the time")
    sweep = form.start()
    sweep.until(lambda: page.locator(".map").count() == 3, "there is a map for each method")
    sweep.until(lambda: sweep.colours("h-spf").count(BARE) < 6, "it fills")
    sweep.complete()
    sweep.until(lambda: BARE not in sweep.colours("h-spf"), "all cells are there")

    sweep.click_cell("h-spf", FAILING, "Occluder width 55 px")
    found = server.get(f"sweeps/{sweep.id}/rows?i=1&j=1&tracker=h-spf")["rows"]
    row = next(row for row in found if (row["first_lost_frame"] or 0) > 10)
    item = page.locator(f"li.run[data-run='{row['run']}']")
    assert f"first in frame {row['first_lost_frame']}," in item.inner_text()
    assert sweep.run.get_attribute("data-verdict") == "failure"
    with page.context.expect_page() as opening:
        item.locator(".run-title").click()
    opened = SessionPage(opening.value, server).ready()
    opened.stands_at(row["first_lost_frame"] - 10)
    assert (opened.session["recipe"]["seed"], opened.session["playing"]) == (row["seed"], False)
    assert opened.page.get_attribute("[data-tool=sweep]", "href") == f"sweep/{sweep.id}"
    assert server.column(opened.id, "lost")[: row["first_lost_frame"] + 1] == [False] * row["first_lost_frame"] + [True]


def test_a_complete_sweep_is_looked_at(sweep: SweepPage, page: Any, server: Server) -> None:
    """All that its page shows, in one visit; whatever changes the address comes after what does not."""
    it_is_read_by_keyboard(sweep, page)
    the_other_methods_are_one_click_away(sweep, page, server)
    it_fits_and_can_be_used_by_everybody(sweep, page)
    a_measure_is_chosen(sweep, page, server)
    there_are_several_ways_to_see_it(sweep, page)
    my_work_lists_it(sweep, page)


def the_other_methods_are_one_click_away(sweep: SweepPage, page: Any, server: Server) -> None:
    """Beside a run there is a link for each other method, to the same seed."""
    sweep.click_cell("pc-pf", {"i": 2, "j": 1}, "Occluder width 105 px")
    run = int(sweep.run.get_attribute("data-run"))
    row = next(row for row in server.get(f"sweeps/{sweep.id}/rows?i=2&j=1")["rows"] if row["run"] == run)
    with page.context.expect_page() as opening:
        sweep.run.locator(".chip-link", has_text="h-SPF").click()
    opening.value.wait_for_url("**/session/*", wait_until="commit")
    session = server.session(opening.value.url.rsplit("/", 1)[1])
    assert (session["tracker"], session["recipe"]["seed"]) == ("h-spf", row["seed"])


def it_is_read_by_keyboard(sweep: SweepPage, page: Any) -> None:
    """Arrow keys move from cell to cell and tell what is there, Enter lists its runs, Escape hides what was told."""
    plot = page.locator("[data-map='h-spf'] [role=application]")
    label = plot.get_attribute("aria-label")
    assert label.startswith("h-SPF · Hard switching, success. Arrow keys move from cell to cell, Enter lists its runs.")
    assert "Occluder width, px to the right, from 5 to 105." in label
    plot.focus()
    for key in ("Tab", "Shift+Tab", "ArrowRight", "ArrowUp"):
        page.keyboard.press(key)
    tip = page.locator(".tooltip")
    tip.wait_for()
    said = ("Occluder width 55 px", "Look-alike radius 20 px", "5 runs")
    sweep.until(lambda: all(words in tip.inner_text() for words in said), "the cell is told of")
    page.keyboard.press("Enter")
    sweep.run.wait_for()
    assert "Look-alike radius 20 px" in page.inner_text(".runs-head")
    rings = page.locator(".figure-ring:not(.cursor):visible")
    sweep.until(lambda: rings.count() == 2, "both maps mark the cell")
    assert page.locator(".figure-ring.cursor:visible").count() == 1
    page.keyboard.press("ArrowDown")
    sweep.until(lambda: "Look-alike radius 1 px" in tip.inner_text(), "the cell below is told of")
    page.keyboard.press("Escape")
    tip.wait_for(state="hidden")


def there_are_several_ways_to_see_it(sweep: SweepPage, page: Any) -> None:
    """The switch shows error, difference and significance; axes can be swapped; the address remembers all of it."""
    pressed = page.locator(".segments [aria-pressed=true]")
    for words in ("Difference", "Significance", "Error", "Success"):
        sweep.show(words)
        sweep.until(lambda words=words: pressed.inner_text() == words, "it is what is shown")  # type: ignore[misc]
        assert page.evaluate("document.activeElement.innerText") == words
    sweep.show("Significance")
    few = "0 cells to 0, 6 not significant"
    sweep.until(lambda: few in page.inner_text("[data-part=maps]"), "so few pairs of runs show no difference")
    page.get_by_label("Holm").click()
    sweep.until(lambda: "not significant" in page.inner_text("[data-part=maps]"), "the verdicts are counted")
    page.get_by_label("Axis across").select_option("distracter_radius_px")
    sweep.until(lambda: "x=distracter_radius_px" in page.url, "the address names the axes")
    page.reload()
    sweep.until(lambda: page.locator(".map").count() == 3, "two methods and their comparison are shown")
    chosen = {"Axis across": "distracter_radius_px", "Axis up": "occlusion_width_px"}
    assert {label: page.get_by_label(label).input_value() for label in chosen} == chosen
    assert page.get_by_label("Holm").is_checked()
    up = page.get_by_label("Axis up")
    up.select_option("none")
    sweep.until(lambda: "y=none" in page.url, "the address says that one axis is shown")
    page.reload()
    sweep.until(lambda: up.count() == 1 and up.input_value() == "none", "a link pools the other one, too")


def a_measure_is_chosen(sweep: SweepPage, page: Any, server: Server) -> None:
    """The maps show the means of the measure that is chosen, say which it is, and a link to it shows the same."""
    sweep.until(lambda: BARE not in sweep.colours("h-spf"), "all cells are there")
    successes = sweep.colours("h-spf")
    sweep.show("Measure")
    page.select_option("select[aria-label='Which measure']", "inside_share")
    told = "Inside the true box, mean of all runs"
    sweep.until(lambda: told in page.inner_text(".sweep-legend"), "the legend says so")
    sweep.until(lambda: sweep.colours("h-spf") != successes, "so do the maps")
    shown = sweep.colours("h-spf")
    sweep.until(lambda: "of=inside_share" in page.url, "the address names it")
    page.reload()
    sweep.until(lambda: page.locator(".map .figure-plot[data-left]").count() == 2, "the maps are drawn")
    sweep.until(lambda: sweep.colours("h-spf") == shown, "the link shows the same")
    page.select_option("select[aria-label='Which measure']", "median_error_px")
    sweep.until(lambda: "px" in page.inner_text(".sweep-legend"), "the scale has its unit")
    sweep.until(lambda: sweep.colours("h-spf") != shown, "another measure is another map")


def errors_stand_beside_their_field(form: Form) -> None:
    """What is wrong in the form is said beside the field, before and without starting anything."""
    page = form.page
    page.locator("[data-field='axes.0.values']").fill("5, 1000")
    beside = page.locator("[data-field='axes.0'] .wrong")
    form.until(beside.is_visible, "the error is shown")
    assert "between 0 and 640 px, got 1000" in beside.inner_text()
    form.until(page.locator("text=Start the sweep").is_disabled, "it cannot be started")
    page.locator("[data-field='axes.0.values']").fill("5, 100")
    form.until(beside.is_hidden, "the error is gone")
    form.fills(trials="0")
    form.until(page.locator("[data-field=trials] .wrong").is_visible, "the error is beside the trials")
    fits(page)


def it_fits_and_can_be_used_by_everybody(sweep: SweepPage, page: Any) -> None:
    """On a wide screen, a narrow one and a phone nothing hangs out at the side; axe finds nothing, light and dark."""
    sweep.show("Significance")
    sweep.until(lambda: page.locator(".map").count() == 3, "two methods and their comparison are shown")
    sweep.click_cell("h-spf", FAILING, "Occluder width 55 px")
    usable(page)


def my_work_lists_it(sweep: SweepPage, page: Any) -> None:
    """My work lists it with its outcome; an experiment's card leads to its form, without what is only drawn."""
    row = page.locator(f"[data-sweep='{sweep.id}']")
    page.goto("work?show=sweeps")
    row.wait_for()
    assert all(words in row.inner_text() for words in ("60 runs", "complete"))
    page.goto("./")
    page.locator("[data-experiment=fish] >> text=Sweep over conditions").click()
    page.wait_for_selector(".plan-size")
    assert page.get_by_label("Experiment", exact=True).input_value() == "fish"
    offered = set(page.get_by_label("Varied parameter").first.locator("option").all_inner_texts())
    assert offered & {"Particles", "Shown mode", "Along the mode, sd", "Swaying mode"} == {"Particles"}


def test_a_session_on_a_clip_becomes_a_sweep(watch: Callable[..., SessionPage], server: Server, page: Any) -> None:
    """The form knows the clip and the parameters of recordings; the maps show what the trackers say of themselves."""
    upload = server.upload("ball.mp4", video(16))
    shown = watch(experiment="histogram", upload=upload, box=[10, 20, 10, 10], frames=None)
    page.goto(shown.page.get_attribute("[data-tool=sweep]", "href"))
    form = Form(page)
    page.wait_for_selector(".plan-size")
    assert "All runs are on ball.mp4" in page.inner_text(".plan-form")
    assert page.inner_text("[data-field=experiment]") == "Colours of a window"
    form.says("20 runs")
    page.click("[data-role=add-axis]")
    choice = page.locator(".axis select").first
    names = choice.locator("option").evaluate_all("(all) => all.map((one) => one.value)")
    assert {"sample_count", "sway_px"} & set(names) == {"sample_count"}
    choice.select_option("sample_count")
    for part, number in (("start", "30"), ("stop", "60"), ("step", "30")):
        page.locator(f".axis [data-field='axes.0.{part}']").fill(number)
    form.fills(trials="2")
    page.locator(".methods input[value=apf]").check()
    form.says("8 runs")
    sweep = form.start()
    sweep.complete()
    assert page.locator("[aria-pressed=true]").first.inner_text() == "Measure"
    told = server.get(f"sweeps/{sweep.id}")
    assert (told["recording"], told["problems"], told["done"]) == ("ball.mp4", 0, 8)
    assert page.locator("text=Change and repeat").count() == 0
