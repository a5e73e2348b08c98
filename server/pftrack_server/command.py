"""The command `pftrack serve` and its options; the server is imported only when the command runs: it takes a second."""

import gc
from pathlib import Path
from typing import Annotated

import typer


def serve(
    filters: Annotated[
        list[Path] | None, typer.Argument(metavar="[FILE.py]...", help="Your own filters, listed among the trackers.")
    ] = None,
    host: Annotated[str | None, typer.Option(help="Address to listen on; any but loopback requires a token.")] = None,
    port: Annotated[str | None, typer.Option(metavar="PORT", help="Port to listen on; 0 takes a free one.")] = None,
    data_dir: Annotated[Path | None, typer.Option(help="Folder for uploads, runs and the database.")] = None,
    base_path: Annotated[str | None, typer.Option(help="Prefix of all addresses, such as /any/prefix.")] = None,
) -> None:
    """Serve the dashboard, and print the link to it."""
    from pftrack.cli.output import whole
    from pftrack.process import take_secret

    listening = None if port is None else whole("--port", port, 0, 65_535)
    token = take_secret("PFTRACK_TOKEN")
    # Imported objects stay: garbage collection during the imports would take a fifth of the time until the server
    # starts.
    gc.disable()
    from pftrack_server.core.processes import FORK_SERVER

    # Before everything else, while there is neither a thread nor a secret.
    FORK_SERVER.fork_off()
    from pftrack_server.app import create_app
    from pftrack_server.web.serving import run

    files = tuple(each.absolute() for each in filters or ()) or None
    given: dict[str, object] = {
        "filters": files,
        "host": host,
        "port": listening,
        "data_dir": data_dir,
        "base_path": base_path,
        "token": token,
    }
    run(create_app, {name: value for name, value in given.items() if value is not None})
