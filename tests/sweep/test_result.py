"""Results: rows, summaries and CSV, read in pieces."""

import csv
import io
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from pftrack.sweep import Plan, Result, read_result, rows_of, summary
from pftrack.sweep.axis import SweepError
from pftrack.sweep.journal import csv_pieces


def test_rows_of_a_cell_come_failures_first(finished: Result) -> None:
    """A cell's runs are those of its condition and tracker, failures before successes, by number."""
    where = {"tracker": "h-spf", "occlusion_width_px": 40.0}
    rows = rows_of(finished, where)
    wanted = [row for row in finished.table.to_pylist() if all(row[name] == value for name, value in where.items())]
    assert [row["run"] for row in rows] == [
        row["run"] for row in sorted(wanted, key=lambda row: (row["success"], row["run"]))
    ]
    assert len(rows) == 12
    assert rows_of(finished, where, limit=3) == rows[:3]
    in_order = rows_of(finished, where, failures_first=False)
    assert [row["run"] for row in in_order] == sorted(row["run"] for row in rows)
    assert all(len(row["estimates_sha256"]) == 64 for row in rows)


def test_rows_of_an_unknown_column_are_refused(finished: Result) -> None:
    """The sentence names the columns that there are."""
    with pytest.raises(SweepError, match="no column 'width'; it has run, occlusion_width_px"):
        rows_of(finished, {"width": 5})


def test_a_summary_counts_all_runs(finished: Result, plan: Plan) -> None:
    """Success over all runs and by tracker is what counting the rows gives."""
    rows = finished.table.to_pylist()
    found = summary(finished)
    assert (found["runs"], found["problems"]) == (plan.runs, 0)
    assert found["success_rate"] == pytest.approx(sum(row["success"] for row in rows) / len(rows))
    for tracker, rate in found["success_rate_by_tracker"].items():
        of_tracker = [row["success"] for row in rows if row["tracker"] == tracker]
        assert rate == pytest.approx(sum(of_tracker) / len(of_tracker))


def test_csv_holds_the_same_rows(finished: Result) -> None:
    """A header once, then every row; hashes as hexadecimal digits."""
    rows = list(csv.DictReader(io.StringIO(b"".join(csv_pieces(finished)).decode())))
    known = finished.table.to_pylist()
    assert len(rows) == len(known)
    for row, expected in zip(rows, known, strict=True):
        assert row["estimates_sha256"] == expected["estimates_sha256"].hex()
        assert (int(row["run"]), int(row["seed"])) == (expected["run"], expected["seed"])
        assert float(row["mean_error"]) == expected["mean_error"]
        assert row["success"] == str(expected["success"]).lower()
        assert row["problem"] == ""


def test_a_spreadsheet_computes_no_problem(finished: Result, tmp_path: Path) -> None:
    """A sentence about a run that failed may hold anything; the file's rows keep it as it is."""
    table = finished.table
    place = table.schema.get_field_index("problem")
    path = tmp_path / "wrong.parquet"
    texts = pa.array(["=1+1", "fails: -1", *[None] * (len(table) - 2)], pa.string())
    metadata = pq.read_schema(finished.files[0]).metadata
    pq.write_table(table.set_column(place, "problem", texts).replace_schema_metadata(metadata), path)
    rows = list(csv.DictReader(io.StringIO(b"".join(csv_pieces(read_result(path))).decode())))
    assert [row["problem"] for row in rows[:3]] == ["'=1+1", "fails: -1", ""]
    assert read_result(path).table["problem"][0].as_py() == "=1+1"


def test_pieces_are_read_by_column(finished: Result, plan: Plan) -> None:
    """Only what is asked for is read, and metadata does not travel with it."""
    pieces = list(finished.pieces(["run", "tracker"]))
    assert [piece.column_names for piece in pieces] == [["run", "tracker"]]
    assert len(pa.concat_tables(pieces)) == plan.runs
    assert pieces[0].schema.metadata is None


def test_damage_in_the_middle_is_found(finished: Result, tmp_path: Path) -> None:
    """Bytes that changed on the disk are told, not read as other numbers."""
    path = tmp_path / "damaged.parquet"
    data = bytearray(finished.path.read_bytes())
    data[len(data) // 4 : len(data) // 3] = bytes(len(data) // 3 - len(data) // 4)
    path.write_bytes(data)
    with pytest.raises(SweepError, match=r"damaged\.parquet is damaged"):
        _ = read_result(path).table
