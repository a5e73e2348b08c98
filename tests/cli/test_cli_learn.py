"""`pftrack learn`, and its files as values of parameters."""

from pathlib import Path

import pytest

from pftrack.runs.record import read, save
from pftrack.sweep import Plan, read_result
from tests.cli.commands import Ask, Call, refused

GUIDED = "run", "ball", "--tracker", "guided", "--frames", 12


@pytest.fixture(scope="module")
def saved(tmp_path_factory: pytest.TempPathFactory) -> Path:
    place = tmp_path_factory.mktemp("learned") / "run.pft"
    run = Plan("ball", (), ("h-spf",), 1, frames=25).live(0)
    run.finish()
    save(run, place)
    return place


@pytest.fixture
def learned(saved: Path, call: Call) -> Path:
    place = saved.with_name("motion.json")
    assert call("learn", saved, "--out", place)[0] == 0
    return place


def test_saved_and_new_runs_give_the_same_motion(saved: Path, learned: Path, ask: Ask) -> None:
    """A motion learned from a saved run equals that of the same run when it is computed."""
    again = saved.with_name("again.json")
    said = ask("learn", "ball", "--tracker", "h-spf", "--frames", 25, "--trials", 1, "--out", again)
    assert again.read_text() == learned.read_text()
    assert (said["experiment"], said["tracks"], said["reading"]) == ("ball", 1, "fixed")
    assert (said["changes"], said["frames"] + said["left_out"]) == (["u''", "v''"], 25)
    assert len(said["modes"]) == len(said["eigenvalues"]) == 2


def test_several_runs_are_learned_from_together(call: Call, tmp_path: Path) -> None:
    """Runs of several seeds, or of each value of an axis, make as many tracks; without `--json` there is a table."""
    beginning = ("learn", "ball", "--frames", 20, "--out", tmp_path / "three.json")
    code, out, err = call(*beginning, "--trials", 3)
    assert (code, "standard deviation" in out, "learned from 3 tracks" in err) == (0, True, True)
    assert "learned from 2 tracks" in call(*beginning, "--axis", "period_s=1,2")[2]


def test_a_run_is_guided_by_a_file_and_carries_it(learned: Path, call: Call, ask: Ask) -> None:
    """`--learned` and `--set learned=@FILE` are the same, and differ from the default; the run replays.

    The table of a run shows only the beginning of the file.
    """
    place = learned.with_name("guided.pft")
    by_option = ask(*GUIDED, "--learned", learned, "--out", place)["estimates_sha256"]
    assert by_option == ask(*GUIDED, "--set", f"learned=@{learned}")["estimates_sha256"]
    assert by_option != ask(*GUIDED)["estimates_sha256"]
    assert read(place).recipe.timeline[0].values["learned"] == learned.read_text()
    assert ask("replay", place)["same_as_saved"] is True
    _, out, _ = call(*GUIDED, "--learned", learned)
    assert ("pftrack-learned" in out, "step_sd" in out) == (True, False)


def test_a_run_exports_its_motion(saved: Path, learned: Path, call: Call) -> None:
    """`--export` writes the same file as `learn`; a run that is too short is refused."""
    place = learned.with_name("open.learned.json")
    assert call("replay", saved, "--export", place)[0] == 0
    assert place.read_text() == learned.read_text()
    refused(call("run", "ball", "--frames", 4, "--export", place), 1, "expected at least 10 frames", "got")


def test_wrong_files_are_refused(saved: Path, learned: Path, call: Call, tmp_path: Path) -> None:
    """A learned file must be text of this experiment, not empty and not too large; the other must be a run."""
    garbage = b"\xff\xfe\x00\x81"
    for content, status, words in (
        (garbage, 1, "is not a UTF-8 text file"),
        (b" " * 500_000, 1, "KiB allowed"),
        (b"\n", 1, "mine.json is empty"),
        (learned.read_bytes().replace(b'"ball"', b'"fish"'), 2, "it was learned in 'fish', and this is 'ball'"),
    ):
        (tmp_path / "mine.json").write_bytes(content)
        refused(call(*GUIDED, "--learned", tmp_path / "mine.json"), status, words)
    (tmp_path / "mine.pft").write_bytes(garbage)
    refused(call("learn", tmp_path / "mine.pft", "--out", tmp_path / "x.json"), 1, "is not a saved run")
    refused(call("learn", saved, "--seed", 3, "--out", tmp_path / "x.json"), 2, "leave out the options for new runs")


def test_a_sweep_takes_the_file_for_all_its_runs(learned: Path, call: Call, tmp_path: Path) -> None:
    """`sweep --set learned=@FILE` guides all runs by the file."""
    out = tmp_path / "sweep.parquet"
    cell = "--axis", "sample_count=100", "--trackers", "guided", "--trials", 1, "--frames", 12, "--jobs", 1
    code, _, err = call("sweep", "ball", *cell, "--set", f"learned=@{learned}", "--out", out)
    assert code == 0, err
    plan = read_result(out).plan
    assert plan.live(0).parameters_at(0).learned == learned.read_text()
    assert call("sweep", "report", out, "--no-pictures", "--out", tmp_path / "report")[0] == 0
    assert "own file" in (tmp_path / "report" / "index.html").read_text()
