"""DiskBudget: free space on the disk of the data directory, and how to make room when it is full.

A reserve of free space is left to other programs and checked before every large write. Deleting must work even on a
full disk, and deleting from a database writes to it. So a dummy file, the ballast, holds a few mebibytes and is removed
while such a write lasts.

This module also words errors of disk, database and system for a person at a browser.
"""

import errno
import os
import resource
import sqlite3
import threading
from collections.abc import Callable
from http import HTTPStatus
from pathlib import Path
from typing import TypeVar

import structlog
from sqlalchemy.exc import DBAPIError, OperationalError

from pftrack.core.files import free_bytes
from pftrack.core.refusal import RefusedError
from pftrack_server.core.errors import ApiError, disk_full
from pftrack_server.core.resource_limits import MEBIBYTE, mebibytes

log = structlog.get_logger(__name__)

Result = TypeVar("Result")

BALLAST_BYTES = 8 * MEBIBYTE
"""Size of the ballast: twice the length at which SQLite reuses its log."""
PAGE_BYTES = 4096
FULL = {errno.ENOSPC, errno.EDQUOT}
SQLITE_FULL = {
    sqlite3.SQLITE_FULL,
    sqlite3.SQLITE_IOERR_WRITE,
    sqlite3.SQLITE_IOERR_FSYNC,
    sqlite3.SQLITE_IOERR_SHMSIZE,
}
"""SQLite's error codes for a full disk, which depend on the file and the moment."""
DISK_FULL = "The server's disk is full; delete uploads, saved runs, sweeps or sessions, and try again."
FOLDER_GONE = "The server's data directory was deleted or is read-only; restore it, then restart the server."
MEANINGS = {
    errno.EFBIG: (
        HTTPStatus.INSUFFICIENT_STORAGE,
        "The server may not write a file of this length (the limit `ulimit -f` of the shell that started it).",
    ),
    errno.EMFILE: (
        HTTPStatus.SERVICE_UNAVAILABLE,
        "The server reached its limit of open files and connections (`ulimit -n`); close some pages, or end sessions.",
    ),
    errno.ENFILE: (
        HTTPStatus.SERVICE_UNAVAILABLE,
        "The server's machine reached its limit of open files; try again later.",
    ),
    errno.EROFS: (HTTPStatus.INSUFFICIENT_STORAGE, "The server's disk is read-only."),
}


def is_full(error: BaseException) -> bool:
    """Return whether an error means a full or read-only disk."""
    if isinstance(error, ApiError):
        return error.status == HTTPStatus.INSUFFICIENT_STORAGE
    if isinstance(error, OSError):
        return error.errno in FULL
    if isinstance(error, DBAPIError):
        return getattr(error.orig, "sqlite_errorcode", 0) in SQLITE_FULL or "No space left" in str(error.orig)
    return False


def is_busy(error: BaseException) -> bool:
    """Return whether an error means a database that another program keeps locked."""
    code = getattr(error.orig, "sqlite_errorcode", 0) if isinstance(error, DBAPIError) else 0
    return code & 0xFF in {sqlite3.SQLITE_BUSY, sqlite3.SQLITE_LOCKED}


def failure_message(error: BaseException) -> str:
    """Return the message for a failure after its request was answered."""
    if isinstance(error, RefusedError):
        return str(error)
    if isinstance(error, OSError | DBAPIError):
        return describe(error)[1]
    return "The server failed unexpectedly; details are in its log."


def describe(error: Exception) -> tuple[HTTPStatus, str]:
    """Return the status and message of the answer to a request that met a system error."""
    if is_full(error):
        # SQLite names neither the cause nor the path.
        limited = isinstance(error, DBAPIError) and resource.getrlimit(resource.RLIMIT_FSIZE)[0] >= 0
        return MEANINGS[errno.EFBIG] if limited else (HTTPStatus.INSUFFICIENT_STORAGE, DISK_FULL)
    if is_busy(error):
        return HTTPStatus.SERVICE_UNAVAILABLE, "The server's database is busy with another program; try again."
    if isinstance(error, ChildProcessError):
        return HTTPStatus.SERVICE_UNAVAILABLE, "The server could not start a process; try again."
    number = error.errno if isinstance(error, OSError) else None
    unknown = "The server could not read or write a file or its database; its log says which."
    return MEANINGS.get(number or 0, (HTTPStatus.INTERNAL_SERVER_ERROR, unknown))


class DiskBudget:
    """The free space on the disk of a data directory."""

    def __init__(self, folder: Path, reserve_bytes: int) -> None:
        """Remove the ballast of an earlier server."""
        self._folder = folder
        self._reserve_bytes = reserve_bytes
        self._ballast = folder / "ballast"
        self._lock = threading.Lock()
        # Opening a database may write to a full disk.
        self._ballast.unlink(missing_ok=True)

    def check(self, wanted_bytes: int = 0) -> None:
        """Make sure that a number of bytes may be written.

        Raises:
            ApiError: Less than the reserve would be left, or the folder cannot be written (507).
        """
        self.check_folder()
        free = free_bytes(self._folder)
        if free - wanted_bytes < self._reserve_bytes:
            reserve = mebibytes(self._reserve_bytes)
            raise disk_full(
                f"The server's disk has {mebibytes(free)} left and keeps {reserve} free; "
                f"this needs {mebibytes(wanted_bytes)}. Delete uploads, saved runs, sweeps or sessions, and try again."
            )

    def check_folder(self) -> None:
        """Make sure that the folder exists and is writable; SQLite keeps working in deleted files.

        Raises:
            ApiError: The folder is missing or read-only (507).
        """
        if not os.access(self._folder, os.W_OK):
            raise disk_full(FOLDER_GONE)

    def take_ballast(self) -> None:
        """Write as much of the ballast as there is room for."""
        self.check_folder()
        with self._lock:
            self._take()

    def write(self, work: Callable[[], Result]) -> Result:
        """Do work that frees space or must not fail; on a full disk, do it again without the ballast.

        Raises:
            ApiError: The folder cannot be written (507).
            Exception: An error of the work; on a full disk, that of the second attempt.
        """
        self.check_folder()
        try:
            return work()
        except (OSError, OperationalError) as error:
            if not is_full(error):
                raise
        with self._lock:
            log.warning("the disk is full; the reserve file is removed for a moment")
            self._ballast.unlink(missing_ok=True)
            try:
                return work()
            finally:
                self._take()

    def _take(self) -> None:
        held = self._ballast.stat().st_size if self._ballast.exists() else 0
        size = min(BALLAST_BYTES, held + free_bytes(self._folder)) // PAGE_BYTES * PAGE_BYTES
        if size <= held:
            return
        try:
            with self._ballast.open("ab") as file:
                os.posix_fallocate(file.fileno(), 0, size)
        except OSError:
            # Another writer was faster; the ballast holds what it got.
            return
