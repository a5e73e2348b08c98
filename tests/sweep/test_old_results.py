"""Results of the first format: they open, compute to the same numbers but for the last digits, and go on.

The last digits have changed since they were written, once, when all processors were brought to the same bits; so hashes
are other ones, and mean errors are compared to ten digits.
"""

import csv
import io
import math
from pathlib import Path

import pyarrow.parquet as pq
import pytest

from pftrack.sweep import (
    Plan,
    Result,
    SweepError,
    begin,
    carry_out,
    cells,
    csv_pieces,
    partial_of,
    read_result,
    rows_of,
)
from pftrack.sweep.chunks import Chunks
from pftrack.sweep.journal import metadata
from pftrack.sweep.report import write_report
from pftrack.sweep.table import TIMING, schema

PLACE = Path(__file__).parents[1] / "data" / "format_1" / "sweeps"
OLD_ONLY = {"ball": set(), "sine": {"observation_share", "switches"}}
COMPUTED = ("run", "tracker", "trial", "seed", "success", "mean_error", "lost_frames")
DIGITS = 1e-10


def alike(one: object, other: object) -> bool:
    """Whether two values are the same, numbers but for their last digits."""
    if isinstance(one, float) and isinstance(other, float):
        return math.isclose(one, other, rel_tol=DIGITS)
    return one == other


def computed(result: Result) -> list[dict[str, object]]:
    """Return what was computed of each run, mean errors to the digits that have stayed."""
    rows: list[dict[str, object]] = result.table.select(COMPUTED).to_pylist()
    return [row | {"mean_error": pytest.approx(row["mean_error"], rel=DIGITS)} for row in rows]


@pytest.mark.parametrize("name", OLD_ONLY)
def test_an_old_result_opens_with_the_columns_of_today(name: str) -> None:
    """A column that nobody declares any more is left out, a measure is unknown; all others are as they were written."""
    path = PLACE / f"{name}.parquet"
    result, written = read_result(path), pq.read_table(path)
    table = result.table
    assert table.column_names == schema(result.plan).names
    assert set(written.column_names) - set(table.column_names) == OLD_ONLY[name]
    measures = {measure.name for measure in result.plan.wiring.run_measures}
    assert set(table.column_names) - set(written.column_names) == measures
    assert all(table[measure].null_count == len(table) for measure in measures)
    kept = [column for column in table.column_names if column not in measures]
    assert table.select(kept).to_pylist() == written.select(kept).to_pylist()
    header, *lines = csv.reader(io.StringIO(b"".join(csv_pieces(result)).decode()))
    assert header == table.column_names
    assert {len(line) for line in lines} == {len(header)}
    assert len(rows_of(result, {"tracker": "kalman"})) == len(table) / 2


@pytest.mark.parametrize("name", OLD_ONLY)
def test_an_old_result_computes_to_the_same_numbers(name: str, tmp_path: Path) -> None:
    """The same plan gives the same rows today, but for what a tracker does not have: that was written as 0."""
    old = read_result(PLACE / f"{name}.parquet")
    new = carry_out(old.plan, tmp_path / "again.parquet", jobs=1)
    assert new.table.select(COMPUTED).to_pylist() == computed(old)
    for before, after in zip(old.table.to_pylist(), new.table.to_pylist(), strict=True):
        apart = {TIMING, "estimates_sha256", *(measure.name for measure in old.plan.wiring.run_measures)}
        differing = {column for column in after if column not in apart and not alike(before[column], after[column])}
        if after["tracker"] == "kalman" and name == "ball":
            assert differing == {"observation_share", "switches"}
            assert all(before[column] == 0 and after[column] is None for column in differing)
        else:
            assert not differing


@pytest.mark.parametrize("name", OLD_ONLY)
def test_an_old_result_is_reported(name: str, tmp_path: Path) -> None:
    """Its report has the figures of its cells."""
    result = read_result(PLACE / f"{name}.parquet")
    report = write_report(result, tmp_path / "report")
    assert [row[0] for row in report.tables[0].rows] == list(result.plan.trackers)
    assert cells(result).keys() == set(result.plan.trackers)


@pytest.mark.parametrize("name", OLD_ONLY)
def test_an_old_sweep_goes_on_where_it_stopped(name: str, tmp_path: Path) -> None:
    """Chunks that were kept with the old columns are put together with those that are computed now."""
    path, out = PLACE / f"{name}.parquet", tmp_path / "half.parquet"
    plan = read_result(path).plan
    journal = begin(plan, out)
    chunks = Chunks(plan, 1, plan.trials)
    journal.cut(chunks)
    kept = pq.read_table(path).slice(0, chunks[0].runs).replace_schema_metadata(metadata(plan))
    pq.write_table(kept, partial_of(out) / "000000.parquet", write_page_checksum=True)
    result = carry_out(None, out, jobs=1)
    assert result.complete
    assert result.table.select(COMPUTED).to_pylist() == computed(read_result(path))
    assert pq.read_schema(out).names == schema(plan).names


LARGE_SEED = 2**60 + 7
"""Of a plan that an earlier version took; beyond what JavaScript carries."""


def test_a_plan_with_an_earlier_seed_opens_and_goes_on(tmp_path: Path) -> None:
    """Its result is read, resumed, reported and opened row by row; the seeds of its rows were always small ones."""
    raw = Plan("sine", trackers=("kalman",), trials=3, frames=12).as_dict() | {"seed": LARGE_SEED}
    plan, out = Plan.from_dict(raw), tmp_path / "old.parquet"
    begin(plan, out)
    assert read_result(out).plan == plan
    result = carry_out(None, out, jobs=1)
    again = read_result(out)
    assert again.complete
    assert again.plan.seed == LARGE_SEED
    assert again.plan.as_dict() == raw
    for row in rows_of(result, {}):
        assert row["seed"] <= 2**48
        live = again.plan.live(row["run"])
        live.finish()
        assert live.estimates_sha256 == row["estimates_sha256"]
    assert write_report(again, tmp_path / "report").tables


def test_a_new_plan_has_a_seed_that_every_reader_can_carry() -> None:
    """What is begun today keeps to the bound that all seeds have now; beyond the generator's nothing opens."""
    with pytest.raises(SweepError, match="seed must be a whole number between 0 and 9007199254740991"):
        Plan("sine", seed=LARGE_SEED)
    with pytest.raises(SweepError, match="seed must be a whole number between 0 and 9223372036854775807"):
        Plan.from_dict(Plan("sine").as_dict() | {"seed": 2**63})
