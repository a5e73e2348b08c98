"""What was computed once, kept on the disk until the program changes: JSON objects by a hash of their subject."""

import contextlib
import hashlib
import json
import shutil
from pathlib import Path
from typing import Any

from pftrack.core.files import write_whole
from pftrack.core.numerics import machine
from pftrack.doctor.memory import source_hash


def digest(about: str) -> str:
    """Return the name under which something is kept.

    Args:
        about: All that it depends on beside the program.
    """
    return hashlib.sha256(about.encode()).hexdigest()[:32]


class DiskCache:
    """A folder of results, each a file; what cannot be read, or written, is computed again.

    Args:
        folder: Where they are kept.
    """

    def __init__(self, folder: Path) -> None:
        self._root = folder

    def open(self) -> None:
        """Forget what another version of the program has computed."""
        self._root.mkdir(parents=True, exist_ok=True, mode=0o700)
        for other in self._root.iterdir():
            if other != self._folder:
                shutil.rmtree(other, ignore_errors=True)
        self._folder.mkdir(exist_ok=True, mode=0o700)

    def read(self, name: str) -> dict[str, Any] | None:
        """Return what is kept under a name; None if nothing is."""
        try:
            kept = json.loads((self._folder / name).read_bytes())
        except (OSError, ValueError):
            return None
        return kept if isinstance(kept, dict) else None

    def write(self, name: str, result: dict[str, Any]) -> None:
        """Keep a result under a name."""
        with contextlib.suppress(OSError):  # a full disk: it is computed again after the next start
            write_whole(self._folder / name, json.dumps(result).encode())

    @property
    def _folder(self) -> Path:
        return self._root / _program()


def _program() -> str:
    """Return a hash of the program."""
    on = json.dumps(machine.describe_platform(), sort_keys=True)
    return hashlib.sha256(on.encode() + source_hash()).hexdigest()[:16]
