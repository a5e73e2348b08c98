"""Filters that the server was started with: files of its owner, which stand among the trackers of an experiment.

They are named on the command line and nowhere else, and executed in workers alone; here they are read, and looked at
without being executed. A version that was saved while the server runs is kept, since runs were made with it.
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
    """A file with a filter of the server's owner."""

    name: str = Field(description="Of its tracker")
    file: str
    experiment: str = Field(description="Whose target it follows")
    digest: str = Field(description="Hash of its text, by which recipes name it")
    text: str
    editable: bool = Field(description="Whether pages may write it")
    hints: tuple[Hint, ...]
    components: tuple[Component, ...] = Field(description="Columns of the states with the usual parameters")
    observed: str = Field(description="What the functions find in a frame")


log = structlog.get_logger(__name__)

EVERY_S = 0.1
"""How often a file is looked at; somebody who saves it waits for what comes of it."""

TARGET = "EXPERIMENT"
"""What a file calls the experiment whose target it follows."""

OnSaved: TypeAlias = Callable[[str, str, str], Awaitable[None]]
"""Takes experiment, name of the tracker and text of a file that was saved."""


@dataclass(frozen=True, slots=True)
class ServedFilter:
    """A file that the server was started with.

    Attributes:
        path: Where it is.
        name: Of its tracker.
        experiment: Whose target it follows.
        title: What it says of itself, or its name.
        digest: Hash of its newest version.
    """

    path: Path
    name: str
    experiment: str
    title: str
    digest: str


def look_at(path: Path) -> tuple[str, str, str]:
    """Return the experiment of a file, its title and its text, without executing it.

    Raises:
        ValueError: It is not a filter that can be served; the sentence says what to do.
        OSError: It cannot be read.
    """
    name, text = name_of(path), path.read_text(encoding="utf-8")
    try:
        tree = ast.parse(text)
    except SyntaxError as error:
        raise ValueError(f"{path.name}, line {error.lineno}: {error.msg}") from None
    experiment = next((value for node in tree.body if (value := _declared(node)) is not None), None)
    if experiment is None:
        raise ValueError(f"{path.name} does not say whose target it follows: write {TARGET} as pftrack new filter does")
    try:
        found = find(experiment)
    except RefusedError as error:
        raise ValueError(f"{path.name}: {error}") from None
    if found.model is None:
        raise ValueError(f"{path.name}: {found.id} takes no filters from files")
    if name in found.trackers:
        raise ValueError(f"{path.name}: {found.id} has a tracker {name}; call the file otherwise")
    said = (ast.get_docstring(tree) or "").partition("\n")[0].rstrip(".")
    return found.id, said or path.name, text


class FilterFiles:
    """The files, the newest version of each, and the watch over them."""

    def __init__(self, paths: Sequence[Path], files: DataDirectory, *, editable: bool = False) -> None:
        """Read the files; pages may write them if they are editable.

        Raises:
            ValueError: One is not a filter that can be served.
            OSError: One cannot be read.
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
        """All of them."""
        return list(self._served.values())

    def bring(self, recipe: Recipe) -> Recipe:
        """Return a recipe that brings the filters of its experiment, as they are now, beside those that it has."""
        own = {each.name: (each.digest,) for each in self.served if each.experiment == recipe.experiment}
        return recipe.model_copy(update={"filters": {**own, **recipe.filters}}) if own else recipe

    def texts_of(self, experiment: str, names: Collection[object]) -> dict[str, tuple[str, ...]]:
        """Return the texts of an experiment's files among some trackers, as they are now, by name; they are kept.

        Raises:
            ValueError: One is not a filter as it is now; the sentence names its line.
            OSError: One cannot be read.
        """
        found: dict[str, tuple[str, ...]] = {}
        for each in self.served:
            if each.experiment == experiment and each.name in names:
                _, _, text = look_at(each.path)
                self._files.keep_filter(text)
                found[each.name] = (text,)
        return found

    def views(self) -> list[FilterPublic]:
        """Return all of them as everybody outside sees them."""
        return [self._view(each) for each in self.served]

    def write(self, name: str, text: str, before: str) -> FilterPublic:
        """Write a file that a page has changed.

        Args:
            name: Of its tracker.
            text: What to write.
            before: Hash of the text that it takes the place of.

        Raises:
            ApiError: The server was not started with such a file (404).
            ConflictError: It may not be written here, or was changed meanwhile.
        """
        served = self._served.get(name)
        if served is None:
            raise not_found("The server was not started with such a file.")
        if not self._editable:
            raise ConflictError("Files are written only where this machine alone can reach the server.")
        if digest_of(served.path.read_text(encoding="utf-8")) != before:
            raise ConflictError("The file was changed by somebody else; load it again.")
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
        """Watch over the files; tell whenever one was saved."""
        if self._served:
            self._watch = asyncio.create_task(self._look(on_saved))

    async def close(self) -> None:
        """Watch no more."""
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
                    log.exception("a filter's file could not be looked at", file=served.path.name)

    def _changed(self, served: ServedFilter) -> str | None:
        """Return the text of a file, if it was saved since it was last looked at."""
        try:
            if self._stamp(served.path) == self._seen.get(served.path):
                return None
            self._seen[served.path] = self._stamp(served.path)
            text = served.path.read_text(encoding="utf-8")
        except (OSError, ValueError):
            return None  # an editor may be about to put another file in its place
        if not text.strip():
            return None
        with contextlib.suppress(ValueError, OSError):  # what is wrong with it, a session says with the line
            self._read(served.path)
        return text

    def _read(self, path: Path) -> None:
        self._seen[path] = self._stamp(path)
        experiment, title, text = look_at(path)
        name = name_of(path)
        known = self._served.get(name)
        if known is not None and known.path != path:
            raise ValueError(f"two files are called {path.name}; call one of them otherwise")
        self._served[name] = ServedFilter(path, name, experiment, title, self._files.keep_filter(text))

    @staticmethod
    def _stamp(path: Path) -> tuple[int, int]:
        found = path.stat()
        return found.st_mtime_ns, found.st_size


def _declared(node: ast.stmt) -> str | None:
    """Return the text that a statement gives to the name of the target."""
    match node:
        case ast.Assign([ast.Name(name)], ast.Constant(str(value))) if name == TARGET:
            return value
        case ast.AnnAssign(ast.Name(name), _, ast.Constant(str(value))) if name == TARGET:
            return value
    return None


TheFilters = Annotated[FilterFiles, service(FilterFiles)]
