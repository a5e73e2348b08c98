"""`pftrack learn`, and the files that it writes as values of parameters."""

import errno
import json
import os
from pathlib import Path

import pytest

from pftrack.core.model.recipe import Change, Recipe
from pftrack.experiments import find
from pftrack.runs.record import read, save
from pftrack.runs.reproduction import make
from pftrack.sweep import Plan, read_result
from tests.cli.commands import Call, refused

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


def test_saved_runs_and_new_ones_teach_the_same(saved: Path, learned: Path, call: Call) -> None:
    """A saved run is learned from by its numbers, to the file that the same run teaches when it is computed."""
    again = saved.with_name("again.json")
    code, out, _ = call("learn", "ball", "--tracker", "h-spf", "--frames", 25, "--trials", 1, "--out", again, "--json")
    assert code == 0
    assert again.read_text() == learned.read_text()
    said = json.loads(out)
    assert (said["experiment"], said["tracks"], said["reading"]) == ("ball", 1, "fixed")
    assert said["changes"] == ["u''", "v''"]
    assert said["frames"] + said["left_out"] == 25
    assert len(said["modes"]) == len(said["eigenvalues"]) == 2


def test_several_runs_are_learned_from_together(saved: Path, call: Call) -> None:
    """Runs of several seeds, and one of each value of an axis, make as many tracks; a person sees what was learned."""
    place = saved.with_name("three.json")
    code, out, err = call("learn", "ball", "--frames", 20, "--trials", 3, "--out", place)
    assert code == 0
    assert "standard deviation" in out
    assert "learned from 3 tracks" in err
    assert "learned from 2 tracks" in call("learn", "ball", "--frames", 20, "--axis", "period_s=1,2", "--out", place)[2]


def test_a_run_is_guided_by_a_file_and_carries_it(learned: Path, call: Call) -> None:
    """`--learned` and `--set learned=@FILE` are the same, and not what is built in; the run replays."""
    by_option = json.loads(call(*GUIDED, "--learned", learned, "--json")[1])
    by_value = json.loads(call(*GUIDED, "--set", f"learned=@{learned}", "--json")[1])
    plain = json.loads(call(*GUIDED, "--json")[1])
    assert by_option["estimates_sha256"] == by_value["estimates_sha256"] != plain["estimates_sha256"]
    place = learned.with_name("guided.pft")
    assert call(*GUIDED, "--learned", learned, "--out", place)[0] == 0
    assert read(place).recipe.timeline[0].values["learned"] == learned.read_text()
    assert json.loads(call("replay", place, "--json")[1])["same_as_saved"] is True


def test_a_branch_keeps_the_file(learned: Path) -> None:
    """A branch is guided by what its run is guided by, until another file comes."""
    guidance = find("ball").guidance
    assert guidance is not None
    values = {"learned": learned.read_text()}
    run = make(Recipe(experiment="ball", tracker="guided", frames=12, timeline=(Change(0, values),)))
    run.finish()
    branch = run.branch(5)
    branch.finish()
    assert branch.estimates_sha256 == run.estimates_sha256
    other = run.branch(5, {"learned": ""})
    other.finish()
    assert other.estimates_sha256 != run.estimates_sha256
    assert guidance.parse(other.parameters_at(11).learned).tracks == 10


def test_the_open_run_offers_what_it_teaches(saved: Path, learned: Path, call: Call) -> None:
    """`--export` writes the same file as `learn` does of the saved run; one that teaches nothing is refused."""
    place = learned.with_name("open.learned.json")
    assert call("replay", saved, "--export", place)[0] == 0
    assert place.read_text() == learned.read_text()
    refused(call("run", "ball", "--frames", 4, "--export", place), 1, "expected at least 10 frames", "got")
    refused(call("run", "ball", "--frames", 4, "--export", "x.stl"), 2, ".learned.json")


def test_an_export_that_cannot_be_written_leaves_what_was_there(
    saved: Path, tmp_path: Path, call: Call, monkeypatch: pytest.MonkeyPatch
) -> None:
    """On a full disk the old file is whole, and no piece of the new one lies beside it."""

    def full(*_: Path) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    place = tmp_path / "old.learned.json"
    place.write_text("old")
    monkeypatch.setattr("pftrack.output.exports.formats.settle", full)
    refused(call("replay", saved, "--export", place), 1, "cannot be written: No space left on device")
    assert [(each, each.read_text()) for each in tmp_path.iterdir()] == [(place, "old")]


def test_people_see_the_beginning_of_a_file_only(learned: Path, call: Call) -> None:
    """In the table of a run a file is cut short."""
    _, out, _ = call(*GUIDED, "--learned", learned)
    assert "pftrack-learned" in out
    assert "step_sd" not in out


@pytest.mark.parametrize(
    ("arguments", "status", "words"),
    [
        (("learn", "sine", "--out", "x.json"), 2, ("sine takes no learn", "ball")),
        (("learn", "ball", "sine", "--out", "x.json"), 2, ("name one experiment, or saved runs",)),
        (("learn", "nothing", "--out", "x.json"), 2, ("nothing",)),
        (("learn", "ball", "--frames", "3", "--trials", "1", "--out", "x.json"), 1, ("got 1 in 1 track;",)),
        (("learn", "ball", "--trials", "0", "--out", "x.json"), 2, ("--trials", "between 1 and")),
        (("learn", "ball", "--out", "/nowhere/x.json"), 1, ("/nowhere/x.json cannot be written",)),
        (("learn", "ball", "--tracker", "none", "--out", "x.json"), 2, ("a tracker of ball is one of",)),
        (("learn", "ball", "--axis", "nothing=1", "--out", "x.json"), 2, ("ball has no parameter 'nothing'",)),
        (("learn", "there_is_none.pft", "--out", "x.json"), 1, ("the file there_is_none.pft does not exist",)),
        (("run", "sine", "--learned", "x.json"), 2, ("sine takes no --learned",)),
        (("run", "ball", "--learned", "there_is_none.json"), 1, ("the file there_is_none.json does not exist",)),
        (("run", "ball", "--set", "learned=@there_is_none.json"), 1, ("the file there_is_none.json does not exist",)),
        (("run", "ball", "--set", "learned=nonsense"), 2, ("learned must be a learned motion (it is not JSON",)),
    ],
)
def test_what_cannot_be_learned_or_used_is_refused(
    arguments: tuple[str, ...],
    status: int,
    words: tuple[str, ...],
    call: Call,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """One line says what is wrong and what would do."""
    monkeypatch.chdir(tmp_path)
    refused(call(*arguments), status, *words)


def test_files_that_hold_no_text_or_no_states_are_refused(saved: Path, call: Call, tmp_path: Path) -> None:
    """A file that is no text, too large or empty is no learned file; one that is no run teaches nothing."""
    garbage, large, empty = (tmp_path / f"{name}.json" for name in ("garbage", "large", "empty"))
    garbage.write_bytes(b"\xff\xfe\x00\x81")
    large.write_bytes(b" " * 500_000)
    refused(call("run", "ball", "--learned", garbage), 1, "is not a text")
    empty.write_text("\n")
    refused(call("run", "ball", "--learned", large), 1, "KiB allowed")
    refused(call("run", "ball", "--learned", empty), 1, "empty.json is empty")
    garbage.rename(tmp_path / "garbage.pft")
    refused(call("learn", tmp_path / "garbage.pft", "--out", tmp_path / "x.json"), 1, "is not a saved run")
    refused(call("learn", saved, "--seed", 3, "--out", tmp_path / "x.json"), 2, "leave out what only makes new ones")


def test_a_file_of_another_experiment_is_refused(learned: Path, call: Call, tmp_path: Path) -> None:
    """What was learned elsewhere is refused with both names."""
    other = tmp_path / "other.json"
    other.write_text(learned.read_text().replace('"ball"', '"fish"'))
    refused(call(*GUIDED, "--learned", other), 2, "it was learned in 'fish', and this is 'ball'")


def test_a_sweep_takes_the_file_for_all_its_runs(learned: Path, call: Call, tmp_path: Path) -> None:
    """`sweep --set learned=@FILE` guides all runs by the file, to the numbers of single ones."""
    out = tmp_path / "sweep.parquet"
    code, _, err = call(
        "sweep", "ball", "--axis", "sample_count=100", "--trackers", "guided", "--trials", 1, "--frames", 12,
        "--set", f"learned=@{learned}", "--jobs", 1, "--out", out,
    )  # fmt: skip
    assert code == 0, err
    plan = read_result(out).plan
    assert plan.live(0).parameters_at(0).learned == learned.read_text()
    assert call("sweep", "report", out, "--out", tmp_path / "report")[0] == 0
    assert "own file" in (tmp_path / "report" / "index.html").read_text()
