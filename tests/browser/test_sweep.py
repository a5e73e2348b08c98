"""A sweep on its pages: planned in the form, watched while its map fills, and followed back to the run that failed."""

from typing import Any

from tests.browser.accessible import fits, usable
from tests.browser.conftest import Complaints
from tests.browser.host import Server
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


def test_a_recording_becomes_a_sweep(page: Any, server: Server) -> None:
    """The form names the clip and offers parameters of recordings; the maps show the trackers' own measures."""
    upload = server.upload("ball.mp4", video(16))
    session = server.start_session(experiment="histogram", upload=upload, box=[10, 20, 10, 10], frames=None)
    page.goto(session["page"])
    page.goto(SessionPage(page, server).ready().page.get_attribute("[data-tool=sweep]", "href"))
    form = Form(page)
    page.wait_for_selector(".plan-size")
    assert "All runs are on ball.mp4" in page.inner_text(".plan-form")
    assert page.inner_text("[data-field=experiment]") == "Colours of a window"
    page.click("[data-role=add-axis]")
    names = page.locator(".axis select option").evaluate_all("(all) => all.map((one) => one.value)")
    assert {"sample_count", "sway_px"} & set(names) == {"sample_count"}
    page.reload()
    page.wait_for_selector(".plan-size")
    form.fills(trials="1")
    sweep = form.start()
    sweep.complete()
    assert page.locator("[aria-pressed=true]").first.inner_text() == "Measure"
    assert server.get(f"sweeps/{sweep.id}")["recording"] == "ball.mp4"


def test_from_the_form_to_the_frame_of_the_loss(page: Any, server: Server, complaints: Complaints) -> None:
    """A sweep from the form fills its maps; a click on a failing cell and run opens that run before its loss.

    Keyboard, measures, comparisons and addresses come after that, what changes the address last.
    """
    complaints.expected = ("422",)
    page.goto("sweep/new")
    page.wait_for_selector(".plan-size")
    form = Form(page)
    errors_stand_beside_their_field(form)
    for index, values in enumerate(["5, 55, 105", "1, 20"]):
        page.locator(f"[data-field='axes.{index}.values']").fill(values)
    page.locator(".methods input[value=s-spf]").uncheck()
    form.fills(trials="8", frames="60")
    form.says("96 runs")
    form.until(lambda: page.inner_text("[data-role=time]").endswith("to compute"), "the form names the time")
    sweep = form.start()
    sweep.until(lambda: page.locator(".map").count() == 2, "there is a map for each method")
    sweep.until(lambda: sweep.colours("h-spf").count(BARE) < 6, "it fills")
    sweep.complete()
    sweep.until(lambda: BARE not in sweep.colours("h-spf"), "all cells are there")
    it_is_read_by_keyboard(sweep, page)
    sweep.click_cell("h-spf", FAILING, "Occluder width 55 px")
    found = server.get(f"sweeps/{sweep.id}/rows?i=1&j=1&tracker=h-spf")["rows"]
    row = next(row for row in found if (row["first_lost_frame"] or 0) > 10)
    lost = row["first_lost_frame"]
    item = page.locator(f"li.run[data-run='{row['run']}']")
    assert f"first in frame {lost}," in item.inner_text()
    assert sweep.run.get_attribute("data-verdict") == "failure"
    with page.context.expect_page() as opening:
        item.locator(".run-title").click()
    opened = SessionPage(opening.value, server).ready()
    opened.stands_at(lost - 10)
    assert (opened.session["recipe"]["seed"], opened.session["playing"]) == (row["seed"], False)
    assert opened.page.get_attribute("[data-tool=sweep]", "href") == f"sweep/{sweep.id}"
    assert server.column(opened.id, "lost")[: lost + 1] == [False] * lost + [True]
    with page.context.expect_page() as opening:
        item.locator(".chip-link").nth(1).click()  # the first one compares
    opening.value.wait_for_url("**/session/*", wait_until="commit")
    session = server.session(opening.value.url.rsplit("/", 1)[1])
    assert (session["tracker"], session["recipe"]["seed"]) == ("pc-pf", row["seed"]), "the other method, the same seed"
    a_measure_is_chosen(sweep, page)
    there_are_several_ways_to_see_it(sweep, page)
    # My work has its outcome; an experiment's card leads to its form, without parameters that are only drawn.
    line = page.locator(f"[data-sweep='{sweep.id}']")
    page.goto("work?show=sweeps")
    line.wait_for()
    assert all(words in line.inner_text() for words in ("96 runs", "complete"))
    page.goto("./")
    page.locator("[data-experiment=fish] >> text=Sweep over conditions").click()
    page.wait_for_selector(".plan-size")
    assert page.get_by_label("Experiment", exact=True).input_value() == "fish"
    offered = set(page.get_by_label("Varied parameter").first.locator("option").all_inner_texts())
    assert offered & {"Particles", "Shown mode", "Along the mode, sd", "Swaying mode"} == {"Particles"}


def it_is_read_by_keyboard(sweep: SweepPage, page: Any) -> None:
    """Arrow keys move from cell to cell and describe it, Enter lists its runs, Escape hides the description."""
    plot = page.locator("[data-map='h-spf'] [role=application]")
    label = plot.get_attribute("aria-label")
    assert label.startswith("h-SPF · Hard switching, success. Arrow keys move from cell to cell, Enter lists its runs.")
    assert "Occluder width, px to the right, from 5 to 105." in label
    plot.focus()
    for key in ("Tab", "Shift+Tab", "ArrowRight", "ArrowUp"):
        page.keyboard.press(key)
    tip = page.locator(".tooltip")
    tip.wait_for()
    said = ("Occluder width 55 px", "Look-alike radius 20 px", "8 runs")
    sweep.until(lambda: all(words in tip.inner_text() for words in said), "the cell is described")
    page.keyboard.press("Enter")
    sweep.run.wait_for()
    assert "Look-alike radius 20 px" in page.inner_text(".runs-head")
    rings = page.locator(".figure-ring:not(.cursor):visible")
    sweep.until(lambda: rings.count() == 2, "both maps mark the cell")
    assert page.locator(".figure-ring.cursor:visible").count() == 1
    page.keyboard.press("ArrowDown")
    sweep.until(lambda: "Look-alike radius 1 px" in tip.inner_text(), "the cell below is described")
    page.keyboard.press("Escape")
    tip.wait_for(state="hidden")


def a_measure_is_chosen(sweep: SweepPage, page: Any) -> None:
    """The maps show the means of the chosen measure and name it, and a link to it shows the same."""
    sweep.until(lambda: BARE not in sweep.colours("h-spf"), "all cells are there")
    successes = sweep.colours("h-spf")
    sweep.show("Measure")
    page.select_option("select[aria-label='Which measure']", "inside_share")
    told = "Inside the true box, mean of all runs"
    sweep.until(lambda: told in page.inner_text(".sweep-legend"), "the legend names it")
    sweep.until(lambda: sweep.colours("h-spf") != successes, "the maps show it")
    shown = sweep.colours("h-spf")
    sweep.until(lambda: "of=inside_share" in page.url, "the address names it")
    page.reload()
    sweep.until(lambda: page.locator(".map .figure-plot[data-left]").count() == 2, "the maps are drawn")
    sweep.until(lambda: sweep.colours("h-spf") == shown, "the link shows the same")


def there_are_several_ways_to_see_it(sweep: SweepPage, page: Any) -> None:
    """The switch shows error, difference and significance; axes can be swapped; the address remembers all of it."""
    pressed = page.locator(".segments [aria-pressed=true]")
    for words in ("Difference", "Error", "Significance"):
        sweep.show(words)
        sweep.until(lambda words=words: pressed.inner_text() == words, "it is shown")  # type: ignore[misc]
        assert page.evaluate("document.activeElement.innerText") == words
    sweep.until(lambda: "not significant" in page.inner_text("[data-part=maps]"), "the verdicts are counted")
    sweep.click_cell("h-spf", FAILING, "Occluder width 55 px")
    usable(page)
    page.get_by_label("Holm").click()
    page.get_by_label("Axis across").select_option("distracter_radius_px")
    sweep.until(lambda: "x=distracter_radius_px" in page.url, "the address names the axes")
    page.reload()
    sweep.until(lambda: page.locator(".map").count() == 3, "two methods and their comparison are shown")
    chosen = {"Axis across": "distracter_radius_px", "Axis up": "occlusion_width_px"}
    assert {label: page.get_by_label(label).input_value() for label in chosen} == chosen
    assert page.get_by_label("Holm").is_checked()


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
