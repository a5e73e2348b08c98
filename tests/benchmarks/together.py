"""Runs the benchmarks of servers in their smallest form, one after the other, with one server for all."""

import contextlib
import io
import json
import runpy
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager
from typing import Any

from tests.conftest import FRUGAL
from tests.installing import ROOT

FOLDER = ROOT / "benchmarks"


def main(names: list[str]) -> None:
    """Print what each one prints, as one JSON value by name."""
    sys.path.insert(0, str(FOLDER))
    import _server

    with tempfile.TemporaryDirectory() as folder:
        server = _server.Server(folder)
        close, server.close = server.close, lambda: None
        _server.Server = lambda _: server
        _server.chromium = frugal(_server.chromium)
        try:
            results = {name: run(name) for name in names}
        finally:
            close()
    sys.stdout.write(json.dumps(results))


def frugal(chromium: Callable[[], AbstractContextManager[Any]]) -> Callable[[], AbstractContextManager[Any]]:
    """Have the pages of a browser draw as little as those of the tests."""

    @contextlib.contextmanager
    def opened() -> Iterator[Any]:
        with chromium() as browser:
            if browser is not None:
                new_context = browser.new_context

                def context(**options: Any) -> Any:
                    made = new_context(**options)
                    made.add_init_script(FRUGAL)
                    return made

                browser.new_context = context
                browser.new_page = lambda **options: context(**options).new_page()
            yield browser

    return opened


def run(name: str) -> object:
    """Run one as `pftrack bench` does, and return its result."""
    sys.argv = [name, "--smallest", "--json"]
    with contextlib.redirect_stdout(io.StringIO()) as told:
        runpy.run_path(str(FOLDER / f"{name}.py"), run_name="__main__")
    return json.loads(told.getvalue())


if __name__ == "__main__":
    main(sys.argv[1:])
