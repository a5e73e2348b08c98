"""`reproduce`, `evaluate`, `bench` and `doctor`: checks of figures, accuracy, speed and the installation."""

import json as json_format
from pathlib import Path
from statistics import fmean
from typing import TYPE_CHECKING, Annotated, Any

import typer

from pftrack.cli import output
from pftrack.cli.experiments import TrackerName, find_experiment, find_tracker
from pftrack.core.version import __version__

if TYPE_CHECKING:
    from pftrack.analysis.evaluation import Score


SHOWN = ("CPF", "KMS", "MIL", "STRUCK")
"""Published trackers in the table; JSON has all."""


def register(app: typer.Typer) -> None:
    """Add the commands of this module."""
    evaluate = typer.Typer(help="Run a tracker over a public benchmark's sequences.", no_args_is_help=True)
    evaluate.callback()(lambda: None)
    evaluate.command()(otb)
    app.add_typer(evaluate, name="evaluate")
    for command in (reproduce, bench, doctor):
        app.command()(command)


def reproduce(
    results: Annotated[
        list[str] | None, typer.Argument(metavar="[RESULT]...", help="Which results; all if none.")
    ] = None,
    full: Annotated[bool, typer.Option("--full/--quick", help="Run all published trials, or a quick subset.")] = False,
    jobs: output.Jobs = None,
    figures: Annotated[
        Path | None, typer.Option(help="Folder in which to keep the sweeps of the maps and draw the published figures.")
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(metavar="FILE.json", help="Store each result in a file when computed; a second call continues."),
    ] = None,
    revision: Annotated[str, typer.Option(help="Version of pftrack to record in the file.")] = __version__,
    cluster: output.Cluster = None,
    json: output.Json = False,
) -> None:
    """Compute published results again and compare them within their tolerances; `--quick` takes about a minute."""
    processes = output.read_jobs(jobs)
    from pftrack.reproduce import RESULTS
    from pftrack.reproduce import reproduce as compute
    from pftrack.reproduce.finding import Record, describe_verdicts

    for name in results or ():
        if name not in RESULTS:
            raise output.wrong_use(f"a result must be one of {', '.join(RESULTS)}, got {name!r}")
    if out is not None:
        output.suffix_of(out, (".json",))
    record = None if out is None else Record(out, revision)
    with output.progress("results", counted=False) as tick:
        computed = compute(
            results or (),
            full=full,
            jobs=processes,
            cluster=cluster,
            progress=tick,
            folder=figures,
            record=record,
        )
    if json:
        output.emit([finding.as_dict() for finding in computed])
    else:
        shown = [finding for finding in computed if finding.verdict != "not run"]
        output.table("", ("result", "ours", "reference", "verdict"), [finding.cells for finding in shown])
        if reasons := [(finding.result, finding.reason) for finding in shown if finding.reason]:
            output.table("", ("result", "why it differs, or is better"), reasons)
    output.note(f"pftrack: {describe_verdicts(computed)}")
    if any(finding.fails for finding in computed):
        raise typer.Exit(output.FAILED)


def bench(
    names: Annotated[
        list[str] | None, typer.Argument(metavar="[NAME]...", help="Which benchmarks; all if none.")
    ] = None,
    smallest: Annotated[bool, typer.Option("--smallest", help="Smoke test only: the figures are meaningless.")] = False,
    json: output.Json = False,
) -> None:
    """Measure speed, and that of other libraries if they are installed."""
    folder = Path(__file__).parents[2] / "benchmarks"
    scripts = {path.stem: path for path in sorted(folder.glob("[a-z]*.py"))}
    if not scripts:
        raise output.CommandError(
            "the benchmarks come with the source, not with the installed package: run this in a checkout"
        )
    for name in names or ():
        if name not in scripts:
            raise output.wrong_use(f"a benchmark must be one of {', '.join(scripts)}, got {name!r}")
    options = [*(["--smallest"] if smallest else []), *(["--json"] if json else [])]
    results = {name: _measure(scripts[name], *options) for name in names or scripts}
    if json:
        output.emit(results)


def doctor(
    warm: Annotated[bool, typer.Option("--warm", help="Compile everything now for a fast first start.")] = False,
    port: Annotated[str, typer.Option(metavar="PORT", help="Port that `serve` will use.")] = "8000",
    data_dir: Annotated[Path | None, typer.Option(help="Data folder that `serve` will use.")] = None,
    json: output.Json = False,
) -> None:
    """Check that this machine has all that pftrack needs."""
    from pftrack.doctor.checks import examine

    checks = examine(port=output.whole("--port", port, 1, 65_535), data_dir=data_dir, warm=warm)
    broken = [check.name for check in checks if check.status == "broken"]
    found = {"healthy": not broken, "checks": [check.as_dict() for check in checks]}
    output.tell(found, ("", "what", "found"), [(check.status, check.name, check.found) for check in checks], json=json)
    if broken:
        output.note(f"pftrack: broken: {', '.join(broken)}")
        raise typer.Exit(output.FAILED)


def _measure(script: Path, *options: str) -> object:
    from pftrack.process import run

    json = "--json" in options
    status, told = run(str(script), *options, output="read" if json else "shown")
    if status:
        raise output.CommandError(f"the benchmark {script.stem} failed with exit status {status}")
    return json_format.loads(told) if json else None


def otb(
    folder: Annotated[
        Path, typer.Argument(metavar="DIR", help="A sequence in the form of OTB or VOT, or a folder of such sequences.")
    ],
    experiment: Annotated[
        str | None, typer.Option(help="An experiment's name (default: the first that outputs boxes).")
    ] = None,
    tracker: TrackerName = None,
    seeds: Annotated[str, typer.Option(metavar="N", help="Runs of each sequence, with the seeds 0 to N - 1.")] = "10",
    assignments: output.Assignments = None,
    json: output.Json = False,
) -> None:
    """Follow the first box of each sequence (OPE): success (area under the curve), precision and published scores.

    You provide the pictures; https://github.com/jwlim/tracker_benchmark lists their sources.
    """
    from pftrack.analysis.evaluation import (
        PUBLISHED_SOURCE,
        evaluate_sequence,
        find_sequences,
        follows_boxes,
        published,
    )
    from pftrack.experiments import EXPERIMENTS

    chosen = experiment or next(one.id for one in EXPERIMENTS.values() if follows_boxes(one))
    followed, count = find_experiment(chosen), output.whole("--seeds", seeds, 1, 1000)
    name = find_tracker(followed, tracker or followed.default_tracker)
    scores: list[Score] = []
    sequences = find_sequences(folder)
    with output.progress(f"{followed.id}, {name}") as tick, output.compiling():
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
                values=lambda setup: output.values_of(setup.parameters, assignments or []),
                on_run=on_run,
            )
            for sequence in sequences
        )
    for score in scores:
        if score.grey:
            output.note(f"pftrack: {score.name} is grey: only brightness and edges show where its target is")
    rows = [{**score.as_dict(), "published": dict(published(score.name))} for score in scores]
    mean = fmean(fmean(score.success) for score in scores)
    if json:
        said = {"experiment": followed.id, "tracker": name, "seeds": count, "sequences": rows, "success_mean": mean}
        output.emit({**said, "published_source": PUBLISHED_SOURCE})
        return
    _print(rows, mean)
    output.note(f"pftrack: success is the area under the curve; published: {PUBLISHED_SOURCE}")


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
    output.table("", columns, [*cells, ("mean", "", "", "", f"{mean:.3f}", *means)])
