"""`reproduce`, `bench` and `doctor`: are the figures right, is it fast, does this machine have what it takes?"""

import json as json_format
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated

import typer

from pftrack.cli.listing import Json
from pftrack.cli.output import (
    FAILED,
    CommandError,
    Jobs,
    emit,
    note,
    progress,
    read_jobs,
    suffix_of,
    table,
    whole,
    wrong_use,
)
from pftrack.core.version import __version__


def register(app: typer.Typer) -> None:
    """Add the commands of this module."""
    app.command()(reproduce)
    app.command()(bench)
    app.command()(doctor)


def reproduce(
    results: Annotated[
        list[str] | None, typer.Argument(metavar="[RESULT]...", help="Which results; all if none.")
    ] = None,
    full: Annotated[bool, typer.Option("--full/--quick", help="All published trials, or few.")] = False,
    jobs: Jobs = None,
    figures: Annotated[
        Path | None, typer.Option(help="Keep the sweeps of the maps, and draw the published figures, in this folder.")
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(metavar="FILE.json", help="Keep each result in a file as it comes; a second call goes on."),
    ] = None,
    revision: Annotated[str, typer.Option(help="Of pftrack, as it is written into that file.")] = __version__,
    cluster: Annotated[
        str | None, typer.Option(metavar="ADDRESS", help="Of a Dask scheduler, whose workers compute instead.")
    ] = None,
    json: Json = False,
) -> None:
    """Compute published results again and compare them within their tolerances; `--quick` takes about a minute."""
    processes = read_jobs(jobs)
    from pftrack.reproduce import RESULTS, Record, describe_verdicts
    from pftrack.reproduce import reproduce as compute

    for name in results or ():
        if name not in RESULTS:
            raise wrong_use(f"a result must be one of {', '.join(RESULTS)}, got {name!r}")
    if out is not None:
        suffix_of(out, (".json",))
    record = None if out is None else Record(out, revision)
    with progress("results", counted=False) as tick:
        computed = compute(
            results or (),
            full=full,
            jobs=processes,
            cluster=cluster,
            progress=tick,
            folder=figures,
            record=record,
        )
    findings = [finding.as_dict() for finding in computed]
    if json:
        emit(findings)
    else:
        columns = "result", "ours", "reference", "tolerance", "verdict", "reason", "ground", "source"
        shown = [finding for finding in findings if finding["verdict"] != "not run"]
        table("", columns, [[_cell(finding[column]) for column in columns] for finding in shown])
    note(f"pftrack: {describe_verdicts(computed)}")
    if any(finding.fails for finding in computed):
        raise typer.Exit(FAILED)


def bench(
    names: Annotated[
        list[str] | None, typer.Argument(metavar="[NAME]...", help="Which benchmarks; all if none.")
    ] = None,
    smallest: Annotated[
        bool, typer.Option("--smallest", help="Only see whether they run; the figures are worth nothing.")
    ] = False,
    json: Json = False,
) -> None:
    """Measure speed, beside other libraries where they are installed."""
    folder = Path(__file__).parents[2] / "benchmarks"
    scripts = {path.stem: path for path in sorted(folder.glob("[a-z]*.py"))}
    if not scripts:
        raise CommandError(
            "the benchmarks come with the source, not with the installed package: run this in a checkout"
        )
    for name in names or ():
        if name not in scripts:
            raise wrong_use(f"a benchmark must be one of {', '.join(scripts)}, got {name!r}")
    options = [*(["--smallest"] if smallest else []), *(["--json"] if json else [])]
    results = {name: _measure(scripts[name], *options) for name in names or scripts}
    if json:
        emit(results)


def doctor(
    warm: Annotated[
        bool, typer.Option("--warm", help="Compile all that is compiled, so that no first start waits.")
    ] = False,
    port: Annotated[str, typer.Option(metavar="PORT", help="The port that `serve` is to use.")] = "8000",
    data_dir: Annotated[Path | None, typer.Option(help="The folder that `serve` is to use.")] = None,
    json: Json = False,
) -> None:
    """Check that this machine has all that pftrack needs."""
    from pftrack.doctor.checks import examine

    checks = examine(port=whole("--port", port, 1, 65_535), data_dir=data_dir, warm=warm)
    if json:
        emit({"healthy": all(check.status != "broken" for check in checks), "checks": [it.as_dict() for it in checks]})
    else:
        table("", ("", "what", "found"), [(check.status, check.name, check.found) for check in checks])
    broken = [check.name for check in checks if check.status == "broken"]
    if broken:
        note(f"pftrack: broken: {', '.join(broken)}")
        raise typer.Exit(FAILED)


def _measure(script: Path, *options: str) -> object:
    from pftrack.process import run

    json = "--json" in options
    status, told = run(str(script), *options, output="read" if json else "shown")
    if status:
        raise CommandError(f"the benchmark {script.stem} failed with exit status {status}")
    return json_format.loads(told) if json else None


def _cell(value: object) -> str:
    return f"{value:.4g}" if isinstance(value, float) else "" if value is None else str(value)


EVERY_S = 3.0


@contextmanager
def compiling() -> Iterator[None]:
    """Say on standard error that functions are compiled and how many; nothing if none is."""
    from pftrack.core.numerics.compiled import FUNCTIONS
    from pftrack.doctor.compiling import watch

    begin = time.monotonic()
    done: list[str] = []
    said = 0.0

    def on_begin(name: str) -> None:
        nonlocal said
        del name
        if not said:
            said = time.monotonic()
            note("pftrack: compiling what this needs, only once; `pftrack doctor --warm` compiles everything")

    def on_end(name: str, seconds: float) -> None:
        nonlocal said
        del seconds
        done.append(name)
        if time.monotonic() - said > EVERY_S:
            said = time.monotonic()
            note(f"pftrack: compiling, {len(done)} functions of at most {len(FUNCTIONS)}")

    with watch(on_begin, on_end):
        yield
    if done:
        note(f"pftrack: {len(done)} functions compiled in {time.monotonic() - begin:.0f} s")
