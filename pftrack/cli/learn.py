"""`learn`: from runs, saved or made for it, learn how motion and shape change, and write that to a file."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from pftrack.cli.checks import compiling
from pftrack.cli.listing import Assignments, Json, PresetName, find_experiment, find_preset
from pftrack.cli.output import CommandError, emit, note, progress, table, wrong_use
from pftrack.cli.sweep import plan_of

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from pftrack.experiments.experiment import Experiment
    from pftrack.filters.learning.diffusion import Learned
    from pftrack.filters.learning.guidance import Guidance
    from pftrack.sweep import Plan


def register(app: typer.Typer) -> None:
    """Add the commands of this module."""
    app.command()(learn)


def learn(
    sources: Annotated[
        list[str],
        typer.Argument(metavar="RUN.pft...|EXPERIMENT", help="Saved runs, or an experiment that is to be run."),
    ],
    out: Annotated[Path, typer.Option(help="The learned file, FILE.json.")],
    preset: PresetName = None,
    tracker: Annotated[str | None, typer.Option(help="A tracker's name, as `show` prints it.")] = None,
    axes: Annotated[
        list[str] | None,
        typer.Option(
            "--axis", metavar="NAME=VALUES", help="Learn from runs with each of these values, as `sweep` has them."
        ),
    ] = None,
    assignments: Assignments = None,
    trials: Annotated[
        str | None,
        typer.Option(metavar="T", help="Runs to learn from, of each combination of values; 10, or 1 of each."),
    ] = None,
    seed: Annotated[str | None, typer.Option(metavar="SEED", help="Of all seeds.")] = None,
    frames: Annotated[str | None, typer.Option(metavar="N", help="How many frames a run has.")] = None,
    json: Json = False,
) -> None:
    """Learn how motion and shape change, for trackers that are guided by it (`run --learned FILE`).

    Frames in which the target is lost, by the truth, or looked for are left out.
    """
    import numpy as np

    from pftrack.core.files import write_whole
    from pftrack.sweep.axis import SweepError

    if out.is_dir() or not out.absolute().parent.is_dir():
        raise CommandError(f"{out} cannot be written: it is a folder, or in none")
    if any(source.lower().endswith(".pft") for source in sources):
        if any(it is not None for it in (preset, tracker, axes, assignments, trials, seed, frames)):
            raise wrong_use("saved runs are learned from as they are: leave out what only makes new ones")
        guidance, tracks = _read_states([Path(source) for source in sources])
    else:
        if len(sources) > 1:
            raise wrong_use(f"name one experiment, or saved runs, got {', '.join(sources)}")
        experiment = find_experiment(sources[0])
        guidance = guidance_of(experiment, "learn")
        begin = find_preset(experiment, preset) if preset is not None else None
        each = trials or ("1" if axes else "10")
        try:
            plan = plan_of(
                experiment,
                begin,
                axes or [],
                [tracker] if tracker else [],
                each,
                frames,
                assignments or [],
                seed or "0",
            )
        except SweepError as error:
            raise wrong_use(str(error)) from None
        with compiling():
            tracks = [guidance.states(rows) for rows in _compute(plan)]
    learned = guidance.learn(tracks)
    write_whole(out, learned.text.encode())
    total = sum(map(len, tracks))
    left_out = total - sum(int(np.isfinite(track).all(axis=1).sum()) for track in tracks)
    if json:
        emit(_about(learned, left_out))
        return
    table("", ("change", "mean", "standard deviation", "unit", "correlations"), _rows(learned))
    left = f"; {left_out} of {total} frames were left out" if left_out else ""
    note(f"pftrack: learned from {learned.origin}{left}; written to {out}")


def guidance_of(experiment: "Experiment", what: str) -> "Guidance":
    """Return how an experiment's runs are learned from; wrong use if they are not."""
    if experiment.guidance is None:
        from pftrack.experiments import EXPERIMENTS

        able = ", ".join(it.id for it in EXPERIMENTS.values() if it.guidance) or "none"
        raise wrong_use(f"{experiment.id} takes no {what}: motion is learned in {able}")
    return experiment.guidance


def _read_states(paths: Sequence[Path]) -> "tuple[Guidance, list[NDArray[Any]]]":
    """Return the recorded states of saved runs, by the numbers that they hold."""
    from pftrack.runs.record import read, read_columns

    experiments = {read(path).recipe.experiment for path in paths}
    if len(experiments) > 1:
        raise wrong_use(f"expected runs of one experiment, got those of {', '.join(sorted(experiments))}")
    guidance = guidance_of(find_experiment(experiments.pop()), "learn")
    return guidance, [guidance.saved_states(read_columns(path), path.name) for path in paths]


def _compute(plan: "Plan") -> Iterator[Any]:
    """Yield the rows of one run after the other."""
    with progress(f"{plan.experiment}, runs to learn from") as tick:
        for number in range(plan.runs):
            run = plan.live(number)
            run.finish()
            tick(number + 1, plan.runs)
            yield run.diagnostics


def _about(learned: "Learned", left_out: int) -> dict[str, Any]:
    reading = learned.chart.readings[0]
    diffusion = learned.diffusion(reading, drifting=True)
    return {
        "experiment": learned.experiment,
        "tracks": learned.tracks,
        "frames": learned.frames,
        "left_out": left_out,
        "reading": reading,
        "changes": learned.chart.change_names,
        "units": learned.chart.change_units,
        "mean": diffusion.mean.tolist(),
        "sd": diffusion.sd.tolist(),
        "correlation": diffusion.correlation.tolist(),
        "eigenvalues": diffusion.eigenvalues.tolist(),
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
