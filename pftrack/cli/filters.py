"""Filters and experiments of your own: `new` writes a first version, and a file may stand where a tracker is named."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from pftrack.cli.listing import find_experiment
from pftrack.cli.output import CommandError, note, wrong_use

if TYPE_CHECKING:
    from pftrack.core.model.recipe import Recipe
    from pftrack.experiments.experiment import Experiment


Trust = Annotated[
    bool, typer.Option("--trust", help="Execute the filters that the file brings; read them first, with show-recipe.")
]


def register(app: typer.Typer) -> None:
    """Add the commands of this module."""
    new = typer.Typer(add_completion=False, help="Write a file to begin with.")
    new.callback()(lambda: None)
    new.command("filter")(filter_)
    new.command("experiment")(experiment_)
    app.add_typer(new, name="new")


def filter_(
    file: Annotated[Path, typer.Argument(help="Where to, FILE.py; a file that is there is left alone.")],
    experiment: Annotated[str, typer.Option(help="The experiment whose target it follows.")],
) -> None:
    """Write a filter that works, to be changed; `pftrack serve FILE` and `--tracker FILE` use it."""
    from pftrack.experiments.own.extension import example_of, name_of

    found = find_experiment(experiment)
    try:
        name_of(file)
        text = example_of(found)
    except ValueError as error:
        raise wrong_use(str(error)) from None
    try:
        with file.open("x", encoding="utf-8") as opened:
            opened.write(text)
    except FileExistsError:
        raise CommandError(f"{file} is there already; name another file") from None
    except OSError as error:
        raise CommandError(f"{file} cannot be written: {error.strerror}") from None
    note(
        f"pftrack: wrote {file}; see it at work with: pftrack serve {file}, or: pftrack run {found.id} --tracker {file}"
    )


def experiment_(
    name: Annotated[str, typer.Argument(help="Name of the experiment: small letters, digits and hyphens.")],
    folder: Annotated[Path, typer.Option(help="Where to make its folder NAME.")] = Path(),
) -> None:
    """Write an experiment that works, to be changed: a package of one file, which pip installs."""
    from pftrack.experiments import EXPERIMENTS
    from pftrack.experiments.own.extension import package_of

    if name in EXPERIMENTS:
        raise wrong_use(f"there is an experiment {name} already; name another one")
    try:
        files = package_of(name)
    except ValueError as error:
        raise wrong_use(str(error)) from None
    place = folder / name
    try:
        place.mkdir()
        for path, text in files.items():
            (place / path).parent.mkdir(exist_ok=True)
            (place / path).write_text(text, encoding="utf-8")
    except FileExistsError:
        raise CommandError(f"{place} is there already; name another folder") from None
    except OSError as error:
        raise CommandError(f"{place} cannot be written: {error.strerror}") from None
    note(f"pftrack: wrote {place}; install it with: pip install -e {place}, then: pftrack run {name}")


def read_filters(named: Sequence[str]) -> tuple[tuple[str, ...], dict[str, tuple[str, ...]]]:
    """Return trackers by name, and texts of those that are files; whoever names one trusts it."""
    from pftrack.experiments.own.code import trust
    from pftrack.experiments.own.extension import name_of

    names: list[str] = []
    filters: dict[str, tuple[str, ...]] = {}
    for each in named:
        if not each.endswith(".py"):
            names.append(each)
            continue
        try:
            name = name_of(Path(each))
            text = Path(each).read_text(encoding="utf-8")
        except OSError as error:
            raise CommandError(f"{each} cannot be read: {error.strerror}") from None
        except ValueError as error:
            raise wrong_use(str(error)) from None
        if name in filters:
            raise wrong_use(f"two files are called {name}.py; call one of them otherwise")
        trust(text)
        names.append(name)
        filters[name] = (text,)
    return tuple(names), filters


def chosen_tracker(recipe: "Recipe", tracker: str | None, *, trusted: bool) -> "tuple[Experiment, Recipe, str | None]":
    """Return the experiment of a recipe with the tracker that was chosen beside it, if one was, which may be a file."""
    from pftrack.experiments.own.code import trust_filters

    if trusted:
        trust_filters(recipe)
    found = with_filters(find_experiment(recipe.experiment), dict(recipe.filters))
    if tracker is None:
        return found, recipe, None
    (name,), filters = read_filters([tracker])
    found = with_filters(found, filters)
    if name not in found.trackers:
        raise wrong_use(f"the tracker of {found.id} must be one of {', '.join(found.trackers)}, got {name!r}")
    return found, recipe.model_copy(update={"filters": dict(found.filters)}), name


def with_filters(experiment: "Experiment", filters: "dict[str, tuple[str, ...]]") -> "Experiment":
    """Return an experiment with further trackers from files."""
    from pftrack.experiments.own.extension import extend

    return extend(experiment.id, {**experiment.filters, **filters})
