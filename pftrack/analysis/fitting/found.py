"""What a fit has found: numbers before and after, what both halves of the run come to, and whether it is kept."""

from dataclasses import dataclass
from typing import Any, Final, Literal, TypeAlias

from pftrack.analysis.fitting.scores import Score
from pftrack.core.model.parameters import Declaration, Value

__all__ = ["Fit", "FitError", "Fitted", "Half", "Method"]

SURE_SD: Final = 2.0
"""By how many standard errors what was found must be better on the second half to be kept."""
MOST_LOST: Final = 0.1
"""Share of the frames in which a target may be lost without a word of caution."""

Method: TypeAlias = Literal["em", "search"]
"""How numbers are found: by expectation maximisation where the model is linear, by trying values elsewhere."""


class FitError(ValueError):
    """What cannot be fitted."""


@dataclass(frozen=True, slots=True)
class Fitted:
    """One number that was fitted.

    Attributes:
        declared: What it is.
        before: Its value before.
        after: The value that was found.
        at_bound: Whether that is about a bound of the number, so that the best may lie beyond.
    """

    declared: Declaration
    before: float
    after: float
    at_bound: bool


@dataclass(frozen=True, slots=True)
class Half:
    """One half of a run, with random numbers that no trial had.

    Attributes:
        first: Its first frame.
        last: Its last frame.
        before: What it comes to with the values before.
        after: With those that were found.
    """

    first: int
    last: int
    before: Score
    after: Score


@dataclass(frozen=True, slots=True)
class Fit:
    """What came of a fit.

    Attributes:
        tracker: Name of the tracker.
        numbers: Those that were fitted.
        halves: The half that was used, and the one that was not.
        gain: By how much the log evidence of a frame of the second half is larger, nats.
        gain_error: Standard error of that.
        method: How they were found.
        rounds: How many steps of expectation maximisation, or how many settings were tried.
        runs: How many runs it took.
        seeds: How many runs of each setting.
        lost: In how many of the frames the run had lost its target, by the truth or by the tracker's own account.
    """

    tracker: str
    numbers: tuple[Fitted, ...]
    halves: tuple[Half, Half]
    gain: float
    gain_error: float
    method: Method
    rounds: int
    runs: int
    seeds: int
    lost: int

    @property
    def kept(self) -> bool:
        """Whether what was found is better on the half that was not used."""
        return self.gain > SURE_SD * self.gain_error and any(it.after != it.before for it in self.numbers)

    @property
    def values(self) -> dict[str, Value]:
        """What was found, by name; empty if it is not kept."""
        return {it.declared.name: it.after for it in self.numbers} if self.kept else {}

    @property
    def verdict(self) -> str:
        """What came of it, one sentence."""
        if all(it.after == it.before for it in self.numbers):
            return "Not changed: nothing better was found than what was there."
        way = "larger" if self.gain > 0 else "smaller"
        size = f"{abs(self.gain):.2g} ± {self.gain_error:.1g} nats a frame"
        said = f"on the half that was not used, the evidence is {way} by {size}"
        if self.kept:
            return f"Kept: {said}."
        why = "which may be chance" if self.gain > 0 else "so what was found suits the other half alone"
        return f"Not kept: {said}, {why}."

    @property
    def procedure(self) -> str:
        """How it was found, one sentence."""
        each = f", in {self.seeds} runs each" if self.seeds > 1 else ""
        if self.method == "em":
            steps = "step" if self.rounds == 1 else "steps"
            return f"Found by expectation maximisation in {self.rounds} {steps}, since the model is linear."
        how = "golden section" if len(self.numbers) == 1 else "a simplex search"
        return f"Found by {how} over {self.rounds} settings{each}."

    @property
    def caution(self) -> str:
        """Why it may mislead, one sentence; empty if nothing speaks against it."""
        frames = self.halves[1].last
        if self.lost <= MOST_LOST * frames:
            return ""
        return (
            f"The run had lost its target in {self.lost} of {frames} frames, which say little about it: fit a run, "
            "or the beginning of one, that holds it."
        )

    def as_dict(self) -> dict[str, Any]:
        """Return it as JSON values by name; a number that is not known becomes None."""
        return {
            "tracker": self.tracker,
            "kept": self.kept,
            "verdict": self.verdict,
            "caution": self.caution,
            "values": self.values,
            "numbers": [
                {
                    "name": it.declared.name,
                    "title": it.declared.title,
                    "unit": it.declared.unit,
                    "before": it.before,
                    "after": it.after,
                    "at_bound": it.at_bound,
                }
                for it in self.numbers
            ],
            "halves": [
                {"first": it.first, "last": it.last, "before": it.before.as_dict(), "after": it.after.as_dict()}
                for it in self.halves
            ],
            "gain": self.gain,
            "gain_error": self.gain_error,
            "method": self.method,
            "rounds": self.rounds,
            "procedure": self.procedure,
            "runs": self.runs,
            "seeds": self.seeds,
        }
