"""Which sources a result depends on, so that a record knows which of its results are older than the code.

They are the module of the study and all modules of pftrack that it imports, directly or not, with the data beside them.
Experiments are imported by name: a study that names one depends on it, and one that goes through all depends on all.
"""

import ast
from collections.abc import Iterator
from functools import cache
from hashlib import sha256
from pathlib import Path

from pftrack.experiments import EXPERIMENTS

ROOT = Path(__file__).parents[2]
DATA = frozenset({".csv", ".json", ".yaml"})


@cache
def hash_sources(study: str) -> str:
    """Return the SHA-256 of all files that a study depends on, with their paths.

    Args:
        study: Module of the study, such as `pftrack.reproduce.signals`.
    """
    found = sha256()
    for path in list_sources(study):
        found.update(f"{path.relative_to(ROOT).as_posix()} {sha256(path.read_bytes()).hexdigest()}\n".encode())
    return found.hexdigest()


def list_sources(study: str) -> list[Path]:
    """Return the files that a study depends on, sorted; see `hash_sources`."""
    waiting, seen = [study], set[Path]()
    while waiting:
        module = waiting.pop()
        path = _path_of(module)
        if path is not None and path not in seen:
            seen.add(path)
            waiting += _imports_of(path, module)
    data = (each for folder in {path.parent for path in seen} for each in folder.iterdir() if each.suffix in DATA)
    return sorted({*seen, *data})


@cache
def _imports_of(path: Path, module: str) -> list[str]:
    """Return the modules that a module imports anywhere in it, and the experiments that a study names."""
    found = []
    for node in ast.walk(ast.parse(path.read_bytes())):
        if isinstance(node, ast.Import):
            found += [each.name for each in node.names]
        elif isinstance(node, ast.ImportFrom) and node.module is not None:
            found += [node.module, *(f"{node.module}.{each.name}" for each in node.names)]
        elif module.startswith("pftrack.reproduce."):
            found += [f"pftrack.experiments.{name}.experiment" for name in _experiments_in(node)]
    return found


def _experiments_in(node: ast.AST) -> Iterator[str]:
    if isinstance(node, ast.Constant) and isinstance(node.value, str) and node.value in EXPERIMENTS.own:
        yield node.value
    elif isinstance(node, ast.Name) and node.id == "EXPERIMENTS":
        yield from EXPERIMENTS.own


def _path_of(module: str) -> Path | None:
    """Return the file of a module of pftrack; None if there is none of that name."""
    if module.partition(".")[0] != "pftrack":
        return None
    path = ROOT.joinpath(*module.split("."))
    return next((each for each in (path.with_suffix(".py"), path / "__init__.py") if each.is_file()), None)
