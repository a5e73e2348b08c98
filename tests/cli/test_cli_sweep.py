"""`pftrack sweep`: one JSON value, one clear line, an exit status; signals end it cleanly and nothing is lost."""

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
from tests.cli.commands import Ask, Call
from tests.pooling import fork_server, shared_fork_server
from tests.server.uploads.test_uploads import video
from tests.waiting import wait_for

__all__ = ["fork_server", "shared_fork_server"]

SMALL = ("--set", "sample_count=50", "--frames", "20")
AXES = ("--axis", "occlusion_width_px=0:60:20", "--axis", "distracter_radius_px=1,10")
PLAN = ("ball", *AXES, "--trackers", "h-spf,s-spf", "--trials", "2", *SMALL)


@pytest.fixture
def call(call: Call) -> Call:
    """Run the command in this process."""
    return partial(call, "sweep")


def test_a_sweep_on_a_recording(call: Call, tmp_path: Path) -> None:
    """It says what trackers say of themselves where no truth is given, and finds its recording again to go on."""
    clip, out = tmp_path / "ball.mp4", tmp_path / "a.parquet"
    clip.write_bytes(video(12))
    on = ("histogram", "--video", clip, "--box", "10,20,10,10", "--trackers", "condensation,apf", "--trials", "2")
    status, text, _ = call(*on, "--set", "sample_count=30", "--frames", "8", "--out", out, "--jobs", "1")
    assert (status, "stated deviation" in text, "success" in text) == (0, True, False)
    plan = read_result(out).plan
    assert plan.footage is not None
    assert (plan.footage.path, plan.kind, plan.frames) == ("ball.mp4", "video", 8)
    assert call("--resume", out)[0] == 0


def test_a_sweep_says_what_came_of_it(call: Call, ask: Ask, tmp_path: Path) -> None:
    """One JSON value with runs, seconds, success rates and the path, and nothing else on either stream."""
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


def test_a_dry_run_computes_nothing(call: Call, ask: Ask) -> None:
    """It says how many runs and cells it would be and how long it takes, and needs no place to write."""
    found = ask(*PLAN, "--dry-run")
    assert (found["runs"], found["cells"]) == (32, 8)
    assert 0 < found["seconds"] < 60
    assert "32 runs in 8 cells, about" in call(*PLAN, "--dry-run")[1]


def test_a_preset_is_where_a_sweep_begins(call: Call, tmp_path: Path) -> None:
    """Tracker and values are the preset's, but for what an axis varies or the call says."""
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


def test_nothing_is_overwritten(call: Call, tmp_path: Path) -> None:
    """A file that exists is refused, with what to do, and stays."""
    out = tmp_path / "c.parquet"
    out.write_text("mine")
    status, text, err = call(*PLAN, "--out", out, "--json")
    assert (status, err.count("\n"), out.read_text()) == (1, 1, "mine")
    assert "exists already; a sweep overwrites nothing" in json.loads(text)["error"]["message"]


def test_problems_are_told(call: Call, tmp_path: Path) -> None:
    """Runs that could not be computed are counted, and a line says where their problem is."""
    arguments = "ball", "--axis", "gamma_min_px=10,30", "--trackers", "s-spf", "--trials", 1, *SMALL
    status, text, err = call(*arguments, "--jobs", 1, "--out", tmp_path / "d.parquet", "--json")
    assert (status, json.loads(text)["problems"]) == (0, 1)
    assert err == "pftrack: 1 runs could not be computed; the column problem says why\n"


def test_a_terminal_shows_how_far_it_is_until_ctrl_c_ends_it_cleanly(tmp_path: Path) -> None:
    """On a terminal the bar shows runs done and the rate; standard output has the result alone.

    Of 2,400 runs some are kept when the group is interrupted. At the end there are exit status 1, a line that tells
    --resume and no process; what was computed is there.
    """
    out = tmp_path / "ended.parquet"
    ours, theirs = pty.openpty()
    command = [
        sys.executable,
        "-m",
        "pftrack",
        "sweep",
        "ball",
        *AXES,
        "--trackers",
        "h-spf",
        "--trials",
        "300",
        *SMALL,
    ]
    command += ["--out", str(out), "--jobs", "2", "--json"]
    environment = {**os.environ, "TERM": "xterm", "COLUMNS": "120"}
    with ThreadPoolExecutor(1) as reader:
        shown = reader.submit(all_of, ours)  # at once: a terminal that nobody reads is full before long
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
    assert error["message"].endswith(f"go on with pftrack sweep --resume {out}")
    assert 0 < error["runs"] < error["of"] == 2400
    assert len(read_result(out).table) == error["runs"]
    with pytest.raises(ProcessLookupError):
        os.killpg(process.pid, 0)
    assert shown.result().replace(b"\r\n", b"\n").endswith(f"pftrack: {error['message']}\n".encode())
    assert re.search(rb"/2,?400", shown.result())
    assert b"measuring" in shown.result()


def all_of(terminal: int) -> bytes:
    """Read a terminal until nobody has its other end open."""
    shown = b""
    with suppress(OSError):
        while True:
            shown += os.read(terminal, 65536)
    return shown


def test_a_report_is_written_beside_the_result(call: Call, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Tables for people or one JSON value, and a folder with figures and page.

    A relative name such as a time of day is that of a file, also where the sweep is resumed.
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
    assert all(isinstance(each, float | list) for each in row[2:])
    assert (tmp_path / "other" / "success.svg").exists()
    status, text, _ = call("report", out, "--x", "width", "--json")
    assert (status, "no axis 'width'" in json.loads(text)["error"]["message"]) == (1, True)
    picture, rows = tmp_path / "map.svg", tmp_path / "rows.csv"
    with pytest.raises(SystemExit) as ended:
        main(["export", out, "--to", str(picture), "--to", str(rows), "--plot", "success"])
    assert ended.value.code == 0
    assert picture.stat().st_size > 0
    assert len(rows.read_text().splitlines()) == 1 + 8
