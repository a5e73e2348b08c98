"""Files of a sweep: whole or not there, never overwritten; foreign ones are told and left alone, all read in pieces."""

import csv
import io
import json
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from pftrack import __version__
from pftrack.sweep import Plan, Result, begin, carry_out, partial_of, read_result, resume, rows_of, summary
from pftrack.sweep.axis import SweepError
from pftrack.sweep.journal import METADATA, csv_pieces, read_chunk
from pftrack.sweep.table import Chunks
from pftrack.sweep.work import as_text, compute_chunk

computed = cache(compute_chunk)


def half_done(plan: Plan, out: Path) -> Path:
    """Begin a sweep and compute its first and third chunk, once for all tests; return the folder."""
    journal = begin(plan, out)
    chunks = Chunks.of(plan, 24)
    journal.cut(chunks)
    for number in (0, 2):
        journal.keep(chunks[number], computed(as_text(plan), chunks.conditions, chunks.trials, number))
    return journal.folder


def test_a_sweep_writes_its_plan(plan: Plan, finished: Result, tmp_path: Path) -> None:
    """Before anything is computed the folder beside the result has the plan, and the finished file has it as well.

    Resuming a finished sweep computes nothing.
    """
    journal = begin(plan, tmp_path / "new.parquet")
    assert journal.folder == partial_of(tmp_path / "new.parquet") == tmp_path / "new.parquet.partial"
    told = {"format": "pftrack-sweep", "version": 1, "pftrack": __version__, "plan": plan.as_dict()}
    assert json.loads((journal.folder / "plan.json").read_text()) == told
    assert resume(tmp_path / "new.parquet").plan == resume(journal.folder).plan == plan
    assert not journal.finished
    raw = json.loads(pq.read_schema(finished.path).metadata[METADATA])
    assert Plan.from_dict(raw["plan"]) == plan
    before = finished.path.stat().st_mtime_ns
    assert carry_out(None, finished.path).complete
    assert finished.path.stat().st_mtime_ns == before


def test_a_damaged_chunk_is_computed_again(plan: Plan, finished: Result, tmp_path: Path) -> None:
    """Damage in the middle does not come into the result, and its file is named, so that it can be removed.

    A begun sweep is read by the result's name or the folder's, in the order of the runs. A chunk that was cut short
    counts as not there, for readers and for the driver. A file that a person put into the folder stays.
    """
    out = tmp_path / "cut.parquet"
    folder = half_done(plan, out)
    for path in (out, folder):
        result = read_result(path)
        assert (result.complete, result.table["run"].to_pylist()) == (False, [*range(24), *range(48, 72)])
    spoilt = folder / "000002.parquet"
    assert read_chunk(spoilt)["run"].to_pylist() == list(range(48, 72))
    data = spoilt.read_bytes()
    spoilt.write_bytes(data[:400] + bytes(100) + data[500:])
    with pytest.raises(SweepError, match=r"000002\.parquet is damaged; remove it and continue with --resume"):
        carry_out(None, out)
    assert not out.exists()
    spoilt.write_bytes(data[: len(data) // 2])
    (folder / "000003.part").write_bytes(data[:100])
    (folder / "notes.txt").write_text("keep me")
    # All but the damaged one have been computed meanwhile.
    assert read_result(folder).table["run"].to_pylist() == [*range(48), *range(72, plan.runs)]
    with pytest.raises(SweepError, match="was cut short"):
        read_chunk(spoilt)
    seen: list[int] = []
    result = carry_out(None, out, progress=lambda progress: seen.append(progress.done))
    assert seen[0] == plan.runs - 24
    assert result.table.drop_columns("step_ms") == finished.table.drop_columns("step_ms")
    assert [path.name for path in folder.iterdir()] == ["notes.txt"]


def packed(table: pa.Table) -> bytes:
    sink = io.BytesIO()
    pq.write_table(table, sink)
    return sink.getvalue()


def test_what_is_no_result_is_told_and_left_alone(finished: Result, tmp_path: Path) -> None:
    """Foreign, damaged, newer and missing files are refused with a sentence, for reading as for resuming.

    A new sweep overwrites neither a result nor a sweep that was begun.
    """
    data, described = finished.path.read_bytes(), json.loads(pq.read_schema(finished.path).metadata[METADATA])
    newer, broken = (
        packed(finished.table.replace_schema_metadata({METADATA: json.dumps({**described, **changes}).encode()}))
        for changes in ({"version": 2}, {"plan": {"experiment": "x"}})
    )
    wrong = {
        b"run,seed\n1,2\n": "is not a Parquet file, or was cut short",
        data[: len(data) // 2]: "is not a Parquet file, or was cut short",
        packed(pa.table({"run": [1]})): "is a Parquet file, but none that a sweep wrote",
        newer: "is of format 2, this version of pftrack reads format 1",
        broken: "does not fit this version of pftrack",
    }
    path = tmp_path / "wrong.parquet"
    for content, reason in wrong.items():
        path.write_bytes(content)
        for use in (read_result, resume):
            with pytest.raises(SweepError, match=reason):
                use(path)
        assert path.read_bytes() == content
    with pytest.raises(SweepError, match="exists already; a sweep overwrites nothing"):
        begin(finished.plan, finished.path)
    half_done(finished.plan, tmp_path / "begun.parquet")
    with pytest.raises(SweepError, match="was begun already; continue with --resume"):
        begin(finished.plan, tmp_path / "begun.parquet")
    with pytest.raises(SweepError, match="neither finished nor begun"):
        resume(tmp_path / "none.parquet")
    with pytest.raises(SweepError, match=r"the file .* does not exist"):
        read_result(tmp_path / "none.parquet")
    (tmp_path / "bare.parquet.partial").mkdir()
    with pytest.raises(SweepError, match=r"it has no plan\.json"):
        resume(tmp_path / "bare.parquet")


def test_a_folder_that_cannot_be_understood_is_refused(plan: Plan, tmp_path: Path) -> None:
    """A damaged plan or division into chunks, a chunk of another sweep: each is told, and nothing is touched.

    Rows of two versions would not compare, so what one began another reads, and does not finish.
    """
    out = tmp_path / "one.parquet"
    folder = half_done(plan, out)
    described = json.loads((folder / "plan.json").read_text())
    older = json.dumps({**described, "pftrack": "0.0.9"}).encode()
    strange = half_done(replace(plan, seed=99), tmp_path / "two.parquet") / "000000.parquet"
    for name, content, reason in (
        ("000001.parquet", strange.read_bytes(), r"000001\.parquet belongs to another sweep; move it away"),
        ("plan.json", b"{", "was cut short"),
        ("plan.json", b'{"format": "other"}', "describes no sweep"),
        ("chunks.json", b'{"conditions": ', "does not hold the division into chunks"),
        ("plan.json", older, rf"begun with pftrack 0\.0\.9, this is {__version__}"),
    ):
        path = folder / name
        before = path.read_bytes() if path.exists() else None
        path.write_bytes(content)
        with pytest.raises(SweepError, match=reason):
            carry_out(None, out)
        assert path.read_bytes() == content
        if content == older:
            assert len(read_result(out).table) == 48
        path.unlink() if before is None else path.write_bytes(before)
        assert (folder / "000000.parquet").exists()


# Results: rows, summaries and CSV, read in pieces.


def test_rows_of_a_cell_come_failures_first(finished: Result) -> None:
    """A cell's runs are those of its condition and tracker, failures before successes, by number.

    An unknown column is refused with the columns that exist; a summary counts all runs, and those of each tracker.
    """
    where = {"tracker": "h-spf", "occlusion_width_px": 40.0}
    rows = rows_of(finished, where)
    wanted = [row for row in finished.table.to_pylist() if all(row[name] == value for name, value in where.items())]
    wanted.sort(key=lambda row: (row["success"], row["run"]))
    assert [row["run"] for row in rows] == [row["run"] for row in wanted]
    assert rows_of(finished, where, limit=3) == rows[:3]
    in_order = rows_of(finished, where, failures_first=False)
    assert [row["run"] for row in in_order] == sorted(row["run"] for row in rows)
    assert all(len(row["estimates_sha256"]) == 64 for row in rows)
    with pytest.raises(SweepError, match="no column 'width'; it has run, occlusion_width_px"):
        rows_of(finished, {"width": 5})
    found, all_rows = summary(finished), finished.table.to_pylist()
    assert (found["runs"], found["problems"]) == (len(all_rows), 0)
    assert found["success_rate"] == pytest.approx(np.mean([row["success"] for row in all_rows]))
    of_tracker = [row["success"] for row in all_rows if row["tracker"] == "h-spf"]
    assert found["success_rate_by_tracker"]["h-spf"] == pytest.approx(np.mean(of_tracker))


def csv_of(result: Result) -> list[dict[str, str]]:
    return list(csv.DictReader(io.StringIO(b"".join(csv_pieces(result)).decode())))


def test_csv_holds_the_same_rows(finished: Result, tmp_path: Path) -> None:
    """A header once, then every row; hashes as hexadecimal digits.

    A sentence about a run that failed may hold anything: a spreadsheet computes nothing of it, and the result's rows
    keep it as it is.
    """
    table = finished.table
    for row, expected in zip(csv_of(finished), table.to_pylist(), strict=True):
        assert row["estimates_sha256"] == expected["estimates_sha256"].hex()
        assert (int(row["run"]), int(row["seed"])) == (expected["run"], expected["seed"])
        assert float(row["mean_error"]) == expected["mean_error"]
        assert row["success"] == str(expected["success"]).lower()
        assert row["problem"] == ""
    path, place = tmp_path / "wrong.parquet", table.schema.get_field_index("problem")
    texts = pa.array(["=1+1", "fails: -1", *[None] * (len(table) - 2)], pa.string())
    metadata = pq.read_schema(finished.files[0]).metadata
    pq.write_table(table.set_column(place, "problem", texts).replace_schema_metadata(metadata), path)
    assert [row["problem"] for row in csv_of(read_result(path))[:3]] == ["'=1+1", "fails: -1", ""]
    assert read_result(path).table["problem"][0].as_py() == "=1+1"


def test_pieces_are_read_by_column(finished: Result, plan: Plan, tmp_path: Path) -> None:
    """Only what is asked for is read, and metadata does not travel with it; bytes that changed on the disk are told."""
    (piece,) = finished.pieces(["run", "tracker"])
    assert (piece.column_names, len(piece), piece.schema.metadata) == (["run", "tracker"], plan.runs, None)
    path = tmp_path / "damaged.parquet"
    data = bytearray(finished.path.read_bytes())
    data[len(data) // 4 : len(data) // 3] = bytes(len(data) // 3 - len(data) // 4)
    path.write_bytes(data)
    with pytest.raises(SweepError, match=r"damaged\.parquet is damaged"):
        _ = read_result(path).table
