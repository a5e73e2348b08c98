"""Files of a sweep: whole or not there, never overwritten; foreign ones are told and left alone, all read in pieces."""

import csv
import io
import json
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from pftrack import __version__
from pftrack.sweep import Plan, Result, begin, carry_out, partial_of, read_result, resume, rows_of, summary
from pftrack.sweep.axis import SweepError
from pftrack.sweep.journal import METADATA, csv_pieces, read_chunk
from pftrack.sweep.table import Chunks
from pftrack.sweep.work import as_text, compute_chunk


def half_done(plan: Plan, out: Path) -> Path:
    """Begin a sweep and compute its first and third chunk; return the folder."""
    journal = begin(plan, out)
    chunks = Chunks.of(plan, 24)
    journal.cut(chunks)
    for number in (0, 2):
        journal.keep(chunks[number], compute_chunk(as_text(plan), chunks.conditions, chunks.trials, number))
    return journal.folder


def test_a_new_sweep_writes_its_plan(plan: Plan, tmp_path: Path) -> None:
    """Before anything is computed the folder beside the result says what will be."""
    journal = begin(plan, tmp_path / "new.parquet")
    assert journal.folder == partial_of(tmp_path / "new.parquet") == tmp_path / "new.parquet.partial"
    assert json.loads((journal.folder / "plan.json").read_text()) == {
        "format": "pftrack-sweep",
        "version": 1,
        "pftrack": __version__,
        "plan": plan.as_dict(),
    }
    assert resume(tmp_path / "new.parquet").plan == resume(journal.folder).plan == plan
    assert not journal.finished


def test_nothing_is_overwritten(plan: Plan, finished: Result, tmp_path: Path) -> None:
    """A result that exists and a sweep that was begun are refused, and stay as they are."""
    before = finished.path.read_bytes()
    with pytest.raises(SweepError, match="exists already; a sweep overwrites nothing"):
        begin(plan, finished.path)
    assert finished.path.read_bytes() == before
    folder = half_done(plan, tmp_path / "begun.parquet")
    held = sorted(folder.iterdir())
    with pytest.raises(SweepError, match="was begun already; continue with --resume"):
        begin(plan, tmp_path / "begun.parquet")
    assert sorted(folder.iterdir()) == held


def test_a_finished_result_says_what_it_is(plan: Plan, finished: Result) -> None:
    """The plan travels in the file, and resuming a finished sweep computes nothing."""
    raw = json.loads(pq.read_schema(finished.path).metadata[METADATA])
    assert Plan.from_dict(raw["plan"]) == plan
    before = finished.path.stat().st_mtime_ns
    assert carry_out(None, finished.path).complete
    assert finished.path.stat().st_mtime_ns == before


def test_a_begun_sweep_can_be_read(plan: Plan, finished: Result, tmp_path: Path) -> None:
    """What is there so far is read by the result's name or the folder's, in the order of the runs."""
    folder = half_done(plan, tmp_path / "half.parquet")
    for path in (tmp_path / "half.parquet", folder):
        result = read_result(path)
        assert not result.complete
        assert result.table["run"].to_pylist() == [*range(24), *range(48, 72)]
    assert read_chunk(folder / "000002.parquet")["run"].to_pylist() == list(range(48, 72))
    columns = ["run", "seed", "estimates_sha256"]
    known = finished.table.select(columns).to_pylist()
    assert read_result(folder).table.select(columns).to_pylist() == known[:24] + known[48:72]


def test_a_chunk_that_was_cut_short_is_computed_again(plan: Plan, finished: Result, tmp_path: Path) -> None:
    """A damaged or half-written chunk counts as not there, for readers and for the driver."""
    folder = half_done(plan, tmp_path / "cut.parquet")
    data = (folder / "000002.parquet").read_bytes()
    (folder / "000002.parquet").write_bytes(data[: len(data) // 2])
    (folder / "000003.part").write_bytes(data[:100])
    assert read_result(folder).table["run"].to_pylist() == list(range(24))
    with pytest.raises(SweepError, match="was cut short"):
        read_chunk(folder / "000002.parquet")
    seen: list[int] = []
    result = carry_out(None, tmp_path / "cut.parquet", progress=lambda progress: seen.append(progress.done))
    assert seen[0] == 24
    assert result.table.drop_columns("step_ms") == finished.table.drop_columns("step_ms")
    assert not folder.exists()


def test_files_of_others_stay(plan: Plan, tmp_path: Path) -> None:
    """A file that somebody put into the folder is not removed with the sweep's own."""
    folder = half_done(plan, tmp_path / "mine.parquet")
    (folder / "notes.txt").write_text("keep me")
    assert carry_out(None, tmp_path / "mine.parquet").complete
    assert [path.name for path in folder.iterdir()] == ["notes.txt"]


def test_a_chunk_of_another_sweep_is_refused(plan: Plan, tmp_path: Path) -> None:
    """A chunk that belongs to another plan ends the resumption with its name, and is not touched."""
    folder = half_done(plan, tmp_path / "one.parquet")
    other = Plan("ball", plan.axes, plan.trackers, plan.trials, seed=99, frames=plan.frames, values=plan.values)
    strange = half_done(other, tmp_path / "two.parquet") / "000000.parquet"
    (folder / "000001.parquet").write_bytes(strange.read_bytes())
    with pytest.raises(SweepError, match=r"000001\.parquet belongs to another sweep; move it away"):
        carry_out(None, tmp_path / "one.parquet")
    assert (folder / "000001.parquet").read_bytes() == strange.read_bytes()


def foreign(folder: Path, finished: Result) -> dict[str, Path]:
    """Make files that are no results."""
    data = finished.path.read_bytes()
    paths = {name: folder / f"{name}.parquet" for name in ("text", "empty", "short", "strange", "newer", "broken")}
    paths["text"].write_text("run,seed\n1,2\n")
    paths["empty"].write_bytes(b"")
    paths["short"].write_bytes(data[: len(data) // 2])
    pq.write_table(pa.table({"run": [1]}), paths["strange"])
    described = json.loads(pq.read_schema(finished.path).metadata[METADATA])
    for name, raw in (("newer", {**described, "version": 2}), ("broken", {**described, "plan": {"experiment": "x"}})):
        marked = finished.table.replace_schema_metadata({METADATA: json.dumps(raw).encode()})
        pq.write_table(marked, paths[name])
    return paths


@pytest.mark.parametrize(
    ("name", "reason"),
    [
        ("text", "is not a Parquet file, or was cut short"),
        ("empty", "is not a Parquet file, or was cut short"),
        ("short", "is not a Parquet file, or was cut short"),
        ("strange", "is a Parquet file, but none that a sweep wrote"),
        ("newer", "is of format 2, this version of pftrack reads format 1"),
        ("broken", "does not fit this version of pftrack"),
    ],
)
def test_what_is_no_result_is_told_and_left_alone(name: str, reason: str, finished: Result, tmp_path: Path) -> None:
    """Foreign, damaged and newer files are refused with a sentence, for reading as for resuming."""
    path = foreign(tmp_path, finished)[name]
    before = path.read_bytes()
    for use in (read_result, resume):
        with pytest.raises(SweepError) as refused:
            use(path)
        assert reason in str(refused.value)
    assert path.read_bytes() == before


def test_what_is_not_there_is_told(tmp_path: Path) -> None:
    """Neither a result nor a folder: the sentence says so."""
    with pytest.raises(SweepError, match="neither finished nor begun"):
        resume(tmp_path / "none.parquet")
    with pytest.raises(SweepError, match=r"the file .* does not exist"):
        read_result(tmp_path / "none.parquet")
    (tmp_path / "bare.parquet.partial").mkdir()
    with pytest.raises(SweepError, match=r"it has no plan\.json"):
        resume(tmp_path / "bare.parquet")


@pytest.mark.parametrize(
    ("name", "text", "reason"),
    [
        ("plan", "{", "was cut short"),
        ("plan", "[]", "describes no sweep"),
        ("plan", '{"format": "other"}', "describes no sweep"),
        ("chunks", '{"conditions": ', "does not hold the division into chunks"),
    ],
)
def test_a_damaged_plan_is_told(name: str, text: str, reason: str, plan: Plan, tmp_path: Path) -> None:
    """A folder is not computed of which the plan, or how the sweep was cut, cannot be understood."""
    folder = half_done(plan, tmp_path / "plan.parquet")
    (folder / f"{name}.json").write_text(text)
    with pytest.raises(SweepError, match=reason):
        carry_out(None, tmp_path / "plan.parquet")
    assert (folder / "000000.parquet").exists()


def test_another_version_reads_but_does_not_go_on(plan: Plan, tmp_path: Path) -> None:
    """Rows of two versions would not compare, so what one began another does not finish."""
    folder = half_done(plan, tmp_path / "old.parquet")
    described = json.loads((folder / "plan.json").read_text())
    (folder / "plan.json").write_text(json.dumps({**described, "pftrack": "0.0.9"}))
    with pytest.raises(SweepError, match=rf"begun with pftrack 0\.0\.9, this is {__version__}"):
        carry_out(None, tmp_path / "old.parquet")
    assert len(read_result(tmp_path / "old.parquet").table) == 48


def test_a_chunk_damaged_in_the_middle_does_not_come_into_the_result(
    plan: Plan, finished: Result, tmp_path: Path
) -> None:
    """Its name is told; removed, it is computed again."""
    folder = half_done(plan, tmp_path / "spoilt.parquet")
    spoilt = folder / "000002.parquet"
    data = bytearray(spoilt.read_bytes())
    data[400:500] = bytes(100)
    spoilt.write_bytes(data)
    with pytest.raises(SweepError, match=r"000002\.parquet is damaged; remove it and continue with --resume"):
        carry_out(None, tmp_path / "spoilt.parquet")
    assert not (tmp_path / "spoilt.parquet").exists()
    spoilt.unlink()
    result = carry_out(None, tmp_path / "spoilt.parquet")
    assert result.table.drop_columns("step_ms") == finished.table.drop_columns("step_ms")


# Results: rows, summaries and CSV, read in pieces.


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
