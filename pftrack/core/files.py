"""Files that appear whole: whoever looks sees the old content or the new one, even after a crash.

A file is written beside its place under a hidden name of its own, brought to the disk, and only then renamed.
"""

import os
import secrets
import shutil
from pathlib import Path

__all__ = ["free_bytes", "part_of", "settle", "write_whole"]


def free_bytes(folder: Path) -> int:
    """Return how much this user may still write to the disk of a folder.

    Raises:
        OSError: There is no such folder.
    """
    return shutil.disk_usage(folder).free


def part_of(path: Path) -> Path:
    """Return a new hidden name beside a path, under which its content can be written.

    It is absolute: FFmpeg and Arrow take a relative name with a colon for an address.
    """
    return path.absolute().with_name(f".{path.name}.{secrets.token_hex(4)}.part")


def settle(part: Path, path: Path) -> None:
    """Bring a file that is written completely to the disk and to its place, where it replaces what was there.

    Raises:
        OSError: That cannot be done; what was at its place is still there.
    """
    with part.open("rb") as file:
        os.fsync(file.fileno())
    part.replace(path)


def write_whole(path: Path, data: bytes) -> None:
    """Write a file so that nobody sees a piece of it.

    Raises:
        OSError: It cannot be written; what was there before is still there, and nothing beside it.
    """
    part = part_of(path)
    try:
        part.write_bytes(data)
        settle(part, path)
    finally:
        part.unlink(missing_ok=True)
