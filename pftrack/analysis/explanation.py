"""The explanation of a run: why the target was lost, as far as its own numbers show, and what would have saved it.

`Run.explain` and `pftrack explain` use this module. It collects all findings on a loss, so the page, the command line,
a notebook and an export agree.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, cast

from pftrack.analysis.counterfactuals import ROUNDS, Report, what_if
from pftrack.analysis.diagnosis import Diagnosis, diagnose
from pftrack.core.entry_points import PRESENTERS, load
from pftrack.core.model.series import as_json
from pftrack.core.refusal import RefusedError
from pftrack.runs.loss import Loss
from pftrack.runs.run import Run


@dataclass(frozen=True)
class Explanation:
    """All findings on a loss.

    Attributes:
        diagnosis: The cause, with its numbers.
        what_if: What would have saved the run; None where that was not asked, or nothing was lost.
        untried: Why nothing could be tried, a sentence, where it was asked; else empty.
        before: The frame from which to watch the loss; None where nothing was lost.
    """

    diagnosis: Diagnosis
    what_if: Report | None = None
    untried: str = ""
    before: int | None = None

    @property
    def lines(self) -> tuple[str, ...]:
        """The explanation in sentences: the cause, the evidence of each sign, and what would have saved the run."""
        untried = (self.untried,) if self.untried else ()
        saved = untried if self.what_if is None else self.what_if.lines
        return (self.diagnosis.sentence, *(sign.words for sign in self.diagnosis.signs), *saved)

    def as_dict(self) -> dict[str, Any]:
        """Return all of it as JSON values."""
        return as_json(self)

    def _repr_html_(self) -> str:
        """Return what a notebook shows."""
        return cast("str", load(PRESENTERS, "explanation_html")(self))

    def __str__(self) -> str:
        return "\n".join(self.lines)


def explain(
    run: Run, frame: int | None = None, *, seeds: int = 0, on_step: Callable[[int, int], None] = lambda *_: None
) -> Explanation:
    """Return the explanation of a run, as far as it has been computed.

    Args:
        run: The run.
        frame: The frame to ask about; the first lasting loss if not given.
        seeds: Number of seeds for each change that might have saved the run; 0 tries none.
        on_step: Is called with the runs that were tried, and with all that there are.

    Raises:
        ValueError: The frame has not been computed, or the number of seeds is negative.
    """
    if seeds < 0:
        raise ValueError(f"seeds must be at least 0, got {seeds}")
    diagnosis = diagnose(run, frame)
    if diagnosis.frame is None or not diagnosis.lost:
        return Explanation(diagnosis)
    before = Loss.of(run.diagnostics).approach([row.hidden is True for row in run.diagnostics], diagnosis.frame)
    if not seeds:
        return Explanation(diagnosis, before=before)
    rounds = (*(count for count in ROUNDS if count < seeds), seeds)
    found: Report | None = None
    try:
        for found in what_if(run, diagnosis.frame, rounds=rounds):
            on_step(found.done, found.total)
    except RefusedError as reason:
        return Explanation(diagnosis, untried=f"What would have saved it cannot be tried: {reason}.", before=before)
    return Explanation(diagnosis, found, before=before)
