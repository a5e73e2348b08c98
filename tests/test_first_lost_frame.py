"""Every report of a loss has the same first lost frame: runs drawn from all experiments."""

import csv
from pathlib import Path
from random import Random

import pytest

from pftrack.analysis.counterfactuals import what_if
from pftrack.analysis.diagnosis import diagnose
from pftrack.core.model.measures import judge_loss
from pftrack.core.refusal import RefusedError
from pftrack.experiments import EXPERIMENTS, find
from pftrack.runs.coverage import measured_run
from pftrack.runs.loss import Loss
from pftrack.runs.manifest import manifest_of
from pftrack.runs.run import Run
from pftrack_server.sessions.state import History

RUNS, FRAMES = 16, 40


def drawn() -> list[tuple[str, str, str, int]]:
    """Return experiment, tracker, preset and seed of each run, drawn by a fixed seed; each experiment has one."""
    rng, names = Random(2), list(EXPERIMENTS.own)
    found = []
    for name in [*names, *rng.choices(names, k=RUNS - len(names))]:
        presets = ["", *(each.name for each in EXPERIMENTS[name].presets)]
        found.append((name, rng.choice(list(EXPERIMENTS[name].trackers)), rng.choice(presets), rng.randrange(100)))
    return found


def first(lost: list[bool]) -> int | None:
    return next((frame for frame, gone in enumerate(lost) if gone), None)


def by_export(run: Run, folder: Path) -> int | None:
    """Return the first lost frame by the columns of a table, as a reader of the file finds it."""
    run.export(folder / "run.csv")
    with (folder / "run.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(line for line in file if not line.startswith("#")))
    flags = [[row.get(name) or None for name in ("lost", "searching")] for row in rows]
    known = [[None if each is None else bool(float(each)) for each in pair] for pair in flags]
    return first([judge_loss(*pair).lost is True for pair in known])


@pytest.mark.parametrize(("experiment", "tracker", "preset", "seed"), drawn())
def test_every_report_has_the_same_first_lost_frame(
    experiment: str, tracker: str, preset: str, seed: int, tmp_path: Path
) -> None:
    """Summary, *Why?*, the base of *What if*, manifest, page and export agree."""
    run = measured_run(find(experiment), tracker, preset, seed, FRAMES)
    run.finish()
    loss, why, history = Loss.of(run.diagnostics), diagnose(run), History()
    said = loss.first_lost_frame
    history.put([row.as_dict() for row in run.diagnostics])
    assert run.summary().verdict.first_lost_frame == why.first_lost_frame == said
    assert manifest_of(run)["loss"]["first_lost_frame"] == said
    assert first([since is not None for since in history.columns["lost_since"]]) == by_export(run, tmp_path) == said
    assert why.frame == loss.lasting
    if said is not None:
        assert f"frame {said}" in why.sentence
        try:
            report = next(what_if(run, rounds=(1,)))
        except RefusedError:
            assert said == 0 or run.experiment.trackers[tracker].replays
        else:
            assert (report.first_lost_frame, report.loss) == (said, why.frame)
            assert f"frame {said}" in report.loss_sentence
