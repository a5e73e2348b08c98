"""Reports: tables that say what the rows say, figures that are pictures, and a page that needs nothing else."""

import csv
import json
import re
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pytest
from PIL import Image

from pftrack.core.refusal import ConflictError
from pftrack.experiments import EXPERIMENTS
from pftrack.sweep import Plan, Result, begin, carry_out, compare, read_result
from pftrack.sweep.axis import Axis, SweepError
from pftrack.sweep.cells import cells, quantities, quantity_named, samples
from pftrack.sweep.report.files import (
    Report,
    export_result,
    figures,
    page,
    scale_of,
    write_report,
)
from pftrack.sweep.report.study import Study, tables


def test_a_report_has_all_its_files(report: Report) -> None:
    """A picture each of success, the error and every measure, curves, tables, and the page."""
    names = {path.name for path in report.files}
    measures = {f"measure-{measure.name}.png" for measure in EXPERIMENTS["ball"].run_measures}
    assert names == measures | {"success.png", "error.png", "curves.png", "tables.csv", "index.html"}
    assert {path.name for path in report.page.parent.iterdir()} == names


def test_every_figure_is_a_picture_with_something_on_it(report: Report) -> None:
    """Each opens, is large enough to be shown, and is not of one colour."""
    for path in report.files:
        if path.suffix == ".png":
            with Image.open(path) as picture:
                assert min(picture.size) >= 400, path.name
                assert len(np.unique(np.asarray(picture.convert("L")))) > 20, path.name


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


@pytest.mark.parametrize(
    ("means", "ends"),
    [
        ([[2.0, np.nan], [5.0, 3.0]], (0.0, 5.0)),
        ([[-2.0, 1.0]], (-2.0, 1.0)),
        ([[-2.0, -1.0]], (-2.0, 0.0)),
        ([[0.0, np.nan]], (0.0, 1.0)),
        ([[np.nan]], (0.0, 1.0)),
    ],
)
def test_a_scale_reaches_from_zero_to_all_means(
    plan: Plan, means: list[list[float]], ends: tuple[float, float]
) -> None:
    """Negative means are on it too; a share has all of 0 to 1, whatever its means."""
    maps = [np.array([row]) for row in means]
    assert scale_of(quantity_named(plan, "median_error_px"), maps) == ends
    assert scale_of(quantity_named(plan, "inside_share"), maps) == (0.0, 1.0)


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
            "Chi-square" if quantity.name == "success" else "Rank-sum",
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
    assert compared.rows[0][1:] == ("", "", "0", "Rank-sum", "not applicable", "0 (0)", "0 (0)", "0 (0)", "8")
    assert sum(len(panel.images) for panel in figures(study)["measure-inside_share"]().axes) == 4
    assert "not applicable" in page(study, made, {})


def test_an_experiment_without_verdicts_has_a_report_of_errors(tmp_path: Path) -> None:
    """Where nothing is lost or won, tables and figures are of errors alone, and one condition needs no figure."""
    plan = Plan(
        "sine", (Axis("sample_count", (5, 10)), Axis("dimension", (1, 2))), ("condensation", "kalman"), 3, frames=9
    )
    made = write_report(carry_out(plan, tmp_path / "sine.parquet"), tmp_path / "sine")
    assert {"error.png", "curves.png"} <= {path.name for path in made.files}
    assert "success.png" not in {path.name for path in made.files}
    assert not any("success" in table.title.lower() for table in made.tables)
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
    for named in ({}, {"x": "occlusion_width_px"}, {"y": "occlusion_width_px"}):
        assert Study.of(single, **named).names == ("occlusion_width_px", None)
    assert Study.of(finished, x="distracter_radius_px").names == ("distracter_radius_px", "occlusion_width_px")
    with pytest.raises(SweepError, match="no axis 'width'"):
        Study.of(finished, x="width")
    with pytest.raises(SweepError, match="two different axes"):
        Study.of(finished, x="occlusion_width_px", y="occlusion_width_px")


def test_a_report_of_nothing_is_refused(plan: Plan, tmp_path: Path) -> None:
    """A sweep that has not computed anything has nothing to report."""
    begin(plan, tmp_path / "new.parquet")
    with pytest.raises(SweepError, match="no rows yet"):
        write_report(read_result(tmp_path / "new.parquet"), tmp_path / "report")
    assert not (tmp_path / "report").exists()


def test_a_sweep_is_exported_as_table_and_as_pictures(finished: Result, tmp_path: Path) -> None:
    """All rows as CSV, a map at 300 dots an inch and one whose letters are letters, each with plan and units."""
    table, beside = export_result(finished, tmp_path / "rows.csv")
    assert len(table.read_text().splitlines()) == finished.plan.runs + 1
    told = json.loads(beside.read_text())
    assert Plan.from_dict(told["plan"]) == finished.plan
    assert told["runs"] == {"computed": finished.plan.runs, "of": finished.plan.runs}
    assert {it["name"]: it["unit"] for it in told["quantities"]}["mean_error"] == "px"
    export_result(finished, tmp_path / "map.png", plot="success")
    with Image.open(tmp_path / "map.png") as picture:
        assert picture.info["dpi"][0] == pytest.approx(300, abs=0.1)
        assert json.loads(picture.info["pftrack"]) == told
    (drawn,) = export_result(finished, tmp_path / "map.svg", plot="error")
    assert "px" in "".join(re.findall(r"<text[^>]*>([^<]*)</text>", drawn.read_text()))


@pytest.mark.parametrize(
    ("name", "plot", "words"),
    [
        ("map.png", None, "the plots of this sweep are curves, success, error.*; say which one is wanted"),
        ("map.png", "gain", "got 'gain'"),
        ("rows.csv", "error", "a plot can be written as a picture"),
        ("rows.xlsx", None, r"a sweep can be exported as \.csv"),
        ("nowhere/rows.csv", None, "the folder .* does not exist"),
    ],
)
def test_what_a_sweep_cannot_be_exported_as(
    finished: Result, tmp_path: Path, name: str, plot: str | None, words: str
) -> None:
    """It is refused with what there is."""
    with pytest.raises(ConflictError, match=words):
        export_result(finished, tmp_path / name, plot=plot)
    assert list(tmp_path.iterdir()) == []
