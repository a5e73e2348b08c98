"""The data directory: the places of files, under names made by the server.

No client's text becomes part of a path: names are made here and checked when they come back.
"""

import contextlib
import fcntl
import os
import re
import secrets
import shutil
from datetime import UTC, datetime
from pathlib import Path

from pftrack.core.files import write_whole
from pftrack.core.model.parameters import LONGEST_FILE
from pftrack.core.model.recipe import Recipe
from pftrack.experiments.own.code import digest_of
from pftrack_server.core.errors import not_found

INDEX = "index.json"
LARGEST_FILTER_BYTES = 4 * LONGEST_FILE  # the most bytes of so many characters in UTF-8
LINK = "This file is a link that leads out of the data directory; links are not followed."
MOST_PREVIEWS = 300
NAME = re.compile(r"[a-z0-9]{12,32}")


def new_name() -> str:
    """Return an unguessable name."""
    return secrets.token_hex(8)


def is_name(text: str) -> bool:
    """Return whether a text has the form of a name from `new_name`."""
    return NAME.fullmatch(text) is not None


def now() -> str:
    """Return the present time as stored: to the millisecond, so that lists can be sorted by it."""
    return datetime.now(UTC).isoformat(timespec="milliseconds").replace("+00:00", "Z")


class DataDirectory:
    """The folders of a data directory, which one server uses at a time."""

    def __init__(self, root: Path) -> None:
        self.uploads, self.runs, self.sweeps = root / "uploads", root / "runs", root / "sweeps"
        self.incoming, self.outgoing = root / "incoming", root / "outgoing"
        self.states, self.filters = root / "states", root / "filters"
        # Only the owner may read the content, such as videos of people.
        root.mkdir(parents=True, exist_ok=True, mode=0o700)
        self._lock = os.open(root / "lock", os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o600)
        try:
            fcntl.flock(self._lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            os.close(self._lock)
            raise RuntimeError(
                f"The data directory {root} is in use by another server; choose another --data-dir"
            ) from None
        # Unfinished uploads and exports of the last server are useless.
        for folder in (self.incoming, self.outgoing):
            shutil.rmtree(folder, ignore_errors=True)
        for folder in (self.uploads, self.runs, self.sweeps, self.states, self.filters, self.incoming, self.outgoing):
            folder.mkdir(exist_ok=True, mode=0o700)

    def close(self) -> None:
        """Release the directory for another server."""
        os.close(self._lock)

    def keep_filter(self, text: str) -> str:
        """Store a version of a filter file that the server's owner named; return its hash, which recipes refer to."""
        digest = digest_of(text)
        if self._filter(digest) is None:
            write_whole(self._filter_path(digest), text.encode())
        return digest

    def filters_of(self, *recipes: Recipe) -> tuple[str, ...]:
        """Return the stored texts of the filter files that recipes refer to; unknown ones are left out."""
        named = {digest_of(text) for recipe in recipes for texts in recipe.filters.values() for text in texts}
        return tuple(text for text in map(self._filter, sorted(named)) if text is not None)

    def _filter(self, digest: str) -> str | None:
        """Return the text of a hash; None if there is none, or if the file's content has another hash."""
        path = self._filter_path(digest)
        try:
            if not path.is_file():  # opening a FIFO would wait for a writer
                return None
            with path.open("rb") as file:
                text = file.read(LARGEST_FILTER_BYTES).decode()
        except (OSError, UnicodeDecodeError):
            return None
        return text if digest_of(text) == digest else None

    def _filter_path(self, digest: str) -> Path:
        return self.filters / f"{digest.removeprefix('sha256:')}.py"

    def upload(self, name: str) -> Path:
        """Return the path of an upload.

        Raises:
            ApiError: The path is a link that leads elsewhere (404); so for all paths below.
        """
        path = _within(self.uploads, _check(name), "content")
        if path.is_dir() and any(entry.is_symlink() for entry in path.iterdir()):
            raise not_found(LINK)
        return path

    def index(self, name: str) -> str:
        """Return the index of an upload, as stored by `keep_index`.

        Raises:
            OSError: The index does not exist.
            ValueError: The index is not text.
        """
        return _within(self.uploads, _check(name), INDEX).read_text(encoding="utf-8")

    def keep_index(self, name: str, text: str) -> None:
        """Store the index of a decoded upload, as JSON."""
        write_whole(self.uploads / _check(name) / INDEX, text.encode())

    def new_incoming(self) -> Path:
        """Return a new path for incoming content until it has been checked."""
        return self.incoming / new_name()

    def new_outgoing(self) -> Path:
        """Return a new path for outgoing content until it has been fetched."""
        return self.outgoing / new_name()

    def exported(self, job: str) -> Path:
        """Return the folder of a job's file until it has been fetched."""
        return self.outgoing / _check(job) / "file"

    def preview(self, name: str, frame: int) -> Path:
        """Return the path of a drawn frame of an upload."""
        return _within(self.uploads, _check(name), f"frame-{frame:06d}.jpg")

    def keep_preview(self, name: str, frame: int, picture: bytes) -> None:
        """Store a drawn frame of an upload, unless many are stored or the disk is full; it can be drawn again."""
        path = self.preview(name, frame)
        if sum(1 for _ in path.parent.glob("frame-*.jpg")) < MOST_PREVIEWS:
            with contextlib.suppress(OSError):
                write_whole(path, picture)

    def truth(self, name: str, kind: str) -> Path:
        """Return the path of an upload's truth of a kind."""
        return _within(self.uploads, _check(name), f"truth-{kind}.json")

    def remove(self, kind: str, name: str) -> None:
        """Delete the files of a row; `kind` is its table's name. Only uploads, runs and sweeps have files."""
        match kind:
            case "uploads":
                _remove(self.uploads / _check(name))
            case "runs" | "sweeps":
                folder = self.runs if kind == "runs" else self.sweeps
                for path in folder.glob(f"{_check(name)}.*"):
                    _remove(path)

    def states_of(self, session: str) -> Path:
        """Return the folder of a session's checkpoints; the worker creates it."""
        return _within(self.states, _check(session))

    def remove_states(self, session: str) -> None:
        """Delete a session's checkpoints."""
        _remove(self.states / _check(session))

    def trim_states(self, most_bytes: int) -> None:
        """Delete the least recently used checkpoints until the others take at most `most_bytes`."""
        found = [(path.stat(), path) for path in self.states.glob("*/*.states")]
        total = sum(stat.st_size for stat, _ in found)
        for stat, path in sorted(found, key=lambda it: it[0].st_mtime):
            if total <= most_bytes:
                return
            path.unlink(missing_ok=True)
            total -= stat.st_size

    def record(self, name: str) -> Path:
        """Return the path of a saved run."""
        return _within(self.runs, f"{_check(name)}.pft")

    def thumbnail(self, name: str) -> Path:
        """Return the path of a saved run's thumbnail."""
        return _within(self.runs, f"{_check(name)}.png")

    def runs_bytes(self) -> int:
        """Return the bytes of all saved runs' files."""
        return sum(path.stat().st_size for path in self.runs.iterdir() if path.is_file())

    def sweep(self, name: str) -> Path:
        """Return the path of a sweep's complete result; its chunks are next to it until then."""
        for path in self.sweeps.glob(f"{_check(name)}.*"):
            _within(self.sweeps, path.name)
        return self.sweeps / f"{_check(name)}.parquet"

    def sweep_bytes(self, name: str) -> int:
        """Return the bytes of a sweep's files."""
        places = list(self.sweeps.glob(f"{_check(name)}.*"))
        files = [path for place in places for path in (place.rglob("*") if place.is_dir() else [place])]
        return sum(path.stat().st_size for path in files if path.is_file())


def _within(folder: Path, *parts: str) -> Path:
    """Return a path within one of the server's folders; refuse a link that leads out of it.

    The folders themselves may be links, as the server's owner chose.
    """
    path = folder.joinpath(*parts)
    if not path.resolve().is_relative_to(folder.resolve()):
        raise not_found(LINK)
    return path


def _remove(path: Path) -> None:
    """Delete a file, a folder, or a link itself."""
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path, ignore_errors=True)
    else:
        path.unlink(missing_ok=True)


def _check(name: str) -> str:
    if not is_name(name):
        raise ValueError("a name of a stored file must have been made by the server")
    return name
