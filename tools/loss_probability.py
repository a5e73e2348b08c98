"""Fit the trackers' probabilities that their target is lost, and write the tables of their page.

    python -m tools.loss_probability fit ball   # fits and judges the ball's trackers, and writes their file
    python -m tools.loss_probability judge      # judges all that is declared, into docs/explanation/loss.json
    python -m tools.loss_probability table      # writes what is stored into the page
    python -m tools.loss_probability clips ball # judges them scene by scene, in scenes that nothing was chosen by
    python -m tools.loss_probability clips histogram --recording DIR  # and on a recording with its truth

The file is `loss_probability.json` in the experiment's package, the page docs/explanation/loss.md. A tracker's model is
kept if its expected calibration error is at most 0.05 in scenes that were not fitted, with enough losses there; of
other trackers only that error is kept. A test compares page and record.
"""

import json
import subprocess
from collections.abc import Mapping, Sequence
from contextlib import closing
from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from pftrack.cli.output import progress
from pftrack.core.arrays import Bools, Floats
from pftrack.core.model.marks import Box
from pftrack.core.model.series import Series
from pftrack.experiments import EXPERIMENTS
from pftrack.experiments.experiment import Experiment
from pftrack.experiments.shared.loss_probability import (
    FORMAT,
    MOST_ERROR,
    Logistic,
    LossModel,
    scale,
)
from pftrack.reproduce.finding import Entry, Record, read_record
from pftrack.reproduce.pool import Pool
from pftrack.runs.run import Run
from pftrack.sources.sequence import open_sequence
from pftrack.sources.truth import read_truth
from tools.loss_study import (
    FIRST_JUDGED,
    Judgement,
    Witnessed,
    cases,
    judge,
    loss_probabilities,
    scenes_of,
    witness,
    witnessed,
)

__all__ = [
    "PAGE",
    "RECORD",
    "describe",
    "describe_models",
    "fit",
    "fit_in_scenes",
    "page",
    "path_of",
    "sort_out",
    "write_models",
]

ROOT = Path(__file__).parents[1]
PAGE, RECORD = ROOT / "docs/explanation/loss.md", ROOT / "docs/explanation/loss.json"
RIDGE, FEWEST_LOSSES = 10.0, 5
BEGIN, END = "<!-- tools.loss_probability: from here -->", "<!-- tools.loss_probability: to here -->"
"""Marks around the tables in the page."""

COLUMNS = {
    "calibration error": "calibration error",
    "Brier score (": "Brier score",
    "Brier score of": "of the share alone",
    "area": "area under ROC",
    "share of the reported": "losses detected",
    "frames until": "frames until half are detected",
}
"""Columns of the table: the beginning of a finding's result, and the title."""

DIGITS = 6
"""Significant digits of the numbers in a file."""

MOST_STEPS, SETTLED = 50, 1e-8
"""Most steps of Newton's method, and the change of the weights at which it stops."""

CONSTANT, ENDLESS = 1e-6, 1e300
"""A standard deviation below the first counts as the second; the first is also the least curvature."""

app = typer.Typer(add_completion=False)


CUSTOMARY = ("resampled", "share", "flag", "event", "extent", "likeness", "model_likeness")
"""Roles of the series that are signals of every tracker that has them."""


def signal_names(series: Sequence[Series], *, searches: bool, more: Sequence[str] = ()) -> tuple[str, ...]:
    """Return the signals of a tracker.

    Args:
        series: Its declared series.
        searches: Whether it reports searching its target.
        more: Names of further series of these that are signals.
    """
    roles = {one.role for one in series}
    known = ["evidence", "spread", "step", "jump"]
    known += ["searching"] if searches else []
    known += ["ess"] if {"ess", "particles"} <= roles else []
    return (*known, *(one.name for one in series if one.role in CUSTOMARY or one.name in more))


def path_of(experiment: str) -> Path:
    """Return the file of an experiment's probabilities."""
    return ROOT / "pftrack/experiments" / experiment / "loss_probability.json"


def is_true(judged: Judgement) -> bool:
    """Return whether a probability may be declared.

    It must be calibrated, better than the mere share of lost frames, and judged on enough losses.
    """
    return judged.error <= MOST_ERROR and judged.brier < judged.base and judged.delays.losses >= FEWEST_LOSSES


def signals_of(experiment: Experiment, tracker: str) -> tuple[str, ...]:
    """Return the signals of a tracker."""
    chosen, declared = experiment.trackers[tracker], experiment.quality.loss_probability
    return signal_names(chosen.series, searches=chosen.searching is not None, more=declared.signals)


def fit(features: Floats, outcomes: Bools, *, ridge: float) -> Logistic:
    """Return the best logistic regression of outcomes on features.

    Args:
        features: (L, F), all finite.
        outcomes: (L,) outcome of each row.
        ridge: Precision of each weight's prior; 0 for no prior.
    """
    # The weights are those of greatest likelihood under a Gaussian prior around zero, by Newton's method, which is
    # iteratively reweighted least squares (McCullagh and Nelder, Generalized linear models, 1989, section 2.5).
    means, deviations = features.mean(axis=0), features.std(axis=0)
    deviations = np.where(deviations > CONSTANT, deviations, ENDLESS)
    design = np.column_stack([scale(features, means, deviations), np.ones(len(features))])
    prior = np.diag([ridge] * features.shape[1] + [0.0])
    solution = np.zeros(design.shape[1])
    for _ in range(MOST_STEPS):
        chance = 1.0 / (1.0 + np.exp(-np.clip(design @ solution, -30.0, 30.0)))
        curvature = np.maximum(chance * (1.0 - chance), CONSTANT)
        gradient = design.T @ (outcomes - chance) - prior @ solution
        step = np.linalg.lstsq(design.T @ (design * curvature[:, None]) + prior, gradient, rcond=None)[0]
        solution += step
        if np.abs(step).max() < SETTLED:
            break
    return Logistic(
        tuple(means.tolist()), tuple(deviations.tolist()), tuple(solution[:-1].tolist()), float(solution[-1])
    )


def fit_model(experiment: Experiment, tracker: str, seen: Sequence[Witnessed]) -> LossModel:
    """Return a tracker's model, fitted on runs in the scenes for fitting."""
    regression = fit(
        np.concatenate([one.features for one in seen]), np.concatenate([one.lost for one in seen]), ridge=RIDGE
    )
    series = {one.name: one for one in experiment.trackers[tracker].series}
    return LossModel(signals_of(experiment, tracker), regression, series)


def describe(tracker: str, judged: Judgement) -> str:
    """Return a line on a tracker's result."""
    waits = f"{judged.delays.median:g} frames, {judged.delays.told} of {judged.delays.losses} told"
    kept = "kept" if is_true(judged) else "not kept"
    return (
        f"{tracker}: {kept}, calibration error {judged.error:.3f}, Brier score {judged.brier:.3f} "
        f"({judged.base:.3f}), ROC {judged.roc.area:.3f}, {waits}"
    )


def describe_models(
    models: Mapping[str, LossModel], refused: Mapping[str, float], about: Mapping[str, Any]
) -> dict[str, Any]:
    """Return models as JSON values.

    Args:
        models: Models by tracker.
        refused: Calibration errors of the trackers whose model is not kept.
        about: Data on the fit, JSON values.
    """
    trackers = {name: {"signals": one.signals, **_rounded(asdict(one.regression))} for name, one in models.items()}
    return {**about, "refused": _rounded(refused), "trackers": trackers}


def write_models(described: Mapping[str, Any]) -> str:
    """Return the text of a file from the values of `describe_models`."""
    return json.dumps({"format": FORMAT, "version": 1, **described}, indent=1) + "\n"


def _rounded(values: Mapping[str, Any]) -> dict[str, Any]:
    def shorten(value: float) -> float:
        return float(f"{value:.{DIGITS}g}")

    return {
        name: shorten(value) if isinstance(value, float) else [shorten(one) for one in value]
        for name, value in values.items()
    }


@app.command("fit")
def fit_all(
    name: Annotated[str, typer.Argument(help="Id of the experiment.")],
    jobs: Annotated[int, typer.Option(help="Processes that compute.")] = 1,
) -> None:
    """Fit, judge and keep the probabilities of the trackers of an experiment."""
    with progress(f"{name}, runs") as tick, Pool(jobs, tick) as pool:
        described = fit_in_scenes(pool, name, _revision())
    path_of(name).write_text(write_models(described), "utf-8")


@app.command("judge")
def judge_all(
    jobs: Annotated[int, typer.Option(help="Processes that compute.")] = 1,
    figures: Annotated[Path | None, typer.Option(help="Folder for the figures.")] = None,
) -> None:
    """Judge what all trackers declare, and store it."""
    with progress("runs") as tick, Pool(jobs, tick, figures) as pool:
        found = list(loss_probabilities(pool))
        Record(RECORD, _revision()).keep("loss", "full", found, sources="", pieces=pool.pieces, seconds=pool.seconds)


def _revision() -> str:
    command = ["git", "rev-parse", "--short", "HEAD"]
    return subprocess.run(command, capture_output=True, check=True, text=True).stdout.strip()  # noqa: S603 - no input


def fit_in_scenes(pool: Pool, name: str, revision: str) -> dict[str, Any]:
    """Return the fitted probabilities of an experiment in its scenes, as JSON values."""
    experiment = EXPERIMENTS[name]
    scenes = scenes_of(experiment)
    found: dict[str, tuple[LossModel, Judgement]] = {}
    for tracker in scenes.trackers or experiment.trackers:
        seen = [
            pool.map(witness, cases(name, tracker, range(first, first + count), signals_of(experiment, tracker)))
            for first, count in ((0, scenes.fitted), (FIRST_JUDGED, scenes.judged))
        ]
        model = fit_model(experiment, tracker, seen[0])
        found[tracker] = model, judge(model.regression, seen[1])
    about = {
        "experiment": name,
        "revision": revision,
        "frames": scenes.frames,
        "fitted": [0, scenes.fitted - 1],
        "judged": [FIRST_JUDGED, FIRST_JUDGED + scenes.judged - 1],
    }
    return sort_out(found, about)


def sort_out(found: Mapping[str, tuple[LossModel, Judgement]], about: Mapping[str, Any]) -> dict[str, Any]:
    """Return calibrated models and the errors of the others, as JSON values."""
    for tracker, (_, judged) in found.items():
        typer.echo(describe(tracker, judged))
    models = {tracker: model for tracker, (model, judged) in found.items() if is_true(judged)}
    refused = {tracker: judged.error for tracker, (_, judged) in found.items() if tracker not in models}
    return describe_models(models, refused, about)


NEVER_SEEN = 20_000
"""The first number of the scenes that nothing was fitted to and nothing declared by."""


@app.command("clips")
def judge_clips(
    name: Annotated[str, typer.Argument(help="Id of the experiment.")],
    count: Annotated[int, typer.Option(help="How many scenes.")] = 20,
    recording: Annotated[list[Path], typer.Option(help="Folder with clip.mp4 and gt.csv.")] = [],  # noqa: B006
) -> None:
    """Judge what the trackers of an experiment declare, clip by clip: each scene, or each recording, counts alike."""
    for tracker, model in EXPERIMENTS[name].quality.loss_probability.models.items():
        if recording:
            seen = [witness_recording(name, tracker, folder, model) for folder in recording]
        else:
            scenes = cases(name, tracker, range(NEVER_SEEN, NEVER_SEEN + count), model.signals)
            seen = [witness(case) for case in scenes]
        typer.echo(describe_clips(tracker, [judge(model.regression, [one]) for one in seen if len(one.lost)]))


def witness_recording(name: str, tracker: str, folder: Path, model: LossModel) -> Witnessed:
    """Return what was seen in the run on a recording, which begins at the first true box."""
    truth = read_truth(folder / "gt.csv")
    start = min(truth.boxes)
    experiment = EXPERIMENTS[name]
    with closing(open_sequence(folder / "clip.mp4")) as sequence:
        setup = experiment.video.on_video(sequence, Box.of(*truth.boxes[start]), start=start, truth=truth)
        run = Run(experiment, setup, tracker=tracker, seed=0)
        run.finish()
    return witnessed(run, model.signals)


def describe_clips(tracker: str, judged: Sequence[Judgement]) -> str:
    """Return what came of a tracker clip by clip, a line; a clip that is never or always lost has no share to beat."""
    mixed = [one for one in judged if one.base > 0.0]
    better = sum(one.brier < one.base for one in mixed)
    error = float(np.mean([one.error for one in judged]))
    return (
        f"{tracker}: calibration error of a clip {error:.3f}, mean of {len(judged)}; "
        f"Brier score below the clip's own share in {better} of {len(mixed)} that are lost and held"
    )


@app.command("table")
def write_table() -> None:
    """Write the tables into the page."""
    PAGE.write_text(page(PAGE.read_text("utf-8"), read_record(RECORD)), "utf-8")


def page(text: str, record: Mapping[str, Entry]) -> str:
    """Return the text of the page with the tables of a record in it."""
    before, rest = text.split(BEGIN)
    return f"{before}{BEGIN}\n{_tables(record['loss'])}\n{END}{rest.split(END)[1]}"


def _tables(entry: Entry) -> str:
    rows: dict[str, dict[str, dict[str, float]]] = {}
    refused: dict[str, dict[str, str]] = {}
    for one in entry.findings:
        name, tracker = one.result.split(": ")[1].split(", ")
        if one.verdict == "not run":
            refused.setdefault(name, {})[tracker] = one.reason
        else:
            what = one.result.split(": ", 2)[2]
            column = next(title for begins, title in COLUMNS.items() if what.startswith(begins))
            rows.setdefault(name, {}).setdefault(tracker, {})[column] = one.ours
    return "\n\n".join(
        _table(name, rows.get(name, {}), refused.get(name, {})) for name in dict.fromkeys([*rows, *refused])
    )


def _table(name: str, rows: dict[str, dict[str, float]], refused: dict[str, str]) -> str:
    titles = list(COLUMNS.values())
    said = [f"**{EXPERIMENTS[name].title}** (`{name}`)", ""]
    if rows:
        said += [f"| tracker | {' | '.join(titles)} |", f"|{'---|' * (len(titles) + 1)}"]
        said += [
            f"| `{tracker}` | {' | '.join(_cell(title, values[title]) for title in titles)} |"
            for tracker, values in rows.items()
        ]
    if rows and refused:
        said.append("")
    said += [f"- `{tracker}`: {reason}." for tracker, reason in refused.items()]
    return "\n".join(said)


def _cell(title: str, value: float) -> str:
    if title == "losses detected":
        return f"{100 * value:.0f} %"
    return f"{value:g}" if title.startswith("frames") else f"{value:.3f}"


if __name__ == "__main__":
    app()
