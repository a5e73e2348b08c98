"""The page of a report: it needs nothing else, and its maps have the numbers and the colours of the cells."""

import json
import re
from dataclasses import dataclass
from html import unescape

import numpy as np
import pytest
from matplotlib.colors import to_hex
from playwright.sync_api import Browser

from pftrack.output.figures.style import diverging
from pftrack.sweep import Result
from pftrack.sweep.axis import Axis
from pftrack.sweep.cells import Code, cells, quantities, significance
from pftrack.sweep.report import Report
from pftrack.sweep.report.frame import CODES, Frame, amounts, largest_difference, number, scale_of
from pftrack.sweep.report.page import STYLE
from pftrack.sweep.report.study import Study
from pftrack_server.sweeps.results import Results

AXES = "occlusion_width_px", "distracter_radius_px"


@dataclass(frozen=True)
class Map:
    """What a map of a page has: its title, the colours of its cells in their order, and what they tell the pointer."""

    title: str
    fills: list[str]
    figures: dict[str, list[str]]


def maps_of(text: str, quantity: str) -> list[Map]:
    """Return the maps in the section of a quantity."""
    section = re.search(rf'<details id="{quantity}".*?</details>', text, re.DOTALL)[0]
    found = []
    for figure in re.findall("<figure>.*?</figure>", section, re.DOTALL):
        cells = {
            (-float(y), float(x)): fill
            for fill, path in re.findall(r'<path fill="(#\w{6})" d="([^"]*)"', figure)
            for x, y in re.findall(r"M([\d.]+) ([\d.]+)h", path)
        }
        title = unescape(re.search("<figcaption>(.*?)</figcaption>", figure)[1])
        figures = json.loads(re.search("<script[^>]*>(.*?)</script>", figure)[1])
        found.append(Map(title, [cells[place] for place in sorted(cells)], figures))
    return found


def test_the_page_needs_nothing_else(report: Report) -> None:
    """It loads no address, has the tables' figures, and its plots carry what the pointer shows."""
    text = report.page.read_text()
    outside_scripts = re.sub(r"<script.*?</script>", "", text, flags=re.DOTALL)
    assert not re.findall(r"""(?:src|href)=|<link|@import|url\(""", outside_scripts)
    assert not re.findall(r"<script[^>]*src", text)
    for row in report.tables[0].rows:
        assert f"<td>{row[2]}</td>" in text
    for shown in ("95 % interval", "mean error", "1: h-spf, 2: condensation", "not applicable", "on the same scenes"):
        assert shown in text


def test_the_page_says_what_the_level_means(report: Report, finished: Result) -> None:
    """The share of false alarms is that of the level asked for, and cells that were not tested are not counted."""
    text = report.page.read_text()
    assert "up to 20 % come out as significant by chance" in text
    found = significance(*cells(finished, *AXES).values(), level=0.2)
    counts = [int((found.codes == code).sum()) for code in (Code.FIRST_BETTER, Code.SECOND_BETTER)]
    tested = int((found.codes != Code.NOT_APPLICABLE).sum())
    assert tested < 8
    assert f"<span>h-spf {counts[0]}, condensation {counts[1]} of {tested} tested</span>" in text


@pytest.mark.parametrize("name", ["success", "error", "inside_share", "median_error_px"])
def test_maps_tell_the_figures_of_the_servers_view(report: Report, finished: Result, name: str) -> None:
    """Means, differences, intervals, p-values and verdicts are those that the sweep's page gets."""
    view = Results(finished.plan, finished.path)
    view.refresh()
    *means, difference, significant = maps_of(report.page.read_text(), name)[:4]
    for shown, drawn in zip(view.cells(*AXES).maps, means, strict=True):
        expected = {"success": shown.rate, "error": shown.error, **shown.measures}[name]
        label = {"error": "mean error", "inside_share": "Inside the true box", "median_error_px": "Median error, px"}
        form = "{:.3f}".format if name == "success" else number
        told = ["" if value is None else form(value) for value in expected]
        assert drawn.figures[label.get(name, name)] == told
        assert drawn.figures["runs"] == ["6"] * 8
    seen = view.compare(*AXES, "h-spf", "condensation", name, "chi-square", 0.2, "none")
    for label, values in (("difference", seen.difference), ("on the same scenes", seen.paired)):
        assert difference.figures[label] == ["" if value is None else number(value, "+") for value in values]
    assert difference.figures["95 % interval"] == [
        "" if low is None else f"{number(low, '+')} to {number(high, '+')}"
        for low, high in zip(seen.paired_low, seen.paired_high, strict=True)
    ]
    assert difference.figures["pairs"] == [str(count) for count in seen.pairs]
    assert significant.figures["p"] == ["not applicable" if p is None else f"{p:.2g}" for p in seen.p_value]
    words = {"first": "Hard switching (h-SPF) better", "second": "Condensation better", "none": "not significant"}
    assert significant.figures["verdict"] == [words.get(it, "not applicable") for it in seen.verdict]


def test_maps_have_the_colours_of_their_cells(report: Report, finished: Result) -> None:
    """A mean is bright where it is good, a difference blue where the first is better, and a verdict as in the key."""
    study, text = Study.of(finished, level=0.2), report.page.read_text()
    for quantity in quantities(finished.plan):
        *means, difference, significant = maps_of(text, quantity.name)[:4]
        values = [quantity.means(found) for found in study.maps.values()]
        low, high = scale_of(quantity, values)
        for drawn, each in zip(means, values, strict=True):
            shares = (each[np.isfinite(each)] - low) / (high - low)
            assert drawn.fills == [to_hex(amounts(quantity)(share)) for share in shares]
        (pair,) = study.comparisons[quantity.name]
        shares = 0.5 + pair.difference[np.isfinite(pair.difference)] / (2 * largest_difference([pair]))
        assert difference.fills == [to_hex(diverging()(share)) for share in shares]
        ends = f"{number(-largest_difference([pair]))} <i"
        unit = {"px": ", px", "frames": ", frames"}.get(quantity.unit, "")
        assert f'<p class="scale">Difference{unit} <span>{ends}' in text
        colours = amounts(quantity)
        assert f"right, {to_hex(colours(0.0))}, {to_hex(colours(0.125))}," in text
        assert f", {to_hex(colours(1.0))})" in text
        assert difference.title == significant.title == "1: h-spf, 2: condensation"
        assert significant.fills == [CODES[Code(code)] for code in pair.significance(0.2).codes.ravel().tolist()]


def test_labels_do_not_touch(finished: Result) -> None:
    """Where there is no room numbers are left out, from the first on evenly; the names of choices stand upright."""
    axes = Axis("occlusion_width_px", tuple(map(float, range(1000, 1100)))), Axis("ball_colour", ("#000000", "#ffffff"))
    labels = Frame.of(Study(finished, *axes, level=0.01)).labels
    across = [int(text) for text in re.findall(r">(1\d{3})<", labels)]
    assert across[:2] == [1000, 1000 + across[1] - across[0]]
    assert set(np.diff(across)) == {across[1] - across[0]}
    assert 4 < len(across) < 10
    assert labels.count("#ffffff") == 1
    colours = Axis("ball_colour", tuple(f"#{number:06x}" for number in range(12)))
    upright = Frame.of(Study(finished, colours, None, level=0.01)).labels
    assert upright.count("rotate(-90)") == 12


def test_numbers_are_written_to_three_digits() -> None:
    """Large ones are whole, differences have their sign, and what is not known is left blank."""
    assert [number(value) for value in (0.0012345, 12.345, 999.6, 12345.6, np.nan)] == [
        *("0.00123", "12.3", "1,000", "12,346", "")
    ]
    assert [number(value, "+") for value in (0.25, -1234.5, 2000.0)] == ["+0.25", "-1,234", "+2,000"]


TOUCHING = """svg => {
  const boxes = [...svg.querySelectorAll("text, rect")].map((one) => [one.textContent, one.getBoundingClientRect()]);
  const within = svg.getBoundingClientRect();
  const out = ([, { x, y, right, bottom }]) =>
    Math.min(x - within.x, y - within.y, within.right - right, within.bottom - bottom) < -1;
  const touch = ([, one], [, other]) =>
    Math.min(one.right, other.right) - Math.max(one.x, other.x) > 1 &&
    Math.min(one.bottom, other.bottom) - Math.max(one.y, other.y) > 3;
  return boxes.flatMap((one, at) => [
    ...(out(one) ? [`${one[0]} is cut off`] : []),
    ...boxes.slice(at + 1).filter((other) => touch(one, other)).map((other) => `${one[0]} touches ${other[0]}`),
  ]);
}"""


@pytest.mark.browser
def test_labels_have_their_room(finished: Result, chromium: Browser) -> None:
    """As they are drawn, values and names of both axes touch neither each other nor the cells, nor are they cut off."""
    counts = Axis("sample_count", tuple(range(1000, 1040)))
    colours = Axis("ball_colour", tuple(f"#{number:06x}" for number in range(9)))
    page = chromium.new_page()
    for x, y in ((*finished.plan.axes,), (counts, colours), (colours, counts), (colours, None), (counts, None)):
        frame = Frame.of(Study(finished, x, y, level=0.01))
        cells = ["#ffffff"] * (len(x.values) * (len(y.values) if y else 1))
        page.set_content(f"<style>{STYLE} text {{ line-height: 1 }}</style>{frame.map(cells, 'a map')}")
        assert page.locator("svg").evaluate(TOUCHING) == [], (x, y)
    page.close()


def test_cells_stand_apart_if_they_are_large(finished: Result) -> None:
    """They fill their map but for a line between them."""
    frame = Frame.of(Study.of(finished))
    (path,) = re.findall(r'd="([^"]*)"', frame.map(["#123456"] * 8, "a map"))
    corners = [(float(x), float(y)) for x, y in re.findall(r"M([\d.]+) ([\d.]+)h", path)]
    sides = {(float(across), float(down)) for across, down in re.findall(r"h([\d.]+)v([\d.]+)h-", path)}
    assert sides == {(frame.wide - 1, frame.high - 1)}
    assert sorted(corners) == [(x * frame.wide, y * frame.high) for x in range(4) for y in range(2)]


@pytest.mark.browser
@pytest.mark.parametrize("width", [1280, 390])
def test_the_page_shows_a_cell_under_the_pointer(report: Report, chromium: Browser, width: int) -> None:
    """Without a network a cell tells its figures, a section unfolds, and nothing reaches beyond a narrow page."""
    page = chromium.new_page(viewport={"width": width, "height": 900}, offline=True)
    faults: list[str] = []
    page.on("pageerror", lambda error: faults.append(str(error)))
    page.on("requestfailed", lambda request: faults.append(request.url))
    page.goto(report.page.as_uri())
    first = page.locator("figure").first
    first.scroll_into_view_if_needed()
    page.evaluate("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")  # it has scrolled
    box = first.locator("rect").bounding_box()
    assert box is not None
    page.mouse.move(box["x"] + 0.9 * box["width"], box["y"] + 0.1 * box["height"])
    figures = maps_of(report.page.read_text(), "success")[0].figures
    told = page.locator("#cell")
    assert told.inner_text().split("\n")[:4] == ["Occluder width, px", "60", "Look-alike radius, px", "10"]
    assert told.inner_text().split("\n")[4:6] == ["success", figures["success"][7]]
    page.mouse.move(box["x"] + 0.1 * box["width"], box["y"] + 0.9 * box["height"])
    assert told.inner_text().split("\n")[:4] == ["Occluder width, px", "0", "Look-alike radius, px", "1"]
    page.mouse.move(2, 2)
    assert told.is_hidden()
    assert page.locator("details[open]").count() == 2
    folded = page.locator("#median_error_px")
    assert folded.locator("figure").first.is_hidden()
    folded.locator("summary").click()
    assert folded.locator("figure:visible").count() == 4
    assert page.evaluate("document.documentElement.scrollWidth") == width
    assert not faults
    page.close()
