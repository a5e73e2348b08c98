"""Driving a sweep: the rows do not depend on how it is computed or which process is lost."""

import json
import os
import resource
import signal
from contextlib import closing
from pathlib import Path

import psutil
import pyarrow as pa
import pytest

from pftrack.core.model.parameters import Value
from pftrack.sweep import Plan, Result, begin, carry_out, resume
from pftrack.sweep.axis import Axis, SweepError, SweepStopped
from pftrack.sweep.driver import Progress
from pftrack.sweep.table import TIMING, Chunks
from pftrack.sweep.work import LocalWorkers


def figures(result: Result) -> pa.Table:
    """All columns but the one that is measured."""
    return result.table.drop_columns(TIMING)


def cut(plan: Plan, out: Path, runs: int = 4) -> Path:
    """Begin a sweep with chunks of a given size, and return its path."""
    begin(plan, out).cut(Chunks.of(plan, runs))
    return out


def children() -> list[psutil.Process]:
    """Processes of the pool that this process started: those that its fork server has forked."""
    servers = [it for it in psutil.Process().children() if "pftrack.sweep.preload" in it.cmdline()]
    return [process for it in servers for process in it.children()]


def test_every_row_opens_as_a_live_run(plan: Plan, finished: Result, tmp_path: Path) -> None:
    """Each row's run, stepped through, has the same estimates, success, error and lost frames.

    Two processes and the smallest chunks compute the rows of one process and larger ones, and leave only the result.
    """
    assert finished.complete
    assert finished.table["run"].to_pylist() == list(range(plan.runs))
    assert figures(carry_out(None, cut(plan, tmp_path / "small.parquet", 2), jobs=2)) == figures(finished)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["small.parquet"]
    for row in finished.table.to_pylist()[::5]:
        live = plan.live(row["run"])
        live.finish()
        summary = live.summary().as_dict()
        assert live.estimates_sha256 == row["estimates_sha256"].hex()
        assert (live.seed, live.tracker, live.frames) == (row["seed"], row["tracker"], plan.frames)
        for name in ("success", "mean_error", "lost_frames", "first_lost_frame", "labelled_frames"):
            assert summary[name] == row[name]
        assert row["problem"] is None


def kill_workers(most: int | None = None) -> None:
    for victim in children()[:most]:
        victim.send_signal(signal.SIGKILL)


def test_a_killed_worker_costs_its_chunk_alone(plan: Plan, finished: Result, tmp_path: Path) -> None:
    """One of two processes is killed in the middle; another takes its place, and the rows are the same.

    When a chunk has ended three workers the sweep ends with a sentence, and goes on later from what is kept.
    """
    seen: list[int] = []

    def kill(progress: Progress) -> None:
        if progress.done and not any(seen):
            assert children()
            kill_workers(1)
        seen.append(progress.done)

    killed, deadly = (cut(plan, tmp_path / name) for name in ("killed.parquet", "deadly.parquet"))
    assert figures(carry_out(None, killed, jobs=2, progress=kill)) == figures(finished)
    with pytest.raises(SweepError, match=r"ended its worker 3 times \(killed by SIGKILL\)"):
        carry_out(None, deadly, jobs=2, progress=lambda progress: kill_workers() if progress.done else None)
    assert list(resume(deadly).folder.glob("0*.parquet"))
    assert not children()
    assert carry_out(None, deadly).complete


def stamps(out: Path) -> dict[str, int]:
    """When each chunk that is kept was written."""
    return {path.name: path.stat().st_mtime_ns for path in resume(out).folder.glob("0*.parquet")}


def test_a_sweep_that_is_told_to_stop_keeps_what_it_has(plan: Plan, finished: Result, tmp_path: Path) -> None:
    """It stops soon, says so, and goes on without computing anything twice.

    While another process computes it, it is refused.
    """
    out = cut(plan, tmp_path / "stopped.parquet")
    seen: list[Progress] = []
    with pytest.raises(SweepStopped):
        carry_out(None, out, progress=seen.append, stop=lambda: bool(seen and seen[-1].done >= 20))
    with resume(out).claim(), pytest.raises(SweepError, match="is being computed by another process"):
        carry_out(None, out)
    kept = stamps(out)
    assert 20 <= seen[-1].done < plan.runs
    again: list[Progress] = []
    later: dict[str, int] = {}
    result = carry_out(None, out, progress=lambda progress: (again.append(progress), later.update(stamps(out))))
    assert again[0].done == seen[-1].done
    assert {name: later[name] for name in kept} == kept
    assert figures(result) == figures(finished)


def test_a_refused_combination_is_a_row_with_its_problem(tmp_path: Path) -> None:
    """A condition at odds with itself has rows that say why, and the others are computed.

    Where nothing is lost or won, success is null and the error is there.
    """
    axes, values = (Axis("gamma_min_px", (10.0, 30.0)),), {"sample_count": 20}
    plan = Plan("ball", axes, ("h-spf",), 2, 0, frames=5, values=values)
    rows = carry_out(plan, tmp_path / "odd.parquet").table.to_pylist()
    assert len(rows) == 4
    for row in rows:
        if row["gamma_min_px"] == 30.0:
            assert row["problem"] == "gamma_min_px must be at most gamma_max_px (20 px), got 30.0"
            assert row["success"] is row["mean_error"] is row["estimates_sha256"] is row["step_ms"] is None
        else:
            assert row["problem"] is None
            assert row["success"] is not None
    plan = Plan("sine", (Axis("sample_count", (5, 10)),), ("condensation", "kalman"), trials=2, frames=10)
    table = carry_out(plan, tmp_path / "sine.parquet").table
    assert table["success"].null_count == table["lost_frames"].null_count == len(table) == 8
    assert table["mean_error"].null_count == table["problem"].null_count - 8 == 0


def test_axes_of_every_kind_are_swept(tmp_path: Path) -> None:
    """Choices, truths, colours and parameters that are not live become columns of their own kind."""
    values: dict[str, tuple[Value, ...]] = {
        "learn_dynamics": (True, False),
        "background_colour": ("#646464", "#000000"),
        "image_width_px": (320, 256),
    }
    plan = Plan("ball", tuple(map(Axis, values, values.values())), ("h-spf",), frames=5, values={"sample_count": 10})
    table = carry_out(plan, tmp_path / "kinds.parquet").table
    assert [str(table.schema.field(name).type) for name in values] == ["bool", "string", "int64"]
    live = plan.live(7)
    live.finish()
    assert live.estimates_sha256 == table["estimates_sha256"][7].as_py().hex()


def test_a_full_disk_is_told_and_costs_nothing_that_is_kept(plan: Plan, tmp_path: Path) -> None:
    """When a chunk cannot be written the sweep fails with the system's own words, and goes on when there is room."""
    out = cut(plan, tmp_path / "full.parquet")
    before = resource.getrlimit(resource.RLIMIT_FSIZE)

    def limit(progress: Progress) -> None:
        if progress.done >= 12:
            resource.setrlimit(resource.RLIMIT_FSIZE, (1, before[1]))

    try:
        with pytest.raises(OSError, match="File too large"):
            carry_out(None, out, progress=limit)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    seen: list[Progress] = []
    assert carry_out(None, out, progress=seen.append).complete
    assert seen[0].done >= 12


def test_workers_have_the_environment_of_one_thread() -> None:
    """Compiled libraries start no threads of their own beside the processes; a fault of a task is raised."""
    with closing(LocalWorkers(1)) as workers:
        workers.start(0, os.getenv, "OMP_NUM_THREADS")
        (done,) = workers.collect(30)
        assert (done.number, done.value, done.lost) == (0, "1", "")
        workers.start(1, json.loads, "{")
        with pytest.raises(SweepError, match="JSONDecodeError"):
            workers.collect(30)
