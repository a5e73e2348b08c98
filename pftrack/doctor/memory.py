"""A record of the experiments that have been compiled on this machine: a folder next to Numba's cache.

Its name depends on everything that compiled code depends on, so after a change, or an update of a library, the record
is empty; an experiment is then called again, which takes a second if its code is already compiled. Code of other
packages is not included: after a change there their own sessions compile it. Each experiment is a file in the folder:
several processes compile at once, and none may erase another's record.
"""

import hashlib
import os
import shutil
import sys
import tempfile
from collections.abc import Iterable
from contextlib import suppress
from functools import cache
from pathlib import Path

from pftrack.core.numerics import machine

KEPT = 8
"""Memories of other versions and checkouts that are left alone."""


def cache_folder() -> Path | None:
    """Return the folder of compiled code: from the environment, else next to the source, else in the user's cache."""
    chosen = os.environ.get("NUMBA_CACHE_DIR")
    beside = Path(__file__).parents[1] / "__pycache__"
    places = [Path(chosen)] if chosen else [beside, Path("~/.cache").expanduser()]
    return next((place for place in places if writable(place)), None)


def ready(names: Iterable[str]) -> frozenset[str]:
    """Return which experiments are remembered as compiled, of those given."""
    found: set[str] = set()
    for folder in (machine.PRECOMPILED / _name(), memory_folder()):
        with suppress(OSError):
            found.update(path.name for path in folder.iterdir()) if folder else None
    return frozenset(found) & frozenset(names)


def remember(name: str) -> None:
    """Remember that an experiment has been compiled; where nothing can be written, nothing is remembered."""
    folder = memory_folder()
    if folder is None:
        return
    with suppress(OSError):
        folder.mkdir(parents=True, exist_ok=True)
        (folder / name).touch()
        others = sorted(folder.parent.glob("warm-*/"), key=lambda other: other.stat().st_mtime)
        for old in others[:-KEPT]:
            shutil.rmtree(old, ignore_errors=True)


def memory_folder() -> Path | None:
    """Return the folder that remembers, which need not exist; None where nothing can be kept."""
    cache = cache_folder()
    return cache / _name() if cache else None


def _name() -> str:
    """Return the folder's name: a hash of all that compiled code depends on: our source, the compiler and its target.

    All of the source, since the result must not depend on what a process has imported.
    """
    digest = hashlib.sha256(str(sys.implementation.cache_tag).encode())
    on = machine.describe_platform()
    for name in ("target", "numba", "llvmlite", "numpy"):
        digest.update(f"{name} {on[name]}\n".encode())
    digest.update(source_hash())
    return f"warm-{digest.hexdigest()[:16]}"


@cache
def source_hash() -> bytes:
    """Return a hash of the source, which a process reads once, since it keeps its imported code."""
    package = Path(__file__).parents[1]
    digest = hashlib.sha256()
    for path in sorted(package.rglob("*.py")):
        digest.update(f"{path.relative_to(package)}\n".encode())
        digest.update(path.read_bytes())
    return digest.digest()


def existing(place: Path) -> Path:
    """Return a folder, or the nearest one above it that exists."""
    return next(it for it in (place, *place.parents) if it.exists())


def writable(place: Path) -> bool:
    """Return whether files can be made in a folder, or in the nearest one above it that exists."""
    try:
        with tempfile.TemporaryFile(dir=existing(place)):
            return True
    except OSError:
        return False
