"""`evaluate`: run a tracker over the sequences of a benchmark that a user brings, by the benchmark's own protocol."""

from pathlib import Path
from statistics import fmean
from typing import TYPE_CHECKING, Annotated, Any

import typer

from pftrack.cli.checks import compiling
from pftrack.cli.listing import Assignments, Json, find_experiment
from pftrack.cli.output import CommandError, emit, note, progress, table, values_of, whole, wrong_use

if TYPE_CHECKING:
    from pftrack.analysis.evaluation import Score


SHOWN = ("CPF", "KMS", "MIL", "STRUCK")
"""Published trackers in the table; JSON has all."""

group = typer.Typer(help="Run a tracker over a public benchmark's sequences.", no_args_is_help=True)


def register(app: typer.Typer) -> None:
    """Add the commands of this module."""
    app.add_typer(group, name="evaluate")


@group.callback()
def _evaluate() -> None:
    """Run a tracker over a public benchmark's sequences."""


@group.command()
def otb(
    folder: Annotated[
        Path, typer.Argument(metavar="DIR", help="A sequence in the form of OTB or VOT, or a folder of such sequences.")
    ],
    experiment: Annotated[
        str | None, typer.Option(help="An experiment's name; the first that believes in a box if not given.")
    ] = None,
    tracker: Annotated[str | None, typer.Option(help="A tracker's name, as `show` prints it.")] = None,
    seeds: Annotated[str, typer.Option(metavar="N", help="Runs of each sequence, with the seeds 0 to N - 1.")] = "10",
    assignments: Assignments = None,
    json: Json = False,
) -> None:
    """Follow the first box of each sequence (OPE): success (area under the curve) and precision, beside published ones.

    The pictures are yours to bring: https://github.com/jwlim/tracker_benchmark says where they are.
    """
    from pftrack.analysis.evaluation import (
        PUBLISHED_SOURCE,
        BenchmarkError,
        evaluate_sequence,
        find_sequences,
        follows_boxes,
        published,
    )
    from pftrack.experiments import EXPERIMENTS
    from pftrack.sources.limits import SourceError

    chosen = experiment or next(one.id for one in EXPERIMENTS.values() if follows_boxes(one))
    followed, count = find_experiment(chosen), whole("--seeds", seeds, 1, 1000)
    name = tracker or followed.default_tracker
    if name not in followed.trackers:
        raise wrong_use(f"a tracker of {followed.id} must be one of {', '.join(followed.trackers)}, got {name!r}")
    scores: list[Score] = []
    try:
        sequences = find_sequences(folder)
        with progress(f"{followed.id}, {name}") as tick, compiling():
            done = 0

            def on_run() -> None:
                nonlocal done
                done += 1
                tick(done, count * len(sequences))

            scores.extend(
                evaluate_sequence(
                    followed,
                    sequence,
                    tracker=name,
                    seeds=count,
                    values=lambda setup: values_of(setup.parameters, assignments or []),
                    on_run=on_run,
                )
                for sequence in sequences
            )
    except (BenchmarkError, SourceError) as error:
        raise CommandError(str(error)) from None
    for score in scores:
        if score.grey:
            note(f"pftrack: {score.name} is grey: a tracker by colours sees its brightness alone")
    rows = [{**score.as_dict(), "published": dict(published(score.name))} for score in scores]
    mean = fmean(fmean(score.success) for score in scores)
    if json:
        said = {"experiment": followed.id, "tracker": name, "seeds": count, "sequences": rows, "success_mean": mean}
        emit({**said, "published_source": PUBLISHED_SOURCE})
        return
    _print(rows, mean)
    note(f"pftrack: success is the area under the curve; published: {PUBLISHED_SOURCE}")


def _print(rows: list[dict[str, Any]], mean: float) -> None:
    names = SHOWN if any(row["published"] for row in rows) else ()
    columns = "sequence", "frames", "frames/s", "within 20 px", "success", *names
    cells = [
        (
            row["name"],
            str(row["frames"]),
            f"{row['frames_per_second']:.0f}",
            f"{row['precision_mean']:.2f}",
            f"{row['success_mean']:.3f}",
            *(f"{row['published'][name]:.3f}" if name in row["published"] else "" for name in names),
        )
        for row in rows
    ]
    known = [row for row in rows if row["published"]]
    whole_table = len(known) == len(rows)
    means = [f"{fmean(row['published'][name] for row in known):.3f}" if whole_table else "" for name in names]
    table("", columns, [*cells, ("mean", "", "", "", f"{mean:.3f}", *means)])
