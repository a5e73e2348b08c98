"""Errors of the operating system: what they mean for somebody who has only a browser."""

import errno
import resource
from http import HTTPStatus

from sqlalchemy.exc import DBAPIError

from pftrack.core.refusal import RefusedError
from pftrack_server.core.errors import ApiError
from pftrack_server.store.database import is_busy
from pftrack_server.store.disk_budget import DISK_FULL, is_full

MEANINGS = {
    errno.EFBIG: (
        HTTPStatus.INSUFFICIENT_STORAGE,
        "The server may not write a file of this length (the limit `ulimit -f` of the shell that started it).",
    ),
    errno.EMFILE: (
        HTTPStatus.SERVICE_UNAVAILABLE,
        "The server holds as many files and connections as it may (`ulimit -n`); close some pages, or end sessions.",
    ),
    errno.ENFILE: (
        HTTPStatus.SERVICE_UNAVAILABLE,
        "The server's machine holds as many files open as it may; try again later.",
    ),
    errno.EROFS: (HTTPStatus.INSUFFICIENT_STORAGE, "The server's disk is read-only."),
}


def failure_message(error: BaseException) -> str:
    """Return the sentence for something that failed after the request for it was answered."""
    if isinstance(error, ApiError | RefusedError):
        return str(error)
    if isinstance(error, OSError | DBAPIError):
        return describe(error)[1]
    return "The server failed unexpectedly; details are in its log."


def describe(error: Exception) -> tuple[HTTPStatus, str]:
    """Return the status and the sentence with which a request is answered that met an error of the system."""
    if is_full(error):
        # A database tells the one from the other no more than it tells paths.
        limited = isinstance(error, DBAPIError) and resource.getrlimit(resource.RLIMIT_FSIZE)[0] >= 0
        return MEANINGS[errno.EFBIG] if limited else (HTTPStatus.INSUFFICIENT_STORAGE, DISK_FULL)
    if is_busy(error):
        return HTTPStatus.SERVICE_UNAVAILABLE, "The server's database is busy with another program; try again."
    if isinstance(error, ChildProcessError):
        return HTTPStatus.SERVICE_UNAVAILABLE, "The server could not start a process; try again."
    number = error.errno if isinstance(error, OSError) else None
    unknown = "The server could not read or write a file or its database; its log says which."
    return MEANINGS.get(number or 0, (HTTPStatus.INTERNAL_SERVER_ERROR, unknown))
