"""Fit the probabilities by which trackers say that their target is lost, and write the tables of their page.

    python -m tools.loss_probability fit ball   # fits those of the ball, judges them, and writes its file
    python -m tools.loss_probability table      # writes what `pftrack reproduce loss` found into the page

The file is `loss_probability.json` in the experiment's package, the page docs/explanation/loss.md. Kept are those
trackers whose expected calibration error in scenes that were not fitted is at most 0.05, and that were lost often
enough there to tell; of the others that error is kept alone. A test compares page and record.
"""

import subprocess
from pathlib import Path
from typing import Annotated

import typer

from pftrack.cli.output import progress
from pftrack.experiments import EXPERIMENTS
from pftrack.loss_probability.declaration import write_models
from pftrack.loss_probability.model import LossModel
from pftrack.loss_probability.scenes import FIRST_JUDGED
from pftrack.reproduce import Entry, read_record
from pftrack.reproduce.loss_probability import (
    Judgement,
    Witnessed,
    cases,
    fit_model,
    judge,
    scenes_of,
    signals_of,
    witness,
)
from pftrack.reproduce.pool import Pool
from tools.reproduction import RECORD

__all__ = ["PAGE", "describe", "judge_fit", "keep", "page", "path_of"]

ROOT = Path(__file__).parents[1]
PAGE = ROOT / "docs/explanation/loss.md"
BEGIN, END = "<!-- tools.loss_probability: from here -->", "<!-- tools.loss_probability: to here -->"

COLUMNS = {
    "calibration error": "calibration error",
    "Brier score (": "Brier score",
    "Brier score of": "of the share alone",
    "area": "area under ROC",
    "share of the losses": "losses told",
    "frames until": "frames until half are told",
}
"""Of the table: how the result of a finding begins, and the title."""

app = typer.Typer(add_completion=False)


def path_of(experiment: str) -> Path:
    """Return the file in which the probabilities of an experiment are kept."""
    return ROOT / "pftrack/experiments" / experiment / "loss_probability.json"


def describe(tracker: str, judged: Judgement) -> str:
    """Return what came of a tracker, a line."""
    waits = f"{judged.delays.median:g} frames, {judged.delays.told} of {judged.delays.losses} told"
    kept = "kept" if judged.is_true else "not kept"
    return (
        f"{tracker}: {kept}, calibration error {judged.error:.3f}, Brier score {judged.brier:.3f} "
        f"({judged.base:.3f}), ROC {judged.roc.area:.3f}, {waits}"
    )


def judge_fit(name: str, tracker: str, fitted: list[Witnessed], others: list[Witnessed]) -> tuple[LossModel, Judgement]:
    """Return a fitted probability, and how good it is in other scenes."""
    model = fit_model(EXPERIMENTS[name], tracker, fitted)
    return model, judge(model.regression, others)


def keep(experiment: str, models: dict[str, LossModel], refused: dict[str, float], revision: str) -> None:
    """Write the probabilities of an experiment into its file."""
    scenes = scenes_of(EXPERIMENTS[experiment])
    about = {
        "experiment": experiment,
        "revision": revision,
        "frames": scenes.frames,
        "fitted": [0, scenes.fitted - 1],
        "judged": [FIRST_JUDGED, FIRST_JUDGED + scenes.judged - 1],
    }
    path_of(experiment).write_text(write_models(models, refused, about), "utf-8")


@app.command("fit")
def fit_all(
    name: Annotated[str, typer.Argument(help="Id of the experiment.")],
    jobs: Annotated[int, typer.Option(help="Processes that compute.")] = 1,
) -> None:
    """Fit, judge and keep the probabilities of all trackers of an experiment."""
    experiment = EXPERIMENTS[name]
    scenes = scenes_of(experiment)
    models: dict[str, LossModel] = {}
    refused: dict[str, float] = {}
    with progress(f"{name}, runs") as tick, Pool(jobs, tick) as pool:
        for tracker in scenes.trackers or experiment.trackers:
            seen = [
                pool.map(witness, cases(name, tracker, range(first, first + count), signals_of(experiment, tracker)))
                for first, count in ((0, scenes.fitted), (FIRST_JUDGED, scenes.judged))
            ]
            model, judged = judge_fit(name, tracker, *seen)
            typer.echo(describe(tracker, judged))
            if judged.is_true:
                models[tracker] = model
            else:
                refused[tracker] = judged.error
    revision = subprocess.run(["git", "rev-parse", "--short", "HEAD"], capture_output=True, check=True, text=True)  # noqa: S607
    keep(name, models, refused, revision.stdout.strip())


@app.command("table")
def write_table() -> None:
    """Write what was found into the page."""
    PAGE.write_text(page(PAGE.read_text("utf-8"), read_record(RECORD)), "utf-8")


def page(text: str, record: dict[str, Entry]) -> str:
    """Return the text of the page with the tables of a record in it."""
    before, rest = text.split(BEGIN)
    return f"{before}{BEGIN}\n{_tables(record)}\n{END}{rest.split(END)[1]}"


def _tables(record: dict[str, Entry]) -> str:
    rows: dict[str, dict[str, dict[str, float]]] = {}
    refused: dict[str, dict[str, str]] = {}
    for one in record["loss"].findings:
        name, tracker = one.result.removeprefix("loss: ").split(": ")[0].split(", ")
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
    if title == "losses told":
        return f"{100 * value:.0f} %"
    return f"{value:g}" if title.startswith("frames") else f"{value:.3f}"


if __name__ == "__main__":
    app()
