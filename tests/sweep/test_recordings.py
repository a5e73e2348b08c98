"""Sweeps on a recording: its runs are those that sessions on it are, with truth and without."""

import os
from contextlib import closing
from dataclasses import replace
from pathlib import Path

import pytest

from pftrack.core.model.recipe import Footage
from pftrack.experiments import find
from pftrack.sources.sequence import Recording, open_sequence
from pftrack.sweep import Plan, carry_out, compare, read_result
from pftrack.sweep.axis import Axis, SweepError, SweepStopped
from pftrack.sweep.cells import cells, quantity_named, samples
from pftrack.sweep.report.files import write_report
from pftrack.sweep.work import pack, setup_of
from tests.server.uploads.test_uploads import video

FRAMES = 12
TRACKERS = ("condensation", "apf")


@pytest.fixture(scope="module")
def clip(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("clip") / "ball.mp4"
    path.write_bytes(video(20))
    return path


@pytest.fixture(scope="module")
def footage(clip: Path) -> Footage:
    takes = find("histogram").video
    mark = takes.mark({"kind": "box", "x": 10, "y": 20, "width": 10, "height": 10})
    with closing(open_sequence(clip)) as sequence:
        setup = takes.on_video(sequence, mark, start=1)
    return setup.footage


@pytest.fixture
def plan(footage: Footage) -> Plan:
    axes = (Axis("sample_count", (30, 60)),)
    return Plan("histogram", axes, TRACKERS, trials=2, frames=FRAMES, footage=footage, kind="video")


@pytest.mark.parametrize("known", [False, True], ids=["without truth", "with truth"])
def test_rows_are_the_runs_that_open(plan: Plan, clip: Path, tmp_path: Path, *, known: bool) -> None:
    """Each row has the numbers of the live run of its recipe; without truth the trackers' own reports count."""
    if known:
        truth = dict.fromkeys(range(1, 20), (10.0, 20.0, 10.0, 10.0))
        plan = replace(plan, footage=plan.footage.model_copy(update={"truth": truth}))
    assert Plan.from_dict(plan.as_dict()) == plan
    result = carry_out(plan, tmp_path / "a.parquet", jobs=1, recording=Recording(str(clip)))
    rows = result.table.to_pylist()
    assert len(rows) == 8
    assert len({row["estimates_sha256"] for row in rows}) == 8
    for number in (0, 3, 7):
        run = plan.live(number, lambda footage: Recording(str(clip)).open(square=footage.square))
        run.finish()
        assert bytes.fromhex(run.estimates_sha256) == rows[number]["estimates_sha256"]
        assert plan.single(number).recipe.footage == plan.footage
    for row in rows:
        assert row["problem"] is None
        assert (row["success"] is None) is not known
        assert row["labelled_frames"] == (FRAMES if known else 0)
        if not known:
            assert 0.0 < row["mean_deviation"] < 50.0
    assert ("mean_deviation" in rows[0]) is not known
    if not known:
        quantity = quantity_named(plan, "mean_deviation")
        found = compare(quantity, cells(result), samples(result, quantity, None), *TRACKERS)
        assert found.paired.pairs.tolist() == [[4]]
        titles = [table.title for table in write_report(result, tmp_path / "report").tables]
        assert [it for it in titles if it.endswith(" by Particles")] == ["Reports that it follows by Particles"]


def test_it_goes_on_with_its_recording_alone(plan: Plan, clip: Path, tmp_path: Path) -> None:
    """A sweep that was stopped needs the recording again; without it, or with another one, nothing is computed.

    What a worker elsewhere unpacks is the same recording, of a file as of a folder of pictures.
    """
    out, here = tmp_path / "a.parquet", Recording(str(clip))
    with pytest.raises(SweepStopped):
        carry_out(plan, out, jobs=1, recording=here, stop=lambda: True)
    with pytest.raises(SweepError, match=r"on ball\.mp4, which has to be given"):
        carry_out(None, out, jobs=1)
    other = tmp_path / "other.mp4"
    other.write_bytes(video(21))
    with pytest.raises(SweepError, match="has other content"):
        carry_out(None, out, jobs=2, recording=Recording(str(other)))
    assert carry_out(None, out, jobs=1, recording=here).complete
    assert read_result(out).plan == plan
    assert setup_of(plan, pack(here)).footage == plan.footage
    pictures = tmp_path / "pictures"
    pictures.mkdir()
    (pictures / "0.png").write_bytes(b"a")
    os.utime(pictures / "0.png", (0, 0))  # of 1970, for which an archive has no date
    assert pack(Recording(str(pictures))).folder


def test_what_a_plan_needs_to_know_of_a_recording(plan: Plan, footage: Footage) -> None:
    """Parameters are those of a recording, and hash, kind, length and target are there."""
    wrong = {
        "no parameter 'sway_px' on a recording": {"axes": (Axis("sway_px", (1.0,)),)},
        "names the recording and its kind": {"kind": None},
        "takes no other recording": {"kind": "tracks"},
        "needs the hash": {"footage": footage.model_copy(update={"sha256": None})},
        "number of its frames": {"frames": 0},
        "needs the mark": {"footage": footage.model_copy(update={"mark": None})},
    }
    for words, changes in wrong.items():
        with pytest.raises(SweepError, match=words):
            replace(plan, **changes)  # type: ignore[arg-type] # of all kinds
    with pytest.raises(SweepError, match="takes no recording"):
        replace(plan, experiment="sine", axes=(), trackers=())
