"""Reports: tables that say what the rows say, figures whose texts have room, and a page that needs nothing else."""

import csv
import io
import json
import re
from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import combinations
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pytest
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.image import AxesImage
from matplotlib.text import Text
from matplotlib.transforms import Bbox
from PIL import Image
from playwright.sync_api import Browser

from pftrack.core.refusal import ConflictError
from pftrack.experiments import EXPERIMENTS
from pftrack.sweep import Plan, Result, begin, carry_out, compare, read_result
from pftrack.sweep.axis import Axis, SweepError
from pftrack.sweep.cells import Code, cells, quantities, quantity_named, samples
from pftrack.sweep.report.files import Report, curves, export_result, figures, page, scale_of, write_report
from pftrack.sweep.report.study import Study, number, tables


def test_tables_say_what_the_cells_say(report: Report, finished: Result) -> None:
    """Rates of trackers and along the axes are those of the cells, in the report and in its file."""
    by_tracker, measures, along, *_ = report.tables
    assert by_tracker.columns[-1] == "lost frames"  # a column without a value is left out
    for row in by_tracker.rows:
        assert row[2] == f"{cells(finished)[row[0]].rate[0, 0]:.3f}"
    of_axis = cells(finished, "occlusion_width_px")
    assert along.columns == ("occlusion_width_px", "h-spf", "condensation")
    for place, row in enumerate(along.rows):
        assert row[1].startswith(f"{of_axis['h-spf'].rate[0, place]:.3f} (")
    with (report.page.parent / "tables.csv").open(newline="") as file:
        lines = list(csv.reader(file))
    assert lines[:3] == [["By tracker"], list(by_tracker.columns), list(by_tracker.rows[0])]
    assert measures.columns[:3] == ("tracker", "hit rate", "inside the true box")
    for row in measures.rows:
        assert row[2] == f"{cells(finished)[row[0]].measures['inside_share'][0, 0]:.3g}"


def test_scales_reach_from_zero_to_all_means_and_numbers_have_three_digits(plan: Plan) -> None:
    """Negative means are on a scale too; a share has all of 0 to 1. Differences have their sign."""
    for means, ends in (
        ((2.0, 5.0, 3.0), (0.0, 5.0)),
        ((-2.0, 1.0), (-2.0, 1.0)),
        ((-2.0, -1.0), (-2.0, 0.0)),
        ((0.0, np.nan), (0.0, 1.0)),
    ):
        maps = [np.array([[mean]]) for mean in means]
        assert scale_of(quantity_named(plan, "median_error_px"), maps) == ends
        assert scale_of(quantity_named(plan, "inside_share"), maps) == (0.0, 1.0)
    shown = ["0.00123", "12.3", "1,000", "12,346", ""]
    assert [number(value) for value in (0.0012345, 12.345, 999.6, 12345.6, np.nan)] == shown
    assert [number(value, "+") for value in (0.25, -1234.5, 2000.0)] == ["+0.25", "-1,234", "+2,000"]


def test_tables_compare_over_all_runs(report: Report, finished: Result) -> None:
    """Difference, interval, pairs and p-value of a quantity are those of the one cell that pools all runs."""
    by_quantity = {table.quantity: table for table in report.tables if table.quantity}
    assert list(by_quantity) == [quantity.name for quantity in quantities(finished.plan)]
    for quantity in quantities(finished.plan):
        seen = compare(quantity, cells(finished), samples(finished, quantity, None), "h-spf", "condensation")
        paired, table = seen.paired, by_quantity[quantity.name]
        assert table.rows[0][1:6] == (
            f"{seen.difference[0, 0]:+.3g}",
            f"{paired.mean[0, 0]:+.3g} ({paired.low[0, 0]:+.3g} to {paired.high[0, 0]:+.3g})",
            str(paired.pairs[0, 0]),
            "Exact McNemar" if quantity.name == "success" else "Signed-rank",
            f"{seen.p_values[0, 0]:.2g}",
        )
        assert table.folded == (quantity.name not in {"success", "error"})


class Lacking(Result):
    """A result in which one tracker has no value of a measure."""

    def pieces(self, columns: Sequence[str] | None = None) -> Iterator[pa.Table]:
        for piece in super().pieces(columns):
            if "inside_share" not in piece.column_names:
                yield piece
                continue
            known = pc.not_equal(piece["tracker"], "condensation")
            column = pc.if_else(known, piece["inside_share"], None)
            yield piece.set_column(piece.column_names.index("inside_share"), "inside_share", column)


def test_a_tracker_that_lacks_a_measure_is_not_compared_by_it(finished: Result) -> None:
    """Its mean, difference and interval are blank and every cell is untested; the others are shown as they are."""
    study = Study.of(Lacking(finished.plan, finished.files, complete=True))
    made = tables(study)
    means = {row[0]: row for row in made[1].rows}
    assert means["condensation"][2] == ""
    assert means["h-spf"][2] != ""
    (compared,) = (table for table in made if table.quantity == "inside_share")
    assert compared.rows[0][1:] == ("", "", "0", "Signed-rank", "not applicable", "0 (0)", "0 (0)", "0 (0)", "8")
    assert sum(len(panel.images) for panel in figures(study)["measure-inside_share"]().axes) == 4
    assert "not applicable" in page(study, made, {})


def test_an_experiment_without_verdicts_has_a_report_of_errors(tmp_path: Path) -> None:
    """Where nothing is lost or won, tables and figures are of errors alone, and one condition needs no figure."""
    axes = Axis("sample_count", (5, 10)), Axis("dimension", (1, 2))
    plan = Plan("sine", axes, ("condensation", "kalman"), 3, frames=9)
    made = write_report(carry_out(plan, tmp_path / "sine.parquet"), tmp_path / "sine")
    assert {"error.png", "curves.png"} <= {path.name for path in made.files}
    assert "success.png" not in {path.name for path in made.files}
    assert [table.quantity for table in made.tables if table.quantity] == ["error"]
    assert "<h2>Success" not in made.page.read_text()
    single = write_report(carry_out(Plan("sine", trials=2, frames=5), tmp_path / "one.parquet"), tmp_path / "one")
    assert {path.name for path in single.files} == {"tables.csv", "index.html"}


def test_axes_are_chosen_or_named(finished: Result) -> None:
    """The first two numerical axes span the maps, a single one goes across; others may be named if they are there."""
    study = Study.of(finished)
    assert study.names == ("occlusion_width_px", "distracter_radius_px")
    assert study.level == 0.01
    single = Result(replace(finished.plan, axes=finished.plan.axes[:1]), finished.files, complete=True)
    assert Study.of(single).names == Study.of(single, y="occlusion_width_px").names == ("occlusion_width_px", None)
    assert Study.of(finished, x="distracter_radius_px").names == ("distracter_radius_px", "occlusion_width_px")
    with pytest.raises(SweepError, match="no axis 'width'"):
        Study.of(finished, x="width")


def test_a_sweep_is_exported_as_table_and_as_pictures(finished: Result, tmp_path: Path) -> None:
    """All rows as CSV, curves at 300 dots an inch and a map whose letters are letters, each with plan and units."""
    table, beside = export_result(finished, tmp_path / "rows.csv")
    assert len(table.read_text().splitlines()) == finished.plan.runs + 1
    told = json.loads(beside.read_text())
    assert Plan.from_dict(told["plan"]) == finished.plan
    assert told["runs"] == {"computed": finished.plan.runs, "of": finished.plan.runs}
    assert {it["name"]: it["unit"] for it in told["quantities"]}["mean_error"] == "px"
    export_result(finished, tmp_path / "curves.png", plot="curves")
    with Image.open(tmp_path / "curves.png") as picture:
        assert picture.info["dpi"][0] == pytest.approx(300, abs=0.1)
        assert json.loads(picture.info["pftrack"]) == told
    (drawn,) = export_result(finished, tmp_path / "map.svg", plot="error")
    assert "px" in "".join(re.findall(r"<text[^>]*>([^<]*)</text>", drawn.read_text()))


def test_what_a_sweep_cannot_be_exported_as(finished: Result, tmp_path: Path) -> None:
    """It is refused with what exists; a sweep that has not computed anything has nothing to report."""
    for name, plot, words in (
        ("map.png", None, "the plots of this sweep are curves, success, error.*; say which one is wanted"),
        ("map.png", "gain", "got 'gain'"),
        ("rows.csv", "error", "a plot can be written as a picture"),
        ("rows.xlsx", None, r"a sweep can be exported as \.csv"),
        ("nowhere/rows.csv", None, "the folder .* does not exist"),
    ):
        with pytest.raises(ConflictError, match=words):
            export_result(finished, tmp_path / name, plot=plot)
    assert list(tmp_path.iterdir()) == []
    begin(finished.plan, tmp_path / "new.parquet")
    with pytest.raises(SweepError, match="no rows yet"):
        write_report(read_result(tmp_path / "new.parquet"), tmp_path / "report")


# The pictures of a report: what they show is where it belongs, and every text has its room.


@pytest.fixture(scope="module")
def counted(tmp_path_factory: pytest.TempPathFactory) -> Result:
    """A sweep with one axis of numbers."""
    plan = Plan("ball", (Axis("sample_count", (20, 50, 100)),), ("h-spf", "s-spf"), trials=6, frames=10)
    return carry_out(plan, tmp_path_factory.mktemp("counted") / "counted.parquet", jobs=1)


def test_maps_have_the_colours_of_their_cells(finished: Result) -> None:
    """Every cell of every map has the colour of its value in its middle, and every text has its room."""
    study = Study.of(finished, level=0.2)
    for name in ("success", "error"):
        figure = figures(study)[name]()
        assert_readable(figure)
        buffer = io.BytesIO()
        figure.savefig(buffer, dpi=100)
        picture = np.asarray(Image.open(buffer).convert("RGB"))
        for panel, image in maps_of(figure):
            cells = image.get_array()
            expected = image.cmap(image.norm(cells), bytes=True)[..., :3]
            for row, column in np.ndindex(*cells.shape):
                x, y = panel.transData.transform((column, row)) * 100 / figure.dpi
                found = picture[picture.shape[0] - int(y) - 1, int(x)]
                if not np.ma.getmaskarray(cells)[row, column]:
                    assert np.abs(found.astype(int) - expected[row, column]).max() <= 1, (name, row, column)


def maps_of(figure: Figure) -> list[tuple[Axes, AxesImage]]:
    """Return the maps of a figure with their panels."""
    return [(panel, image) for panel in figure.axes for image in panel.images]


def texts_of(figure: Figure) -> Iterator[Text]:
    """Yield what can be read on a figure."""
    for part in figure.subfigs:
        yield from part.texts
        for key in part.legends:
            yield from key.get_texts()
    for panel in figure.axes:
        if panel.axison and panel.get_visible():
            yield from (panel.title, panel.xaxis.label, panel.yaxis.label)
            for axis in (panel.xaxis, panel.yaxis):
                low, high = sorted(axis.get_view_interval())
                for tick in (tick for tick in axis.get_major_ticks() if low <= tick.get_loc() <= high):
                    yield from (tick.label1, tick.label2)


def assert_readable(figure: Figure) -> None:
    """No text reaches beyond the figure, onto a map, or onto another text."""
    figure.draw_without_rendering()
    texts = [text for text in texts_of(figure) if text.get_visible() and text.get_text()]
    boxes = [(text.get_text(), text.get_window_extent()) for text in texts]
    for text, box in boxes:
        assert figure.bbox.x0 <= box.x0 <= box.x1 <= figure.bbox.x1, text
        assert figure.bbox.y0 <= box.y0 <= box.y1 <= figure.bbox.y1, text
    maps = [("a map", image.get_window_extent()) for _, image in maps_of(figure)]
    for (one, first), (other, second) in combinations([*boxes, *maps], 2):
        common = Bbox.intersection(first, second)
        assert common is None or min(common.width, common.height) <= 1, (one, other)


def test_one_axis_of_numbers_gives_boxes(counted: Result) -> None:
    """Every quantity has a picture of boxes and, below, of differences; there is no map of a single row.

    A box has the quartiles of its runs. Boxes stand side by side by tracker, around their value of the axis; the scale
    begins at 0. With many values boxes become narrow rather than the picture endless.
    """
    plan, study = counted.plan, Study.of(counted)
    drawn = figures(study)
    measures = {f"measure-{it.name}" for it in plan.wiring.run_measures}
    assert set(drawn) == {"curves", "success", "error", *measures}
    boxes, differences = drawn["measure-median_error_px"]().axes
    assert (boxes.get_ylabel(), len(boxes.patches)) == ("Median error, px", 2 * 3)
    assert differences.get_ylabel() == "Difference, px, + if 1 is better"
    values = samples(counted, quantity_named(plan, "median_error_px"), "sample_count").values
    for tracker, aside, container in zip(("h-spf", "s-spf"), (-0.2, 0.2), boxes.containers, strict=True):
        for place, (patch, runs) in enumerate(zip(container.patches, values[tracker], strict=True)):
            ends = patch.get_y(), patch.get_y() + patch.get_height()
            assert ends == pytest.approx(np.quantile(runs, (0.25, 0.75)))
            assert patch.get_x() + patch.get_width() / 2 == pytest.approx(place + aside)
    assert boxes.get_ylim()[0] == 0.0
    many = replace(plan, axes=(Axis("sample_count", tuple(range(1, 1001))),))
    figure = figures(Study.of(replace(counted, plan=many)))["error"]()
    assert figure.get_size_inches()[0] <= 20
    assert_readable(figure)


def test_curves_have_an_axis_each(finished: Result) -> None:
    """The rates along every axis that was varied, with a band of their interval by tracker."""
    study = Study.of(finished)
    figure = curves(study, list(finished.plan.axes))
    assert [panel.get_xlabel() for panel in figure.axes] == ["Occluder width, px", "Look-alike radius, px"]
    for panel, axis in zip(figure.axes, finished.plan.axes, strict=True):
        for line, name in zip(panel.lines, finished.plan.trackers, strict=True):
            assert line.get_xdata().tolist() == list(axis.values)
            assert line.get_ydata() == pytest.approx(study.by_axis[axis.name][name].rate[0])
        assert len(panel.collections) == 2
    twice = curves(study, [*finished.plan.axes] * 3)
    assert_readable(twice)
    above, below = (panel.get_position() for panel in (twice.axes[0], twice.axes[3]))
    assert below.y1 < above.y0


# The page of a report: it needs nothing else, and has the tables, the figures and what they mean.


def test_the_page_needs_nothing_else(report: Report, finished: Result) -> None:
    """It loads no address, has the tables' numbers, and each picture that lies beside it.

    There is a picture each of success, the error and every measure, large enough and not of one colour, and one of
    curves.

    The share of false alarms is that of the level asked for, and cells that were not tested are not counted.
    """
    text, names = report.page.read_text(), {path.name for path in report.files}
    measures = {f"measure-{measure.name}.png" for measure in EXPERIMENTS["ball"].run_measures}
    assert names == measures | {"success.png", "error.png", "curves.png", "tables.csv", "index.html"}
    assert {path.name for path in report.page.parent.iterdir()} == names
    for path in (path for path in report.files if path.suffix == ".png"):
        with Image.open(path) as picture:
            assert min(picture.size) >= 400, path.name
            assert len(np.unique(np.asarray(picture.convert("L")))) > 20, path.name
    addresses = re.findall(r"""(?:src|href)="([^"]*)"|(<link|<script|@import|url\()""", text)
    assert all(address.startswith("data:image/png;base64,") for address, _ in addresses)
    assert len(addresses) == sum(path.suffix == ".png" for path in report.files)
    for table in report.tables:
        for cell in table.rows[0]:
            assert f"<td>{cell}</td>" in text
    (pair,) = Study.of(finished).comparisons["success"]
    codes = pair.significance(0.2).codes
    kinds = Code.FIRST_BETTER, Code.SECOND_BETTER, Code.NOT_APPLICABLE
    first, second, untested = (int((codes == it).sum()) for it in kinds)
    assert "up to 20 % come out as significant by chance" in text
    assert f"<span>h-spf {first}, condensation {second} of {codes.size - untested} tested</span>" in text


@pytest.mark.browser
def test_the_page_is_read_without_a_network(report: Report, chromium: Browser) -> None:
    """Pictures are shown, a section unfolds, and nothing reaches beyond a narrow page."""
    page = chromium.new_page(viewport={"width": 1280, "height": 900}, offline=True)
    faults: list[str] = []
    page.on("pageerror", lambda error: faults.append(str(error)))
    page.on("requestfailed", lambda request: faults.append(request.url))
    page.goto(report.page.as_uri())
    assert page.locator("details[open]").count() == 2
    assert page.locator("#success img").evaluate("picture => picture.naturalWidth") > 640
    page.locator("#median_error_px summary").click()
    assert page.locator("#median_error_px img").is_visible()
    for width in (1280, 390):
        page.set_viewport_size({"width": width, "height": 900})
        assert page.evaluate("document.documentElement.scrollWidth") == width
    assert not faults
    page.close()
