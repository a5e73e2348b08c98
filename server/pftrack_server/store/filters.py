"""Filters that the server was started with: files of its owner, listed among the trackers of an experiment.

They are named only on the command line and executed only in workers; this module reads and checks them without
executing them. Versions saved while the server runs are kept, since runs were made with them.
"""

import ast
import asyncio
import contextlib
from collections.abc import Awaitable, Callable, Collection, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, TypeAlias

import structlog
from pydantic import BaseModel, Field

from pftrack.core.files import write_whole
from pftrack.core.model.likelihood import Component
from pftrack.core.model.recipe import Recipe
from pftrack.core.refusal import ConflictError, RefusedError
from pftrack.experiments import find
from pftrack.experiments.own.code import HINTS, Hint, digest_of
from pftrack.experiments.own.extension import name_of
from pftrack_server.core.bodies import fields_of
from pftrack_server.core.errors import not_found
from pftrack_server.core.requests import service
from pftrack_server.store.files import DataDirectory


class FilterPublic(BaseModel):
    """A filter file of the server's owner."""

    name: str = Field(description="Name of its tracker")
    file: str
    experiment: str = Field(description="Experiment whose target it follows")
    digest: str = Field(description="Hash of its text, which recipes refer to")
    text: str
    editable: bool = Field(description="Whether pages may write it")
    hints: tuple[Hint, ...]
    components: tuple[Component, ...] = Field(description="Columns of the states at the default parameters")
    observed: str = Field(description="Description of a frame's content for the functions")


log = structlog.get_logger(__name__)

EVERY_S = 0.1
"""Interval of checks for saved files, s; a person who saves a file waits for its effect."""

TARGET = "EXPERIMENT"
"""Variable in a file that names the experiment whose target it follows."""

OnSaved: TypeAlias = Callable[[str, str, str], Awaitable[None]]
"""Takes the experiment, the tracker's name and the text of a saved file."""


@dataclass(frozen=True, slots=True)
class ServedFilter:
    """A file that the server was started with.

    Attributes:
        path: Path of the file.
        name: Name of its tracker.
        experiment: Experiment whose target it follows.
        title: Title from its docstring, or its name.
        digest: Hash of its newest version.
    """

    path: Path
    name: str
    experiment: str
    title: str
    digest: str


def look_at(path: Path) -> tuple[str, str, str]:
    """Return the experiment, title and text of a file, without executing it.

    Raises:
        ValueError: The file is not a filter that can be served; the message says what to do.
        OSError: The file cannot be read.
    """
    name, text = name_of(path), path.read_text(encoding="utf-8")
    try:
        tree = ast.parse(text)
    except SyntaxError as error:
        raise ValueError(f"{path.name}, line {error.lineno}: {error.msg}") from None
    experiment = next((value for node in tree.body if (value := _declared(node)) is not None), None)
    if experiment is None:
        raise ValueError(f"{path.name} does not name its experiment: write {TARGET} as pftrack new filter does")
    try:
        found = find(experiment)
    except RefusedError as error:
        raise ValueError(f"{path.name}: {error}") from None
    if found.model is None:
        raise ValueError(f"{path.name}: {found.id} takes no filters from files")
    if name in found.trackers:
        raise ValueError(f"{path.name}: {found.id} already has a tracker {name}; rename the file")
    said = (ast.get_docstring(tree) or "").partition("\n")[0].rstrip(".")
    return found.id, said or path.name, text


class FilterFiles:
    """The filter files, the newest version of each, and the watch for changes."""

    def __init__(self, paths: Sequence[Path], files: DataDirectory, *, editable: bool = False) -> None:
        """Read the files; pages may write them if `editable`.

        Raises:
            ValueError: A file is not a filter that can be served.
            OSError: A file cannot be read.
        """
        self._files = files
        self._editable = editable
        self._seen: dict[Path, tuple[int, int]] = {}
        self._served: dict[str, ServedFilter] = {}
        self._watch: asyncio.Task[None] | None = None
        for path in paths:
            self._read(path)

    @property
    def served(self) -> list[ServedFilter]:
        """All files."""
        return list(self._served.values())

    def bring(self, recipe: Recipe) -> Recipe:
        """Return a recipe with the present filters of its experiment added to its own."""
        own = {each.name: (each.digest,) for each in self.served if each.experiment == recipe.experiment}
        return recipe.model_copy(update={"filters": {**own, **recipe.filters}}) if own else recipe

    def texts_of(self, experiment: str, names: Collection[object]) -> dict[str, tuple[str, ...]]:
        """Return the present texts of an experiment's files among some trackers, by name, and store them.

        Raises:
            ValueError: A file is not a valid filter now; the message names the line.
            OSError: A file cannot be read.
        """
        found: dict[str, tuple[str, ...]] = {}
        for each in self.served:
            if each.experiment == experiment and each.name in names:
                _, _, text = look_at(each.path)
                self._files.keep_filter(text)
                found[each.name] = (text,)
        return found

    def views(self) -> list[FilterPublic]:
        """Return the public views of all files."""
        return [self._view(each) for each in self.served]

    def write(self, name: str, text: str, before: str) -> FilterPublic:
        """Write a file that a page has changed.

        Args:
            name: Name of its tracker.
            text: The new text.
            before: Hash of the text that it replaces.

        Raises:
            ApiError: The server was not started with such a file (404).
            ConflictError: Files cannot be written here, or the file was changed meanwhile.
        """
        served = self._served.get(name)
        if served is None:
            raise not_found("The server was not started with such a file.")
        if not self._editable:
            raise ConflictError("Files can be written only if no other machine can reach the server.")
        if digest_of(served.path.read_text(encoding="utf-8")) != before:
            raise ConflictError("The file was changed meanwhile; load it again.")
        write_whole(served.path, text.encode())
        return self._view(served)

    def _view(self, served: ServedFilter) -> FilterPublic:
        text = served.path.read_text(encoding="utf-8")
        experiment = find(served.experiment)
        model, parameters = experiment.model, experiment.simulate().parameters
        if model is None:
            raise not_found("The experiment takes no filters from files.")
        return FilterPublic(
            **fields_of(FilterPublic, served) | {"digest": digest_of(text)},
            file=served.path.name,
            text=text,
            editable=self._editable,
            hints=HINTS,
            components=model.components(parameters),
            observed=model.observed,
        )

    def open(self, on_saved: OnSaved) -> None:
        """Watch the files; call `on_saved` whenever one was saved."""
        if self._served:
            self._watch = asyncio.create_task(self._look(on_saved))

    async def close(self) -> None:
        """Stop watching."""
        if self._watch is not None:
            self._watch.cancel()
            with contextlib.suppress(asyncio.CancelledError):
                await self._watch

    async def _look(self, on_saved: OnSaved) -> None:
        while True:
            await asyncio.sleep(EVERY_S)
            for served in self.served:
                try:
                    text = await asyncio.to_thread(self._changed, served)
                    if text is not None:
                        await on_saved(served.experiment, served.name, text)
                except Exception:
                    log.exception("a filter file could not be read", file=served.path.name)

    def _changed(self, served: ServedFilter) -> str | None:
        """Return the text of a file if it was saved since the last check."""
        try:
            if self._stamp(served.path) == self._seen.get(served.path):
                return None
            self._seen[served.path] = self._stamp(served.path)
            text = served.path.read_text(encoding="utf-8")
        except (OSError, ValueError):
            return None  # an editor may be about to replace the file
        if not text.strip():
            return None
        with contextlib.suppress(ValueError, OSError):  # a session reports what is wrong, with the line
            self._read(served.path)
        return text

    def _read(self, path: Path) -> None:
        self._seen[path] = self._stamp(path)
        experiment, title, text = look_at(path)
        name = name_of(path)
        known = self._served.get(name)
        if known is not None and known.path != path:
            raise ValueError(f"two files are called {path.name}; rename one of them")
        self._served[name] = ServedFilter(path, name, experiment, title, self._files.keep_filter(text))

    @staticmethod
    def _stamp(path: Path) -> tuple[int, int]:
        found = path.stat()
        return found.st_mtime_ns, found.st_size


def _declared(node: ast.stmt) -> str | None:
    """Return the text that a statement assigns to the target's variable."""
    match node:
        case ast.Assign([ast.Name(name)], ast.Constant(str(value))) if name == TARGET:
            return value
        case ast.AnnAssign(ast.Name(name), _, ast.Constant(str(value))) if name == TARGET:
            return value
    return None


TheFilters = Annotated[FilterFiles, service(FilterFiles)]
