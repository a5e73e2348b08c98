"""Reasons: sentences for why a sweep stopped, without a path or a stack."""

import re
from typing import Any

from pftrack.process import describe

__all__ = ["CANCELLED", "DELETED", "RESTARTED", "STOPPED", "reason"]

KEPT = "What was computed is kept; resume the sweep to go on."
CANCELLED = f"The sweep was cancelled. {KEPT}"
DELETED = "The sweep was deleted."
STOPPED = f"The server was stopped. {KEPT}"
RESTARTED = f"The server was stopped while the sweep was running. {KEPT}"

COMPLAINTS = {
    "No space left": "The disk of the server is full.",
    "File too large": "The result is larger than a sweep on this server may be.",
    "Disk quota": "The disk quota of the server is used up.",
    "Cannot allocate memory": "There was not enough memory.",
}
PATH = re.compile(r"(?<![\w.])/[^\s:;,)]+")
LONGEST = 300


def reason(status: int, answer: dict[str, Any]) -> str:
    """Say why the process of a sweep ended.

    Args:
        status: Its exit status, negative for a signal.
        answer: The JSON that it printed, with its complaint where there is no error.
    """
    if status < 0:
        return f"The process that computed the sweep was {describe(status)}. {KEPT}"
    error = answer.get("error", {})
    said = str(error.get("message") or answer.get("complaint") or "").strip()
    for words, meaning in COMPLAINTS.items():
        if words in said:
            return f"{meaning} {KEPT}"
    said = PATH.sub("a file", said.splitlines()[-1] if said else "")[:LONGEST].rstrip(".")
    return f"{said[:1].upper()}{said[1:]}. {KEPT}" if said else f"The computation failed. {KEPT}"
