"""`sweep` and `learn`: compute an experiment over a grid of conditions, report on it, or learn motion from its runs."""

import signal
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import astuple, dataclass, replace
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer
from typer.core import TyperGroup

from pftrack.cli import output
from pftrack.cli.experiments import PresetName, TrackerName, find_experiment, find_preset, read_filters, with_filters
from pftrack.cli.footage import FootageOptions, Swept, place_of, swept_recording

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from pftrack.core.model.parameters import Value
    from pftrack.core.model.source import Kind
    from pftrack.experiments.experiment import Experiment
    from pftrack.filters.learning.diffusion import Guidance, Learned
    from pftrack.sources.sequence import Recording
    from pftrack.sweep import Plan
    from pftrack.sweep.driver import Progress


SIGNALS = signal.SIGINT, signal.SIGTERM, signal.SIGHUP


class _Sweep(TyperGroup):
    """`sweep EXPERIMENT ...` is short for `sweep run EXPERIMENT ...`."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:  # noqa: ANN401 - typer's own context has no public name
        return super().parse_args(ctx, args if args and args[0] in self.commands else ["run", *args])


@dataclass(frozen=True)
class PlanOptions:
    """The options of a plan's runs, as given."""

    preset: PresetName = None
    axes: Annotated[
        list[str] | None,
        typer.Option(
            "--axis",
            metavar="NAME=VALUES",
            help="start:stop:step, both ends included, or a,b,c; repeated axes multiply.",
        ),
    ] = None
    trials: Annotated[
        str | None,
        typer.Option(metavar="T", help="Runs per tracker and condition (default 10; 1 for `learn --axis`)."),
    ] = None
    frames: Annotated[str | None, typer.Option(metavar="N", help="Length of a run in frames.")] = None
    assignments: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="NAME=VALUE", help="A parameter's value in all runs; may be repeated."),
    ] = None
    seed: Annotated[
        str | None, typer.Option(metavar="SEED", help="Base seed; each run derives its own (default 0).")
    ] = None


def register(app: typer.Typer) -> None:
    """Add the commands of this module."""
    sweep = typer.Typer(cls=_Sweep, add_completion=False, help="Compute an experiment over a grid of conditions.")
    sweep.command()(run)
    sweep.command()(report)
    app.command()(learn)
    app.add_typer(sweep, name="sweep")


@output.takes_options
def run(
    experiment: Annotated[str | None, typer.Argument(help="An experiment's name, as `list` prints it.")] = None,
    *,
    said: FootageOptions,
    trackers: Annotated[
        str | None, typer.Option(metavar="A,B,C", help="Trackers' names, as `show` prints them, or files with filters.")
    ] = None,
    asked: PlanOptions,
    loss_probability: Annotated[
        bool, typer.Option("--loss-probability", help="Also measure the probability that the target is lost.")
    ] = False,
    jobs: output.Jobs = None,
    cluster: output.Cluster = None,
    out: Annotated[Path | None, typer.Option(help="The result, FILE.parquet; never overwritten.")] = None,
    resume: Annotated[Path | None, typer.Option(help="Resume an interrupted sweep, given its --out.")] = None,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="Report the number of runs and the duration.")] = False,
    json: output.Json = False,
) -> None:
    """Compute an experiment over a grid of conditions, one row a run; `pftrack sweep report FILE` shows the result.

    With --video all runs are on a recording, each trial with a seed of its own. Where its truth is not given, runs are
    measured by the trackers' own reports. The word `run` may be left out.
    """
    from pftrack.sweep.axis import SweepError

    processes = output.read_jobs(jobs)
    if cluster is not None and jobs is not None:
        raise output.wrong_use("--cluster computes on its own workers and takes no --jobs")
    planned = [experiment, trackers, out, *astuple(asked), *said.marks, said.start, said.truth]
    if resume is not None and (dry_run or loss_probability or any(it is not None for it in planned)):
        raise output.wrong_use(
            "--resume continues the plan of its file and cannot be combined with a plan, --out or --dry-run"
        )
    if resume is None and experiment is None:
        raise output.wrong_use("name an experiment, `pftrack list` lists them, or --resume a sweep that was stopped")
    plan, swept = None, None
    if experiment is not None:
        found = find_experiment(experiment)
        with output.refusing(SweepError):
            swept = swept_recording(found, said, out)
            chosen, filters = read_filters([name.strip() for name in trackers.split(",")] if trackers else [])
            plan = plan_of(with_filters(found, filters), asked, chosen, swept)
            plan = replace(plan, loss_probability=loss_probability)
        if dry_run:
            _estimate(plan, processes, swept.recording if swept else None, json=json)
            return
    place = _place(resume, out)
    recording = swept.recording if swept else _recording_of(place, said.video) if resume else None
    _compute(plan, place, processes, cluster, recording, json=json)


def report(
    file: Annotated[Path, typer.Argument(help="The result of a sweep, finished or not.")],
    out: Annotated[
        Path | None,
        typer.Option(metavar="FOLDER", help="Folder of the report (default: FILE-report next to the file)."),
    ] = None,
    x: Annotated[str | None, typer.Option(metavar="AXIS", help="Parameter on the x axis of the maps.")] = None,
    y: Annotated[str | None, typer.Option(metavar="AXIS", help="Parameter on the y axis of the maps.")] = None,
    level: Annotated[str, typer.Option(metavar="P", help="Significance level.")] = "0.01",
    svg: Annotated[bool, typer.Option("--svg", help="Draw the maps as SVG rather than PNG.")] = False,
    pictures: Annotated[bool, typer.Option(help="Draw the figures, which takes longest.")] = True,
    json: output.Json = False,
) -> None:
    """Show the result of a sweep: tables here, maps and a self-contained page in a folder."""
    from pftrack.sweep import read_result
    from pftrack.sweep.report.files import write_report

    significant = _level(level)
    result = read_result(file)
    folder = out or result.path.with_name(f"{file.name.split('.parquet')[0]}-report")
    if folder.exists() and not folder.is_dir():
        raise output.wrong_use(f"--out must be a folder, {folder} is a file")
    form: Literal["png", "svg"] = "svg" if svg else "png"
    made = write_report(result, folder, x=x, y=y, level=significant, form=form if pictures else None)
    if json:
        output.emit(made.as_dict())
        return
    for shown in made.tables:
        if not shown.folded:
            output.table(shown.title, shown.columns, shown.rows)
            typer.echo("")
    folded = sum(shown.folded for shown in made.tables)
    rest = f"; {folded} more tables, a measure each, are on the page and in tables.csv" if folded else ""
    output.note(f"pftrack: {len(made.files)} files written to {folder}; open {made.page}{rest}")


def plan_of(
    experiment: "Experiment", asked: PlanOptions, trackers: Sequence[str], swept: Swept | None = None, trials: int = 10
) -> "Plan":
    """Return the runs that the options of a command line describe, on a recording if there is one.

    Args:
        experiment: Whose runs they are.
        asked: The options.
        trackers: Names; the preset's or the experiment's own if there are none.
        swept: The recording.
        trials: Number of runs of each kind, unless an option sets it.

    Raises:
        SweepError: They make no sense together.
    """
    from pftrack.core.model.recipe import LONGEST_RUN
    from pftrack.sweep import Plan
    from pftrack.sweep.axis import MOST_RUNS, parse_axis

    kind = swept.kind if swept else None
    varied = tuple(parse_axis(experiment, text, kind) for text in asked.axes or ())
    named = tuple(trackers)
    values = _values(experiment, asked.assignments or [], kind)
    preset = find_preset(experiment, asked.preset)
    if preset is not None:  # separate options have precedence
        said = {axis.name for axis in varied} | set(values)
        values = {name: value for name, value in preset.parameters.items() if name not in said} | values
        if not named and "tracker" not in said:
            named = (preset.tracker,)
    wanted = 0 if asked.frames is None else output.whole("--frames", asked.frames, 1, LONGEST_RUN)
    if swept is not None:
        wanted = min(wanted or swept.frames, swept.frames)
    return Plan(
        experiment=experiment.id,
        axes=varied,
        trackers=named,
        trials=trials if asked.trials is None else output.whole("--trials", asked.trials, 1, MOST_RUNS),
        seed=output.read_seed(asked.seed) or 0,
        frames=wanted,
        values=values,
        footage=swept.footage if swept else None,
        kind=kind,
        filters=experiment.filters,
    )


def _values(experiment: "Experiment", assignments: list[str], kind: "Kind | None") -> "dict[str, Value]":
    from pftrack.core.refusal import ParameterError
    from pftrack.sweep.axis import SweepError, find_declaration

    values: dict[str, Value] = {}
    model = type(experiment.parameters_on(kind))
    for name, text in map(output.assign, assignments):
        if name in values:
            raise output.wrong_use(f"--set gives {name} twice")
        if name != "tracker":
            find_declaration(experiment, name, kind)
        try:
            values[name] = text if name == "tracker" else output.value_of(model, name, text)
        except ParameterError as error:
            raise SweepError(str(error)) from None
    return values


def _place(resume: Path | None, out: Path | None) -> Path:
    """Return where the result goes, after seeing that it can."""
    if resume is not None:
        return resume
    if out is None:
        raise output.wrong_use("--out FILE.parquet says where the result goes; it is needed unless --dry-run is given")
    if out.suffix != ".parquet":
        raise output.wrong_use(f"--out must end in .parquet, got {out.name!r}")
    output.check_writable(out)
    return out


def _recording_of(place: Path, video: Path | None) -> "Recording | None":
    """Return the path of a begun sweep's recording: the given one, else the one in its plan."""
    from pftrack.sources.sequence import Recording
    from pftrack.sweep import resume as journal_of

    footage = journal_of(place).plan.footage
    if footage is None:
        if video is not None:
            raise output.wrong_use(f"{place} is a sweep of a simulated scene and takes no --video")
        return None
    return Recording(str(place_of(footage, place, video, "the sweep is on")))


def _estimate(plan: "Plan", jobs: int, recording: "Recording | None", *, json: bool) -> None:
    from pftrack.sweep import estimate

    found = estimate(plan, jobs, recording)
    if json:
        output.emit({"runs": found.runs, "cells": found.conditions, "seconds": found.seconds})
    else:
        typer.echo(
            f"{found.runs:,} runs in {found.conditions:,} cells, about {_duration(found.seconds)} on {jobs} "
            f"{'process' if jobs == 1 else 'processes'} ({1e3 * found.run_s:.3g} ms a run)"
        )


def _compute(
    plan: "Plan | None", out: Path, jobs: int, cluster: str | None, recording: "Recording | None", *, json: bool
) -> None:
    from pftrack.sweep import carry_out, summary
    from pftrack.sweep.axis import SweepStopped
    from pftrack.sweep.report.study import Study, totals

    begun = perf_counter()
    with _stoppable() as stop, output.progress(plan.experiment if plan else out.stem) as tick:
        show = _Shown(tick)
        try:
            result = carry_out(plan, out, jobs=jobs, cluster=cluster, recording=recording, progress=show, stop=stop)
        except SweepStopped:
            done, total = show.seen
            raise output.CommandError(
                f"stopped with {done:,} of {total:,} runs computed; resume with pftrack sweep --resume {out}",
                details={"runs": done, "of": total, "resume": str(out)},
            ) from None
    figures = {**summary(result), "seconds": perf_counter() - begun, "path": str(result.path)}
    if json:
        output.emit(figures)
    else:
        for shown in totals(Study.of(result)):
            output.table(shown.title, shown.columns, shown.rows)
            typer.echo("")
        typer.echo(f"{result.plan.runs:,} rows in {result.path}, {_duration(float(figures['seconds']))}")
    if figures["problems"]:
        output.note(f"pftrack: {figures['problems']:,} runs could not be computed; the column problem says why")


class _Shown:
    """The state of the progress bar, and the number of reported lost workers."""

    def __init__(self, tick: output.Tick) -> None:
        self.seen, self._tick, self._lost = (0, 0), tick, 0

    def __call__(self, progress: "Progress") -> None:
        self.seen = progress.done, progress.runs
        self._tick(*self.seen)
        if progress.lost_workers > self._lost:
            self._lost = progress.lost_workers
            output.note("pftrack: a worker was lost; its chunk is computed again")


@contextmanager
def _stoppable() -> Iterator[Callable[[], bool]]:
    """Let the first signal to stop be a request, which the sweep winds up for; a second one ends it at once."""
    asked = threading.Event()
    before: dict[int, Any] = {number: signal.getsignal(number) for number in SIGNALS}

    def ask(number: int, _: object) -> None:
        asked.set()
        signal.signal(number, before[number] if number == signal.SIGINT else signal.SIG_DFL)

    for number, handler in before.items():
        if handler != signal.SIG_IGN:  # `nohup` and the background of a shell ask for that
            signal.signal(number, ask)
    try:
        yield asked.is_set
    finally:
        for caught, handler in before.items():
            signal.signal(caught, handler)


def _level(text: str) -> float:
    try:
        level = float(text)
    except ValueError:
        level = 0.0
    if not 0 < level < 1:
        raise output.wrong_use(f"--level must be a number between 0 and 1, got {text!r}")
    return level


def _duration(seconds: float) -> str:
    if seconds < 99.5:
        return f"{seconds:.1f} s" if seconds < 9.95 else f"{seconds:.0f} s"
    if seconds < 99 * 60:
        return f"{seconds / 60:.0f} min"
    return f"{seconds / 3600:.1f} h"


@output.takes_options
def learn(
    sources: Annotated[
        list[str],
        typer.Argument(metavar="RUN.pft...|EXPERIMENT", help="Saved runs, or an experiment that is to be run."),
    ],
    out: Annotated[Path, typer.Option(help="The learned file, FILE.json.")],
    tracker: TrackerName = None,
    *,
    asked: PlanOptions,
    json: output.Json = False,
) -> None:
    """Learn how motion and shape change, for trackers that are guided by it (`run --learned FILE`).

    Frames in which the target is lost, by the truth, or looked for are left out.
    """
    import numpy as np

    from pftrack.core.files import write_whole
    from pftrack.sweep.axis import SweepError

    output.check_writable(out)
    if any(source.lower().endswith(".pft") for source in sources):
        if tracker is not None or asked != PlanOptions():
            raise output.wrong_use("saved runs are used as they are: leave out the options for new runs")
        guidance, tracks = _read_states([Path(source) for source in sources])
    else:
        if len(sources) > 1:
            raise output.wrong_use(f"name one experiment, or saved runs, got {', '.join(sources)}")
        experiment = find_experiment(sources[0])
        guidance = guidance_of(experiment, "learn")
        with output.refusing(SweepError):
            plan = plan_of(experiment, asked, [tracker] if tracker else [], trials=1 if asked.axes else 10)
        with output.compiling():
            tracks = [guidance.states(rows) for rows in _runs_of(plan)]
    learned = guidance.learn(tracks)
    write_whole(out, learned.text.encode())
    total = sum(map(len, tracks))
    left_out = total - sum(int(np.isfinite(track).all(axis=1).sum()) for track in tracks)
    columns = ("change", "mean", "standard deviation", "unit", "correlations")
    output.tell(_about(learned, left_out), columns, _rows(learned), json=json)
    if json:
        return
    left = f"; {left_out} of {total} frames were left out" if left_out else ""
    output.note(f"pftrack: learned from {learned.origin}{left}; written to {out}")


def guidance_of(experiment: "Experiment", what: str) -> "Guidance":
    """Return how an experiment's runs are learned from; wrong use if they are not."""
    if experiment.guidance is None:
        from pftrack.experiments import EXPERIMENTS

        able = ", ".join(it.id for it in EXPERIMENTS.values() if it.guidance) or "none"
        raise output.wrong_use(f"{experiment.id} takes no {what}: motion is learned in {able}")
    return experiment.guidance


def _read_states(paths: Sequence[Path]) -> "tuple[Guidance, list[NDArray[Any]]]":
    """Return the recorded states of saved runs, by the numbers that they hold."""
    from pftrack.runs.record import read, read_columns

    experiments = {read(path).recipe.experiment for path in paths}
    if len(experiments) > 1:
        raise output.wrong_use(f"expected runs of one experiment, got those of {', '.join(sorted(experiments))}")
    guidance = guidance_of(find_experiment(experiments.pop()), "learn")
    return guidance, [guidance.saved_states(read_columns(path), path.name) for path in paths]


def _runs_of(plan: "Plan") -> Iterator[Any]:
    """Yield the rows of one run after the other."""
    with output.progress(f"{plan.experiment}, runs to learn from") as tick:
        for number in range(plan.runs):
            run = plan.live(number)
            run.finish()
            tick(number + 1, plan.runs)
            yield run.diagnostics


def _about(learned: "Learned", left_out: int) -> dict[str, Any]:
    reading = learned.chart.readings[0]
    diffusion = learned.diffusion(reading, drifting=True)
    found = {name: getattr(diffusion, name).tolist() for name in ("mean", "sd", "correlation", "eigenvalues")}
    return {
        **output.picked(learned, "experiment", "tracks", "frames"),
        "left_out": left_out,
        "reading": reading,
        "changes": learned.chart.change_names,
        "units": learned.chart.change_units,
        **found,
        "modes": diffusion.modes.T.tolist(),
    }


def _rows(learned: "Learned") -> list[tuple[str, ...]]:
    diffusion = learned.diffusion(learned.chart.readings[0], drifting=True)
    return [
        (
            name,
            f"{diffusion.mean[i]:.3g}",
            f"{diffusion.sd[i]:.3g}",
            learned.chart.change_units[i],
            " ".join(f"{number:+.2f}" for number in diffusion.correlation[i]),
        )
        for i, name in enumerate(learned.chart.change_names)
    ]
