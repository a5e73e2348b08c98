"""All that names a loss says the same first lost frame: fifty runs, drawn from all experiments."""

import csv
import json
from itertools import chain
from pathlib import Path
from random import Random

import pytest

from pftrack.analysis.counterfactuals import what_if
from pftrack.analysis.diagnosis import diagnose
from pftrack.cli.app import main
from pftrack.core.model.measures import judge_loss
from pftrack.core.refusal import RefusedError
from pftrack.experiments import EXPERIMENTS, find
from pftrack.runs.comparison import Comparison
from pftrack.runs.coverage import measured_run
from pftrack.runs.loss import Loss, loss_words
from pftrack.runs.manifest import manifest_of
from pftrack.runs.many import outcomes
from pftrack.runs.run import Run
from pftrack_server.sessions.state import History

RUNS, FRAMES = 50, 40


def drawn() -> list[tuple[str, str, str, int]]:
    """Return experiment, tracker, preset and seed of each run, drawn by a fixed seed."""
    rng = Random(2)
    found = []
    for _ in range(RUNS):
        experiment = EXPERIMENTS[rng.choice(list(EXPERIMENTS.own))]
        preset = rng.choice(["", *(each.name for each in experiment.presets)])
        found.append((experiment.id, rng.choice(list(experiment.trackers)), preset, rng.randrange(1000)))
    return found


def first(lost: list[bool]) -> int | None:
    return next((frame for frame, gone in enumerate(lost) if gone), None)


def by_export(run: Run, folder: Path) -> int | None:
    """Return the first lost frame by the columns of a table, as whoever reads the file finds it."""
    run.export(folder / "run.csv")
    with (folder / "run.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(line for line in file if not line.startswith("#")))
    flags = [[row.get(name) or None for name in ("lost", "searching")] for row in rows]
    known = [[None if each is None else bool(float(each)) for each in pair] for pair in flags]
    return first([judge_loss(*pair).lost is True for pair in known])


def by_page(run: Run) -> int | None:
    """Return the first lost frame by what a session's page is told of each frame."""
    history = History()
    history.put([row.as_dict() for row in run.diagnostics])
    return first([since is not None for since in history.columns["lost_since"]])


def by_command(run: Run, folder: Path, printed: pytest.CaptureFixture[str]) -> int | None:
    """Return the first lost frame that `pftrack run` prints."""
    (folder / "run.json").write_text(json.dumps(run.recipe.as_dict()), encoding="utf-8")
    with pytest.raises(SystemExit, match="0"):
        main(["run", str(folder / "run.json"), "--json"])
    found: int | None = json.loads(printed.readouterr().out)["first_lost_frame"]
    return found


@pytest.mark.parametrize(("experiment", "tracker", "preset", "seed"), drawn())
def test_everybody_says_the_same_first_lost_frame(
    experiment: str, tracker: str, preset: str, seed: int, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    """Summary, *Why?*, the base of *What if*, comparison, sweep row, page, exports and command line agree."""
    run = measured_run(find(experiment), tracker, preset, seed, FRAMES)
    run.finish()
    loss = Loss.of(run.diagnostics)
    said = loss.first_lost_frame
    made, why, compared = run.summary(), diagnose(run), Comparison.of(run, run)
    values = dict(chain.from_iterable(change.values.items() for change in run.timeline.changes))
    ((row,),) = outcomes(run.experiment, run.setup, values=values, trackers=[tracker], seeds=[seed], frames=run.frames)
    assert made.verdict.first_lost_frame == made.as_dict()["first_lost_frame"] == said
    assert why.first_lost_frame == why.as_dict()["first_lost_frame"] == said
    assert [each.first_lost_frame for each in compared.outcomes] == [said, said]
    assert (row.first_lost_frame, row.lost_frames) == (said, made.verdict.lost_frames) == (said, loss.lost_frames)
    assert manifest_of(run)["loss"]["first_lost_frame"] == said
    assert by_page(run) == by_export(run, tmp_path) == by_command(run, tmp_path, capfd) == said
    if said is None:
        assert why.frame is None
        return
    words = loss_words(run.frames, loss.lost_frames or 0, said)
    assert f"frame {said}" in words
    assert f"frame {said}" in why.sentence
    try:
        report = next(what_if(run, rounds=(1,)))
    except RefusedError:
        assert said == 0
    else:
        assert (report.first_lost_frame, report.loss) == (said, why.frame)
        assert f"frame {said}" in report.loss_sentence
    assert why.frame == loss.lasting
