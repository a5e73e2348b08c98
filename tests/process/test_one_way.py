"""Nothing but `pftrack.process` starts a process."""

import ast
import re
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[2]
STARTERS = re.compile(
    r"subprocess|multiprocessing|pty|os\.(fork\w*|exec\w+|spawn\w+|posix_spawnp?|system|popen|startfile)"
    r"|ProcessPoolExecutor|(asyncio\.|\w+\.)?(create_subprocess_\w+|subprocess_(exec|shell))"
)
"""Modules and functions of the standard library that make processes."""


def starters(text: str) -> Iterator[str]:
    """What a module imports or calls that makes processes."""
    for node in ast.walk(ast.parse(text)):
        match node:
            case ast.Import(names=names):
                named = [each.name.split(".")[0] for each in names]
            case ast.ImportFrom(module=module, names=names):
                named = [str(module).split(".")[0], *(each.name for each in names)]
                named += [f"{module}.{each.name}" for each in names]
            case ast.Attribute():
                named = [ast.unparse(node)]
            case _:
                continue
        yield from (name for name in named if STARTERS.fullmatch(name))


def test_nothing_else_starts_a_process() -> None:
    """Sessions, lessons, tasks, sweeps, studies, compiling and the command line all use it."""
    homes = ROOT / "pftrack", ROOT / "server" / "pftrack_server"
    modules = [path for home in homes for path in home.rglob("*.py") if home / "process" not in path.parents]
    assert len(modules) > 400
    assert {str(path): found for path in modules if (found := list(starters(path.read_text(encoding="utf-8"))))} == {}


def test_each_way_is_found() -> None:
    """The search finds imports and calls of each form, and passes over what only has a similar name."""
    wrong = """
import subprocess, os, asyncio, multiprocessing.pool
from multiprocessing import Pool
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from os import fork
os.fork(); os.posix_spawn("", [], {}); asyncio.create_subprocess_exec("ls"); loop.subprocess_exec(None)
"""
    assert len(list(starters(wrong))) == 9
    assert list(starters("server.fork(os.path, run); from_process = os.fspath")) == []
