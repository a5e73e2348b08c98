"""The property of a tracker: that it holds its target."""

import math
from collections.abc import Sequence

import numpy as np

from pftrack.core.model.diagnostics import Diagnostics
from pftrack.teaching.exercises.properties.property import Options
from pftrack.teaching.exercises.submission import Submission
from pftrack.teaching.exercises.verdict import Verdict

__all__ = ["held"]

LAST = 0.25
"""Of the frames: so long the target has to be held at the end."""


def held(submission: Submission, options: Options, seed: int) -> Verdict:
    """See in how many seeds the target is held at the end, whatever was in its way."""
    runs, needed = int(options["runs"]), int(options["needed"])
    lost = [
        each
        for each in range(seed, seed + runs)
        if not _is_held(submission.rows(each), float(options["largest_error"]))
    ]
    words = f"The target is held in {runs - len(lost)} of {runs} seeds; {needed} are due."
    if lost:
        words += f" It is lost in seed {', '.join(map(str, lost[:5]))}{' and others' if len(lost) > 5 else ''}."
    numbers = {"held": float(runs - len(lost)), "runs": float(runs), "needed": float(needed)}
    return Verdict(runs - len(lost) >= needed, words, numbers, lost[0] if lost else seed)


def _is_held(run: Sequence[Diagnostics], largest_error: float) -> bool:
    """Return whether a run ends on its target: by the experiment's notion of lost, or by its mean error."""
    rows = run[-max(math.ceil(LAST * len(run)), 1) :]
    if largest_error > 0:
        errors = [row.error for row in rows if row.error is not None]
        return bool(errors) and float(np.mean(errors)) <= largest_error
    return not any(row.is_lost for row in rows)
