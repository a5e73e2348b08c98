"""`list` and `show`: which experiments there are, and every parameter that they take."""

from collections.abc import Sequence
from dataclasses import asdict
from itertools import groupby
from typing import TYPE_CHECKING, Annotated

import typer

from pftrack.cli.output import emit, note, table, wrong_use

if TYPE_CHECKING:
    from pftrack.core.model.parameters import Declaration, Value
    from pftrack.core.model.preset import Preset
    from pftrack.experiments.experiment import Experiment


Json = Annotated[bool, typer.Option("--json", help="Print one JSON value.")]
Assignments = Annotated[
    list[str] | None, typer.Option("--set", metavar="NAME=VALUE", help="A parameter's value; may be repeated.")
]
PresetName = Annotated[
    str | None,
    typer.Option(
        "--preset", metavar="NAME", help="Begin with the tracker and values of a preset; `show` prints the names."
    ),
]


def register(app: typer.Typer) -> None:
    """Add the commands of this module."""
    app.command("list")(list_)
    app.command()(show)


def find_experiment(name: str) -> "Experiment":
    """Return an experiment by its name; an unknown one is wrong use."""
    from pftrack.experiments import find

    try:
        return find(name)
    except LookupError as error:
        raise wrong_use(str(error.args[0])) from None


def find_preset(experiment: "Experiment", name: str) -> "Preset":
    """Return a preset of an experiment by its name; an unknown one is wrong use."""
    for preset in experiment.presets:
        if preset.name == name:
            return preset
    known = ", ".join(preset.name for preset in experiment.presets)
    raise wrong_use(f"the preset of {experiment.id} must be one of {known}, got {name!r}")


def list_(json: Json = False) -> None:
    """List the experiments."""
    from pftrack.experiments import EXPERIMENTS

    for plugin in EXPERIMENTS.plugins:
        if plugin.problem:
            note(f"pftrack: {plugin.report}")
    if json:
        emit([_about(experiment) for experiment in EXPERIMENTS.values()])
        return
    rows = [(it.id, it.title, it.question, ", ".join(it.trackers)) for it in EXPERIMENTS.values()]
    table("", ("name", "title", "question", "trackers"), rows)


def show(
    experiment: Annotated[str, typer.Argument(help="An experiment's name, as `list` prints it.")], json: Json = False
) -> None:
    """Show an experiment with every parameter: unit, bounds, default, help."""
    from pftrack.core.model.parameters import flat
    from pftrack.output.exports.formats import exports_of

    found = find_experiment(experiment)
    parameters = found.simulate().parameters
    declared = found.declarations(type(parameters))
    values = flat(parameters)
    if json:
        entries = [{**declaration.model_dump(), "default": values[declaration.name]} for declaration in declared]
        layers, worlds = ([asdict(each) for each in several] for several in (found.layers, found.worlds))
        emit(
            {
                **_about(found),
                "miscalibrated": _miscalibrated(found),
                "layers": layers,
                "worlds": worlds,
                "declarations": entries,
            }
        )
        return
    typer.echo(f"{found.title}\n{found.description}\nFrom {_sources(found)}\n")
    table(
        "Trackers",
        ("name", "title", "what it does"),
        [(it.id, it.title, it.description) for it in found.trackers.values()],
    )
    for group, members in groupby(declared, key=lambda declaration: declaration.group):
        typer.echo("")
        table(group or "Parameters", ("name", "default", "allowed", "help"), _rows(list(members), values))
    typer.echo("")
    presets = [
        (it.name, it.title, it.tracker, " ".join(f"{k}={v}" for k, v in it.parameters.items()), it.watch)
        for it in found.presets
    ]
    table("Presets", ("name", "title", "tracker", "parameters", "what to look at"), presets)
    if found.failures:
        typer.echo("")
        table("Failures", ("name", "diagnosis", "cure"), [(it.id, it.diagnosis, it.cure.text) for it in found.failures])
    if found.quality.calibration.faults:
        typer.echo("")
        rows = [(way, ", ".join(trackers)) for way, trackers in _miscalibrated(found).items()]
        table("Error bands are off in some settings", ("how", "trackers"), rows)
    if found.run_measures:
        typer.echo("")
        measures = [(it.name, it.description, it.source) for it in found.run_measures]
        table("Measures of a run", ("name", "definition", "source"), measures)
    typer.echo("")
    table("Exports", ("suffix", "title"), [(f".{it.suffix}", it.title) for it in exports_of(found)])
    if found.accepts_video:
        typer.echo("")
        typer.echo(f"It takes recordings of the kinds {', '.join(found.video.footage)} (--video).")
    if found.video.marks:
        marks = [(f"{kind.name()}:{kind.text}", kind.title, kind.instruction) for kind in found.video.marks]
        table("Marks on a recording", ("--mark", "title", "how"), marks)
        missing = "is found automatically if it is not marked" if found.video.finder else "has to be marked"
        exempt = f", except in {' or '.join(found.video.unmarked)}" if found.video.unmarked else ""
        typer.echo(f"The {found.target} {missing}{exempt}.")
    if found.accepts_video and found.video.truth is not None:
        typer.echo(f"A table of truth has the columns {', '.join(found.video.truth.form.columns)}.")


def _miscalibrated(experiment: "Experiment") -> dict[str, list[str]]:
    """Return the trackers whose bands are declared to be off in some setting, by the way in which they are."""
    found: dict[str, list[str]] = {}
    for fault in experiment.quality.calibration.faults:
        known = found.setdefault(fault.direction, [])
        known += [name for name in fault.trackers if name not in known]
    return found


def _sources(experiment: "Experiment") -> str:
    return "\n     ".join(citation.text for citation in experiment.references)


def _about(experiment: "Experiment") -> dict[str, object]:
    from pftrack.output.exports.formats import exports_of

    return {
        "id": experiment.id,
        "title": experiment.title,
        "family": experiment.family,
        "question": experiment.question,
        "references": [citation.as_dict() for citation in experiment.references],
        "description": experiment.description,
        "accepts_video": experiment.accepts_video,
        "footage": list(experiment.video.footage),
        "default_tracker": experiment.default_tracker,
        "frames": experiment.frames,
        "measures": [measure.as_dict() for measure in experiment.run_measures],
        "exports": [{"name": it.name, "title": it.title, "suffix": it.suffix} for it in exports_of(experiment)],
        "trackers": [
            {"id": tracker.id, "title": tracker.title, "description": tracker.description}
            for tracker in experiment.trackers.values()
        ],
        "failures": [failure.id for failure in experiment.failures],
        "presets": [
            {
                **{key: getattr(it, key) for key in ("name", "title", "tracker", "parameters", "seed", "watch")},
                "about": it.subjects,
            }
            for it in experiment.presets
        ],
    }


def _rows(declared: "Sequence[Declaration]", values: "dict[str, Value]") -> list[tuple[str, ...]]:
    return [(it.name, f"{values[it.name]} {it.unit}".strip(), _allowed(it), _help(it)) for it in declared]


def _allowed(declaration: "Declaration") -> str:
    match declaration.kind:
        case "boolean":
            return "True, False"
        case "choice":
            return ", ".join(declaration.choices)
        case "colour":
            return "#rrggbb"
        case "file":
            return f"the text of a file {declaration.accept}, or @FILE"
        case _:
            return f"{declaration.minimum:g} to {declaration.maximum:g}"


def _help(declaration: "Declaration") -> str:
    readers = f" For {', '.join(declaration.trackers)}." if declaration.trackers else ""
    restart = "" if declaration.live else " A change restarts the run."
    return f"{declaration.description}{readers}{restart}"
