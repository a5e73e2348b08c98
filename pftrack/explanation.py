"""The explanation of a run: why the target was lost, as far as its own numbers tell.

`Run.explain` and `pftrack explain` lead here. What is known of a loss comes together in one place, so that the page,
the command line, a notebook and an export say the same.
"""

from dataclasses import dataclass
from typing import Any

from pftrack.diagnosis import Diagnosis, diagnose
from pftrack.runs.run import Run

__all__ = ["Explanation", "explain"]


@dataclass(frozen=True)
class Explanation:
    """What can be said of a loss.

    Attributes:
        diagnosis: What went wrong, with the numbers that this is said from.
    """

    diagnosis: Diagnosis

    @property
    def lines(self) -> tuple[str, ...]:
        """The explanation in sentences: what went wrong first, then what each sign is said from."""
        return (self.diagnosis.sentence, *(sign.words for sign in self.diagnosis.signs))

    def as_dict(self) -> dict[str, Any]:
        """Return all of it as JSON values."""
        return {"diagnosis": self.diagnosis.as_dict()}

    def __str__(self) -> str:
        return "\n".join(self.lines)


def explain(run: Run, frame: int | None = None) -> Explanation:
    """Return the explanation of a run, as far as it has been computed.

    Args:
        run: The run.
        frame: The frame to ask about; the first lasting loss if not given.

    Raises:
        ValueError: The frame has not been computed.
    """
    return Explanation(diagnose(run, frame))
