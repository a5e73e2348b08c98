"""Records: findings kept as they come, with the sources that each result depends on.

A second call goes on with what is left, and computes a result again whose sources have changed. The file is JSON, by
the name of a result; docs/explanation/reproduction.md is written from it. The sources of a result are the module of its
study and all modules of pftrack that it imports, directly or not, with the data beside them. Experiments are imported
by name: a study that names one depends on it, and one that goes through all depends on all.
"""

import ast
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from hashlib import sha256
from pathlib import Path
from typing import Literal, TypeAlias

from pydantic import BaseModel, ConfigDict, ValidationError

from pftrack.core.files import write_whole
from pftrack.experiments import EXPERIMENTS
from pftrack.reproduce.finding import Finding

Form: TypeAlias = Literal["full", "quick"]

ROOT = Path(__file__).parents[2]
STUDIES = Path(__file__).parent
DATA = frozenset({".csv", ".json", ".yaml"})


@dataclass(frozen=True, slots=True)
class Entry:
    """A result that was computed.

    Attributes:
        form: All trials of the protocol, or few.
        revision: Of pftrack.
        sources: SHA-256 of the sources that it depends on (`hash_sources`); empty if that was not kept.
        pieces: How many pieces of work it was; of most studies they are trials, of those of the ball 120 runs each.
        seconds: Processor time of these.
        findings: What came of it.
    """

    form: Form
    revision: str
    sources: str
    pieces: int
    seconds: float
    findings: tuple[Finding, ...]


class _Kept(BaseModel):
    """The file."""

    model_config = ConfigDict(extra="forbid")

    results: dict[str, Entry]


class Record:
    """The results in a file; one that is kept is on disk before the next one begins."""

    def __init__(self, path: Path, revision: str) -> None:
        """Begin a record, or go on with the one in the file.

        Args:
            path: The file; it need not be there.
            revision: What the results are of that are kept from now on.

        Raises:
            ValueError: The file holds something else.
            OSError: It cannot be read.
        """
        self.path, self.revision = path, revision
        self._entries = dict(read_record(path)) if path.exists() else {}

    def has(self, name: str, form: Form, sources: str) -> bool:
        """Return whether a result of these sources is there in this form, or for a quick one the full one of any."""
        entry = self._entries.get(name)
        return entry is not None and (
            (entry.form, entry.sources) == (form, sources) or (entry.form, form) == ("full", "quick")
        )

    def findings(self, name: str) -> list[Finding]:
        """Return the findings of a result that is there."""
        return list(self._entries[name].findings)

    def keep(
        self, name: str, form: Form, findings: Sequence[Finding], *, sources: str, pieces: int, seconds: float
    ) -> None:
        """Write a result into the file."""
        self._entries[name] = Entry(form, self.revision, sources, pieces, round(seconds, 2), tuple(findings))
        text = _Kept(results=dict(sorted(self._entries.items()))).model_dump_json(indent=1)
        write_whole(self.path, f"{text}\n".encode())


def read_record(path: Path) -> Mapping[str, Entry]:
    """Return the results in a file by name.

    Raises:
        ValueError: The file holds something else.
        OSError: It cannot be read.
    """
    try:
        return _Kept.model_validate_json(path.read_bytes()).results
    except ValidationError as error:
        said = error.errors()[0]
        place = ".".join(map(str, said["loc"]))
        raise ValueError(f"{path} is not a record of reproduced results: {place}: {said['msg']}") from None


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
    data = {each for folder in {path.parent for path in seen} for each in folder.iterdir() if each.suffix in DATA}
    # Studies lie side by side; what is stated of the others does not count.
    mine = tuple(path.stem for path in seen if path.parent == STUDIES)
    return sorted(seen | {each for each in data if each.parent != STUDIES or each.stem.startswith(mine)})


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
