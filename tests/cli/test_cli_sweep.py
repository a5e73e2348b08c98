"""`pftrack sweep`: one JSON value, one clear line, and an exit status; an interrupt loses nothing."""

import json
import os
import pty
import re
import signal
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from functools import partial
from pathlib import Path

import pytest

from pftrack.cli.app import main
from pftrack.sweep import read_result
from tests.cli.commands import Ask, Call, refused
from tests.server.uploads.test_uploads import video
from tests.waiting import wait_for

SMALL = ("--set", "sample_count=50", "--frames", "20")
AXES = ("--axis", "occlusion_width_px=0:60:20", "--axis", "distracter_radius_px=1,10")
PLAN = ("ball", *AXES, "--trackers", "h-spf,s-spf", "--trials", "2", *SMALL)


@pytest.fixture
def call(call: Call) -> Call:
    """Run the command in this process."""
    return partial(call, "sweep")


def test_a_sweep_on_a_recording(call: Call, tmp_path: Path) -> None:
    """Without truth it reports the stated deviation; `--resume` finds the recording again."""
    clip, out = tmp_path / "ball.mp4", tmp_path / "a.parquet"
    clip.write_bytes(video(12))
    on = ("histogram", "--video", clip, "--box", "10,20,10,10", "--trackers", "condensation,apf", "--trials", "2")
    status, text, _ = call(*on, "--set", "sample_count=30", "--frames", "8", "--out", out, "--jobs", "1")
    assert (status, "stated deviation" in text, "success" in text) == (0, True, False)
    plan = read_result(out).plan
    assert plan.footage is not None
    assert (plan.footage.path, plan.kind, plan.frames) == ("ball.mp4", "video", 8)
    assert call("--resume", out)[0] == 0


def test_a_sweep_reports_its_result(call: Call, ask: Ask, tmp_path: Path) -> None:
    """It prints one JSON value with runs, seconds, success rates and the path; an existing file is refused and stays.

    A line reports runs that could not be computed.
    """
    out = tmp_path / "a.parquet"
    status, text, err = call(*PLAN, "--jobs", 1, "--out", out, "--json")
    found = json.loads(text)
    assert (status, err) == (0, "")
    assert set(found) == {"runs", "problems", "success_rate", "success_rate_by_tracker", "seconds", "path"}
    assert (found["runs"], found["problems"], found["path"]) == (32, 0, str(out))
    assert set(found["success_rate_by_tracker"]) == {"h-spf", "s-spf"}
    assert 0 < found["seconds"] < 60
    assert found["success_rate"] == pytest.approx(sum(found["success_rate_by_tracker"].values()) / 2)
    assert sorted(tmp_path.iterdir()) == [out]
    again = ask("--resume", out)
    assert {**again, "seconds": 0} == {**found, "seconds": 0}
    (tmp_path / "b.parquet").write_text("mine")
    refused(call(*PLAN, "--out", tmp_path / "b.parquet"), 1, "exists already; a sweep overwrites nothing")
    assert (tmp_path / "b.parquet").read_text() == "mine"
    failing = "ball", "--axis", "gamma_min_px=10,30", "--trackers", "s-spf", "--trials", 1, *SMALL
    status, text, err = call(*failing, "--jobs", 1, "--out", tmp_path / "c.parquet", "--json")
    assert (status, json.loads(text)["problems"]) == (0, 1)
    assert err == "pftrack: 1 runs could not be computed; the column problem says why\n"


def test_a_dry_run_computes_nothing(call: Call, ask: Ask) -> None:
    """It prints the numbers of runs and cells and the estimated time, and needs no output file."""
    found = ask(*PLAN, "--dry-run")
    assert (found["runs"], found["cells"]) == (32, 8)
    assert 0 < found["seconds"] < 60
    assert "32 runs in 8 cells, about" in call(*PLAN, "--dry-run")[1]


def test_a_preset_is_where_a_sweep_begins(call: Call, tmp_path: Path) -> None:
    """Tracker and values are those of the preset, unless an axis or an option changes them."""
    axis = "--axis", "occlusion_width_px=10,60", "--trials", 1, "--frames", 5, "--jobs", 1
    for number, (said, trackers, values) in enumerate(
        (
            (("too-wide", "--set", "sample_count=50"), ("h-spf",), {"sample_count": 50}),
            (("few", "--trackers", "apf"), ("apf",), {"sample_count": 40}),
        )
    ):
        out = tmp_path / f"{number}.parquet"
        assert call("ball", "--preset", *said, *axis, "--out", out)[0] == 0
        plan = read_result(out).plan
        assert (plan.trackers, dict(plan.values)) == (trackers, values)


def test_a_terminal_shows_progress_until_ctrl_c_ends_the_sweep(tmp_path: Path) -> None:
    """On a terminal a bar shows finished runs and the rate; standard output has only the result.

    An interrupt of the group gives status 1 and a line about --resume; it keeps the finished runs and leaves no
    process.
    """
    out = tmp_path / "ended.parquet"
    ours, theirs = pty.openpty()
    plan = "ball", *AXES, "--trackers", "h-spf", "--trials", "300", *SMALL
    command = [sys.executable, "-m", "pftrack", "sweep", *plan, "--out", str(out), "--jobs", "1", "--json"]
    environment = {**os.environ, "TERM": "xterm", "COLUMNS": "120"}
    with ThreadPoolExecutor(1) as reader:
        shown = reader.submit(all_of, ours)  # a terminal that nobody reads fills up
        try:
            with subprocess.Popen(
                command, stdout=subprocess.PIPE, stderr=theirs, text=True, start_new_session=True, env=environment
            ) as process:
                wait_for(lambda: list(out.with_name(f"{out.name}.partial").glob("0*.parquet")))
                os.killpg(process.pid, signal.SIGINT)
                text, _ = process.communicate(timeout=60)
        finally:
            os.close(theirs)
    os.close(ours)
    error = json.loads(text)["error"]
    assert process.returncode == 1
    assert error["message"].endswith(f"resume with pftrack sweep --resume {out}")
    assert 0 < error["runs"] < error["of"] == 2400
    assert len(read_result(out).table) == error["runs"]
    with pytest.raises(ProcessLookupError):
        os.killpg(process.pid, 0)
    assert shown.result().replace(b"\r\n", b"\n").endswith(f"pftrack: {error['message']}\n".encode())
    assert re.search(rb"/2,?400", shown.result())
    assert b"measuring" in shown.result()


def all_of(terminal: int) -> bytes:
    """Read a terminal until its other end is closed."""
    shown = b""
    with suppress(OSError):
        while True:
            shown += os.read(terminal, 65536)
    return shown


def test_a_report_is_written_next_to_the_result(call: Call, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """It has tables or one JSON value, and a folder with figures and a page.

    A name with a colon, such as a time of day, is a file name, for a resumed sweep, too.
    """
    monkeypatch.chdir(tmp_path)
    out = "T13:49.parquet"
    axes = "--axis", "occlusion_width_px=0,60", "--axis", "distracter_radius_px=1,10"  # few figures
    status, text, _ = call(
        "run", "ball", *axes, "--trackers", "h-spf", "--trials", 2, *SMALL, "--jobs", 1, "--out", out
    )
    assert status == 0
    assert [words for words in ("95 % interval", "h-spf", "8 rows in") if words not in text] == []
    assert call("--resume", out)[0] == 0
    assert [path.name for path in tmp_path.iterdir()] == [out]
    status, text, err = call("report", out, "--no-pictures")
    assert (status, "By tracker" in text, "open" in err) == (0, True, True)
    assert {path.name for path in (tmp_path / "T13:49-report").iterdir()} == {"index.html", "tables.csv"}
    axis = "--x", "distracter_radius_px"
    status, text, err = call("report", out, "--out", tmp_path / "other", *axis, "--svg", "--json")
    found = json.loads(text)
    assert (status, err, found["runs"], found["complete"]) == (0, "", 8, True)
    assert Path(found["page"]) == tmp_path / "other" / "index.html"
    assert all(Path(path).exists() for path in found["files"])
    (row,) = found["tables"][0]["rows"]
    assert row[:2] == ["h-spf", 8]
    assert (tmp_path / "other" / "success.svg").exists()
    status, text, _ = call("report", out, "--x", "width", "--json")
    assert (status, "no axis 'width'" in json.loads(text)["error"]["message"]) == (1, True)
    picture, rows = tmp_path / "map.svg", tmp_path / "rows.csv"
    with pytest.raises(SystemExit) as ended:
        main(["export", out, "--to", str(picture), "--to", str(rows), "--plot", "success"])
    assert ended.value.code == 0
    assert picture.stat().st_size > 0
    assert len(rows.read_text().splitlines()) == 1 + 8
