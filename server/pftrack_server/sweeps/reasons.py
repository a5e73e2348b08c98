"""Reasons: sentences for why a sweep stopped, without a path or a stack."""

import re

from pftrack.process import Ending, Fault, Outcome, Refusal, Reply

KEPT = "The computed runs are kept; resume the sweep to continue."
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


def reason(outcome: Outcome, how: str) -> str:
    """Say why a sweep is not done.

    Args:
        outcome: What came of its computation.
        how: How its process ended, in words.
    """
    match outcome:
        case Refusal(message=said) | Fault(name=said):
            pass
        case Ending.FAILED | Reply():
            said = ""
        case _:
            return f"The process that computed the sweep was {how}. {KEPT}"
    for words, meaning in COMPLAINTS.items():
        if words in said:
            return f"{meaning} {KEPT}"
    said = PATH.sub("a file", said.strip().splitlines()[-1] if said.strip() else "")[:LONGEST].rstrip(".")
    return f"{said[:1].upper()}{said[1:]}. {KEPT}" if said else f"The computation failed. {KEPT}"
