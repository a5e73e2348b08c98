"""The data directory: where files lie, under names that the server made up.

Nothing that a client sends ever becomes part of a path: identifiers are made here and checked on the way back.
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
LARGEST_FILTER_BYTES = 4 * LONGEST_FILE  # as UTF-8 writes so many characters at most
LINK = "This file is a link that leads out of the data directory; links are not followed."
MOST_PREVIEWS = 300
NAME = re.compile(r"[a-z0-9]{12,32}")


def new_name() -> str:
    """Return a name that nobody can guess."""
    return secrets.token_hex(8)


def is_name(text: str) -> bool:
    """Tell whether a text can be a name that `new_name` made."""
    return NAME.fullmatch(text) is not None


def now() -> str:
    """Return the time as it is stored, to the millisecond so that lists can be sorted by it."""
    return datetime.now(UTC).isoformat(timespec="milliseconds").replace("+00:00", "Z")


class DataDirectory:
    """The folders of a data directory, held by one server at a time."""

    def __init__(self, root: Path) -> None:
        self.uploads, self.runs, self.sweeps = root / "uploads", root / "runs", root / "sweeps"
        self.incoming, self.outgoing = root / "incoming", root / "outgoing"
        self.states, self.filters = root / "states", root / "filters"
        # What is here belongs to its owner alone: videos of people, among others.
        root.mkdir(parents=True, exist_ok=True, mode=0o700)
        self._lock = os.open(root / "lock", os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o600)
        try:
            fcntl.flock(self._lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            os.close(self._lock)
            raise RuntimeError(
                f"The data directory {root} is in use by another server; choose another --data-dir"
            ) from None
        # What was coming or going when the last server stopped is of no use to anybody.
        for folder in (self.incoming, self.outgoing):
            shutil.rmtree(folder, ignore_errors=True)
        for folder in (self.uploads, self.runs, self.sweeps, self.states, self.filters, self.incoming, self.outgoing):
            folder.mkdir(exist_ok=True, mode=0o700)

    def close(self) -> None:
        """Let another server have the directory."""
        os.close(self._lock)

    def keep_filter(self, text: str) -> str:
        """Keep a version of a filter's file that its owner has named; return the hash by which recipes name it."""
        digest = digest_of(text)
        if self._filter(digest) is None:
            write_whole(self._filter_path(digest), text.encode())
        return digest

    def filters_of(self, *recipes: Recipe) -> tuple[str, ...]:
        """Return the versions of filters' files that recipes name, as far as this server was ever started with them."""
        named = {digest_of(text) for recipe in recipes for texts in recipe.filters.values() for text in texts}
        return tuple(text for text in map(self._filter, sorted(named)) if text is not None)

    def _filter(self, digest: str) -> str | None:
        """Return the text that is kept under a hash; None if there is none, or what lies there has another hash."""
        path = self._filter_path(digest)
        try:
            if not path.is_file():  # to open a FIFO is to wait until somebody writes to it
                return None
            with path.open("rb") as file:
                text = file.read(LARGEST_FILTER_BYTES).decode()
        except (OSError, UnicodeDecodeError):
            return None
        return text if digest_of(text) == digest else None

    def _filter_path(self, digest: str) -> Path:
        return self.filters / f"{digest.removeprefix('sha256:')}.py"

    def upload(self, name: str) -> Path:
        """Return where an upload lies.

        Raises:
            ApiError: A link stands there that leads elsewhere, as is so of all that follows here (404).
        """
        path = _within(self.uploads, _check(name), "content")
        if path.is_dir() and any(entry.is_symlink() for entry in path.iterdir()):
            raise not_found(LINK)
        return path

    def index(self, name: str) -> str:
        """Return what was kept of an upload by `keep_index`.

        Raises:
            OSError: It does not exist.
            ValueError: It is not a text.
        """
        return _within(self.uploads, _check(name), INDEX).read_text(encoding="utf-8")

    def keep_index(self, name: str, text: str) -> None:
        """Keep what was found when an upload was decoded, as JSON."""
        write_whole(self.uploads / _check(name) / INDEX, text.encode())

    def new_incoming(self) -> Path:
        """Return where something that comes may be put until it is known to be good."""
        return self.incoming / new_name()

    def new_outgoing(self) -> Path:
        """Return where something that is made for somebody may be put until it was fetched."""
        return self.outgoing / new_name()

    def exported(self, job: str) -> Path:
        """Return where the file that a job makes lies until it was fetched, in a folder of its own."""
        return self.outgoing / _check(job) / "file"

    def preview(self, name: str, frame: int) -> Path:
        """Return where a frame of an upload is kept once it was drawn."""
        return _within(self.uploads, _check(name), f"frame-{frame:06d}.jpg")

    def keep_preview(self, name: str, frame: int, picture: bytes) -> None:
        """Keep a frame of an upload, unless many are kept already or the disk is full; it can be drawn again."""
        path = self.preview(name, frame)
        if sum(1 for _ in path.parent.glob("frame-*.jpg")) < MOST_PREVIEWS:
            with contextlib.suppress(OSError):
                write_whole(path, picture)

    def truth(self, name: str, kind: str) -> Path:
        """Return where the truth of a kind is kept that was given for an upload."""
        return _within(self.uploads, _check(name), f"truth-{kind}.json")

    def remove(self, kind: str, name: str) -> None:
        """Delete the files of an upload, a run or a sweep, by the name of its kind's table; others have none."""
        match kind:
            case "uploads":
                _remove(self.uploads / _check(name))
            case "runs" | "sweeps":
                folder = self.runs if kind == "runs" else self.sweeps
                for path in folder.glob(f"{_check(name)}.*"):
                    _remove(path)

    def states_of(self, session: str) -> Path:
        """Return the folder of a session's checkpoints, which its worker makes."""
        return _within(self.states, _check(session))

    def remove_states(self, session: str) -> None:
        """Delete a session's checkpoints."""
        _remove(self.states / _check(session))

    def trim_states(self, most_bytes: int) -> None:
        """Delete the checkpoints that were not used for the longest time, until the others take no more than this."""
        found = [(path.stat(), path) for path in self.states.glob("*/*.states")]
        total = sum(stat.st_size for stat, _ in found)
        for stat, path in sorted(found, key=lambda it: it[0].st_mtime):
            if total <= most_bytes:
                return
            path.unlink(missing_ok=True)
            total -= stat.st_size

    def record(self, name: str) -> Path:
        """Return where a saved run lies."""
        return _within(self.runs, f"{_check(name)}.pft")

    def thumbnail(self, name: str) -> Path:
        """Return where a saved run's picture lies."""
        return _within(self.runs, f"{_check(name)}.png")

    def runs_bytes(self) -> int:
        """Return how much room the files of all saved runs take."""
        return sum(path.stat().st_size for path in self.runs.iterdir() if path.is_file())

    def sweep(self, name: str) -> Path:
        """Return where a sweep's result lies once it is complete; what there is before lies beside it."""
        for path in self.sweeps.glob(f"{_check(name)}.*"):
            _within(self.sweeps, path.name)
        return self.sweeps / f"{_check(name)}.parquet"

    def sweep_bytes(self, name: str) -> int:
        """Return how much room the files of a sweep take."""
        places = list(self.sweeps.glob(f"{_check(name)}.*"))
        files = [path for place in places for path in (place.rglob("*") if place.is_dir() else [place])]
        return sum(path.stat().st_size for path in files if path.is_file())


def _within(folder: Path, *parts: str) -> Path:
    """Return a path in one of the server's folders, which is not a link that leads out of it.

    The folders themselves may be links: where they lie is the choice of the server's owner.
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
