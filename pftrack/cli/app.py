"""The command line, `pftrack`.

`list` and `show` describe experiments; `new` writes a first file; `run`, `replay`, `compare`, `fit`, `failures`,
`learn` and `sweep` compute; `open` shows results of other programs; `explain` explains why a target was lost; `export`
writes a run for other programs; `lessons` teaches; `exercise` checks students' files; `reproduce`, `evaluate`, `bench`
and `doctor` check; commands from other packages, such as the server's `serve`, join through the entry point group
`pftrack.commands`, so the library does not depend on them. Exit status: 0 done, 1 failed, with one clear line, 2 wrong
use.
"""

import os
import sys
from collections.abc import Sequence
from contextlib import suppress
from importlib.metadata import EntryPoint, entry_points
from io import TextIOWrapper
from typing import Annotated, Any

import typer
from typer.core import TyperGroup

from pftrack.cli import analysis, checks, experiments, exports, run, sweep, teaching
from pftrack.cli.output import FAILED, CommandError, emit, explain, wrong_use
from pftrack.core.entry_points import find
from pftrack.core.version import __version__

PLUGINS = "pftrack.commands"


class _Commands(TyperGroup):
    """The library's commands and those that other installed packages add, which are imported only when named."""

    def list_commands(self, ctx: Any) -> list[str]:  # noqa: ANN401 - typer's own context has no public name
        added = {plugin.name for plugin in entry_points(group=PLUGINS)}
        return [*sorted(added - set(self.commands)), *super().list_commands(ctx)]

    def get_command(self, ctx: Any, cmd_name: str) -> Any:  # noqa: ANN401 - typer's own command has no public name
        found = super().get_command(ctx, cmd_name)
        plugin = find(PLUGINS, cmd_name) if found is None else None
        return found if plugin is None else _adopt(plugin)


def _adopt(plugin: EntryPoint) -> Any:  # noqa: ANN401 - typer's own command has no public name
    try:
        function = plugin.load()
    except Exception as error:  # noqa: BLE001 - what another package's import may raise is open; the others still work
        reason = str(error)

        def function() -> None:
            raise CommandError(f"the command {plugin.name} cannot be loaded: {reason}")

        function.__doc__ = "Cannot be loaded here; `pftrack doctor` says why."
    adopted = typer.Typer(add_completion=False)
    adopted.command(plugin.name)(function)
    return typer.main.get_command(adopted)


app = typer.Typer(
    cls=_Commands,
    name="pftrack",
    help="Interactive tracking experiments with particle filters.",
    no_args_is_help=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)


def _version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"pftrack {__version__}")
        raise typer.Exit


@app.callback(invoke_without_command=True)
def _start(
    context: typer.Context,
    _version_wanted: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version and exit.")
    ] = False,
) -> None:
    if context.invoked_subcommand is None:
        raise wrong_use("name a command; pftrack --help lists them")


for module in (experiments, run, exports, analysis, sweep, teaching, checks):
    module.register(app)


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line and end the process with its exit status."""
    given = list(sys.argv[1:] if arguments is None else arguments)
    if isinstance(sys.stdout, TextIOWrapper):
        sys.stdout.reconfigure(errors="replace")  # a console of few letters shows a question mark for the others
    status = _run(given)
    try:
        sys.stdout.flush()
    except OSError as error:
        # Unwritten output is dropped, or Python would try again at its end.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        if not (status or isinstance(error, BrokenPipeError)):
            _fail(CommandError(f"the result could not be written: {error.strerror}"), [])
        status = FAILED
    sys.exit(status)


def _run(given: list[str]) -> int:
    try:
        outcome = app(given, prog_name="pftrack", standalone_mode=False)
    except KeyboardInterrupt:
        return _fail(CommandError("interrupted"), given)
    except BrokenPipeError:
        return FAILED
    except Exception as error:  # noqa: BLE001 - the last door: whatever it is becomes one sentence
        return _fail(explain(error), given)
    if outcome == 130:  # how typer reports Ctrl-C
        return _fail(CommandError("interrupted"), given)
    return outcome if isinstance(outcome, int) else 0


def _fail(failure: CommandError, given: list[str]) -> int:
    if "--json" in given:
        with suppress(OSError):
            emit(failure.as_dict())
    print(f"pftrack: {failure.message}", file=sys.stderr)  # noqa: T201 - the one clear line
    return failure.status
