"""Whether a run came to the numbers that were saved, and if not, from which frame on and how it was computed then."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pftrack.core.numerics import machine
from pftrack.runs.record import Saved
from pftrack.runs.run import Run

__all__ = ["Difference", "departure", "difference"]

UNKNOWN = "an earlier version, which did not write down on what"


@dataclass(frozen=True)
class Difference:
    """Where a run comes to other numbers than its file holds.

    Attributes:
        frame: The first frame that differs; None if the file holds no numbers to compare with.
        largest: By how much any estimate differs from the saved one, in the experiment's unit; None as above, or where
            all that differs is that one of the two is not finite.
        computed_on: What the saved one was computed on.
    """

    frame: int | None
    largest: float | None
    computed_on: Mapping[str, str]

    @property
    def sentence(self) -> str:
        """What to tell a person."""
        begin = "the numbers differ from the saved ones"
        if self.frame is not None:
            begin += f" from frame {self.frame} on"
        if self.largest is not None:
            begin += f", by up to {self.largest:.2g}"
        here, there = machine.describe_platform(), self.computed_on
        if not there:
            return f"{begin}; they were computed by {UNKNOWN}"
        others = [name for name in here if there.get(name) != here[name]]
        changed = [f"{name} {there.get(name, 'unknown')} (here {here[name]})" for name in others]
        return f"{begin}; they were computed on {', '.join(changed) or 'a machine like this one'}"

    def as_dict(self) -> dict[str, object]:
        """Return the difference as JSON shows it."""
        return {"first_frame": self.frame, "largest": self.largest, "saved_on": dict(self.computed_on)}


def difference(run: Run, saved: Saved) -> Difference | None:
    """Return where a run differs from what was saved of it, None if it is the same to the bit.

    Args:
        run: Computed as far as the saved one.
        saved: As `pftrack.runs.record.read_saved` gives it.
    """
    if run.estimates_sha256 == saved.record.estimates_sha256:
        return None
    rows = [row.estimate for row in run.diagnostics]
    return departure(rows, saved) or Difference(None, None, saved.record.computed_on)


def departure(estimates: Sequence[Sequence[float]], saved: Saved) -> Difference | None:
    """Return where estimates differ from those that were saved, in the frames that both have; None if they do not.

    Args:
        estimates: Of the first frames of a run.
        saved: As above.
    """
    if saved.estimates is None:
        return None
    count = min(len(estimates), len(saved.estimates))
    one, other = np.array(estimates[:count], np.float64), saved.estimates[:count]
    if count == 0 or one.shape != other.shape:
        return None
    apart = _apart(one, other)
    differs = apart != 0.0
    if not differs.any():
        return None
    finite = apart[differs & np.isfinite(apart)]
    return Difference(int(np.argmax(differs)), float(finite.max()) if len(finite) else None, saved.record.computed_on)


def _apart(one: NDArray[np.float64], other: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the largest difference of each frame, (L,); numbers that are missing in both are equal."""
    same = (one == other) | (np.isnan(one) & np.isnan(other))
    with np.errstate(invalid="ignore"):
        away: NDArray[np.float64] = np.where(same, 0.0, np.abs(one - other)).max(axis=1)
    return away
