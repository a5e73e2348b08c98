"""`list`, `show` and `new`: experiments and their parameters, and first files of your own.

A filter file may be used wherever a tracker is named.
"""

from collections.abc import Iterator, Sequence
from dataclasses import asdict
from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from pftrack.cli.output import Json, emit, note, picked, reading, refusing, table, tell, writing, wrong_use

if TYPE_CHECKING:
    from pftrack.core.model.parameters import Declaration, Value
    from pftrack.core.model.preset import Preset
    from pftrack.core.model.recipe import Recipe
    from pftrack.experiments.experiment import Experiment


Named = Annotated[str, typer.Argument(help="An experiment's name, as `list` prints it.")]
TrackerName = Annotated[str | None, typer.Option("--tracker", help="A tracker's name, as `show` prints it.")]
PresetName = Annotated[
    str | None,
    typer.Option(
        "--preset", metavar="NAME", help="Begin with the tracker and values of a preset; `show` prints the names."
    ),
]
Trust = Annotated[
    bool, typer.Option("--trust", help="Execute the filters contained in the file; read them first, with show-recipe.")
]


def register(app: typer.Typer) -> None:
    """Add the commands of this module."""
    app.command("list")(list_)
    app.command()(show)
    new = typer.Typer(add_completion=False, help="Create a filter or an experiment from a template.")
    new.callback()(lambda: None)
    new.command("filter")(filter_)
    new.command("experiment")(experiment_)
    app.add_typer(new, name="new")


def find_experiment(name: str) -> "Experiment":
    """Return an experiment by its name; an unknown one is wrong use."""
    from pftrack.experiments import find

    with refusing():
        return find(name)


def find_preset(experiment: "Experiment", name: str | None) -> "Preset | None":
    """Return a preset of an experiment by its name, if one is named; an unknown one is wrong use."""
    with refusing():
        return None if name is None else experiment.preset_named(name)


def find_tracker(experiment: "Experiment", name: str) -> str:
    """Return the name of a tracker of an experiment; an unknown one is wrong use."""
    if name not in experiment.trackers:
        raise wrong_use(f"the tracker of {experiment.id} must be one of {', '.join(experiment.trackers)}, got {name!r}")
    return name


def list_(json: Json = False) -> None:
    """List the experiments."""
    from pftrack.experiments import EXPERIMENTS

    for plugin in EXPERIMENTS.plugins:
        if plugin.problem:
            note(f"pftrack: {plugin.report}")
    found = EXPERIMENTS.values()
    rows = [(it.id, it.title, it.texts.question, ", ".join(it.trackers)) for it in found]
    tell([_about(it) for it in found] if json else None, ("name", "title", "question", "trackers"), rows, json=json)


def show(experiment: Named, json: Json = False) -> None:
    """Show an experiment with every parameter: unit, bounds, default, help."""
    from pftrack.core.model.parameters import flat

    found = find_experiment(experiment)
    parameters = found.simulate().parameters
    declared, values = found.declarations(type(parameters)), flat(parameters)
    if json:
        entries = [{**declaration.model_dump(), "default": values[declaration.name]} for declaration in declared]
        shown = picked(found.display, "layers", "worlds")
        drawn = {name: [asdict(each) for each in several] for name, several in shown.items()}
        emit({**_about(found), "miscalibrated": _doubted(found), **drawn, "declarations": entries})
        return
    sources = "\n     ".join(citation.text for citation in found.texts.references)
    typer.echo(f"{found.title}\n{found.texts.description}\nFrom {sources}")
    for title, columns, rows in _sections(found, declared, values):
        if rows:
            typer.echo("")
            table(title, columns, rows)
    if found.accepts_video:
        _show_recordings(found)


def _sections(
    found: "Experiment", declared: "Sequence[Declaration]", values: "dict[str, Value]"
) -> Iterator[tuple[str, Sequence[str], Sequence[Sequence[str]]]]:
    """Yield the tables of an experiment: title, columns and rows."""
    from pftrack.output.exports.formats import exports_of

    trackers = [(it.id, it.title, it.description) for it in found.trackers.values()]
    yield "Trackers", ("name", "title", "what it does"), trackers
    for group, members in groupby(declared, key=lambda declaration: declaration.group):
        rows = [(it.name, f"{values[it.name]} {it.unit}".strip(), _allowed(it), _help(it)) for it in members]
        yield group or "Parameters", ("name", "default", "allowed", "help"), rows
    presets = [
        (it.name, it.title, it.tracker, " ".join(f"{k}={v}" for k, v in it.parameters.items()), it.watch)
        for it in found.presets
    ]
    yield "Presets", ("name", "title", "tracker", "parameters", "what to look at"), presets
    failures = [(it.id, it.diagnosis, it.cure.text) for it in found.failures]
    yield "Failures", ("name", "diagnosis", "cure"), failures
    faults = [(way, ", ".join(names)) for way, names in _doubted(found).items()]
    yield "Error bands that are not calibrated with the default parameters", ("how", "trackers"), faults
    measures = [(it.name, it.description, it.source) for it in found.run_measures]
    yield "Measures of a run", ("name", "definition", "source"), measures
    yield "Exports", ("suffix", "title"), [(f".{it.suffix}", it.title) for it in exports_of(found)]


def _show_recordings(found: "Experiment") -> None:
    video = found.video
    typer.echo(f"\nIt takes recordings of the kinds {', '.join(video.footage)} (--video).")
    if video.marks:
        marks = [(f"{kind.name()}:{kind.text}", kind.title, kind.instruction) for kind in video.marks]
        table("Marks on a recording", ("--mark", "title", "how"), marks)
        missing = "is found automatically if it is not marked" if video.finder else "must be marked"
        exempt = f", except in {' or '.join(video.unmarked)}" if video.unmarked else ""
        typer.echo(f"The {found.texts.target} {missing}{exempt}.")
    if video.truth is not None:
        typer.echo(f"A table of truth has the columns {', '.join(video.truth.form.columns)}.")


def _doubted(experiment: "Experiment") -> dict[str, list[str]]:
    """Return the trackers whose bands were not found right with the defaults, by what is known of them."""
    from pftrack.core.model.band import DOUBTS

    standard = experiment.simulate().parameters
    found = {name: experiment.doubts((name, standard)) for name in experiment.trackers}
    by_doubt = {doubt: [name for name, doubts in found.items() if doubt in doubts] for doubt in DOUBTS}
    return {doubt: names for doubt, names in by_doubt.items() if names}


def _about(experiment: "Experiment") -> dict[str, object]:
    from pftrack.output.exports.formats import exports_of

    preset = "name", "title", "tracker", "parameters", "seed", "watch"
    return {
        **picked(experiment, "id", "title", "accepts_video", "default_tracker", "frames"),
        **picked(experiment.texts, "family", "question", "description"),
        "references": [citation.as_dict() for citation in experiment.texts.references],
        "footage": list(experiment.video.footage),
        "measures": [measure.as_dict() for measure in experiment.run_measures],
        "exports": [picked(it, "name", "title", "suffix") for it in exports_of(experiment)],
        "trackers": [picked(tracker, "id", "title", "description") for tracker in experiment.trackers.values()],
        "failures": [failure.id for failure in experiment.failures],
        "presets": [{**picked(it, *preset), "about": it.subjects} for it in experiment.presets],
    }


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


def filter_(
    file: Annotated[Path, typer.Argument(help="File to write, FILE.py; an existing file is left alone.")],
    experiment: Annotated[str, typer.Option(help="The experiment whose target it follows.")],
) -> None:
    """Write a working filter as a template; `pftrack serve FILE` and `--tracker FILE` use it."""
    from pftrack.experiments.own.extension import example_of, name_of

    found = find_experiment(experiment)
    with refusing(ValueError):
        name_of(file)
        text = example_of(found)
    with writing(file), file.open("x", encoding="utf-8") as opened:
        opened.write(text)
    note(f"pftrack: wrote {file}; try it with: pftrack serve {file}, or: pftrack run {found.id} --tracker {file}")


def experiment_(
    name: Annotated[str, typer.Argument(help="Name of the experiment: lower-case letters, digits and hyphens.")],
    folder: Annotated[Path, typer.Option(help="Folder in which to create the folder NAME.")] = Path(),
) -> None:
    """Write a working experiment as a template: a package of one file, which pip installs."""
    from pftrack.experiments import EXPERIMENTS
    from pftrack.experiments.own.extension import package_of

    if name in EXPERIMENTS:
        raise wrong_use(f"there is an experiment {name} already; name another one")
    with refusing(ValueError):
        files = package_of(name)
    place = folder / name
    with writing(place):
        place.mkdir()
        for path, text in files.items():
            (place / path).parent.mkdir(exist_ok=True)
            (place / path).write_text(text, encoding="utf-8")
    note(f"pftrack: wrote {place}; install it with: pip install -e {place}, then: pftrack run {name}")


def read_filters(named: Sequence[str]) -> tuple[tuple[str, ...], dict[str, tuple[str, ...]]]:
    """Return trackers by name, and texts of those that are files; naming a file means trusting it."""
    from pftrack.core.files import read_source
    from pftrack.experiments.own.code import trust
    from pftrack.experiments.own.extension import name_of

    names: list[str] = []
    filters: dict[str, tuple[str, ...]] = {}
    for each in named:
        if not each.endswith(".py"):
            names.append(each)
            continue
        file = Path(each)
        with refusing(ValueError), reading(file):
            name, text = name_of(file), read_source(file)
        if name in filters:
            raise wrong_use(f"two files are called {name}.py; rename one of them")
        trust(text)
        names.append(name)
        filters[name] = (text,)
    return tuple(names), filters


def chosen_tracker(recipe: "Recipe", tracker: str | None, *, trusted: bool) -> "tuple[Experiment, Recipe, str | None]":
    """Return the experiment of a recipe with the separately chosen tracker, if any, which may be a file."""
    from pftrack.experiments.own.code import trust_filters

    if trusted:
        trust_filters(recipe)
    found = with_filters(find_experiment(recipe.experiment), dict(recipe.filters))
    if tracker is None:
        return found, recipe, None
    (name,), filters = read_filters([tracker])
    found = with_filters(found, filters)
    return found, recipe.model_copy(update={"filters": dict(found.filters)}), find_tracker(found, name)


def with_filters(experiment: "Experiment", filters: "dict[str, tuple[str, ...]]") -> "Experiment":
    """Return an experiment with further trackers from files."""
    from pftrack.experiments.own.extension import extend

    return extend(experiment.id, {**experiment.filters, **filters})
