"""Runs the benchmarks of servers in their smallest form, one after the other, with one server for all."""

import contextlib
import io
import json
import runpy
import sys
import tempfile

from tests.installing import ROOT

FOLDER = ROOT / "benchmarks"


def main(names: list[str]) -> None:
    """Print the result of each benchmark, as one JSON value by name."""
    sys.path.insert(0, str(FOLDER))
    import _server

    with tempfile.TemporaryDirectory() as folder:
        server = _server.Server(folder)
        close, server.close = server.close, lambda: None
        _server.Server = lambda _: server
        try:
            results = {name: run(name) for name in names}
        finally:
            close()
    sys.stdout.write(json.dumps(results))


def run(name: str) -> object:
    """Run a benchmark as `pftrack bench` does, and return its result."""
    sys.argv = [name, "--smallest", "--json"]
    with contextlib.redirect_stdout(io.StringIO()) as printed:
        runpy.run_path(str(FOLDER / f"{name}.py"), run_name="__main__")
    return json.loads(printed.getvalue())


if __name__ == "__main__":
    main(sys.argv[1:])
