"""How far compiling is, in numbers and in words."""

from collections.abc import Mapping
from dataclasses import dataclass, field

LEAST = 5
"""Functions that must be compiled before anything can be said of how long it will take."""


@dataclass(frozen=True)
class Progress:
    """How far compiling is.

    Attributes:
        done: Functions that are compiled, or were.
        total: Functions that there are; 0 while that is not known yet.
        usable: Experiments that run as they are by default; what else they can is compiled where it is used first.
        ready: Experiments of which everything is compiled.
        failed: Why experiments could not be run, by name.
        seconds: What was compiled now, by function, and how long each took without what it calls.
        elapsed_s: Since the beginning.
        finished: Whether all experiments are ready or have failed.
    """

    done: int = 0
    total: int = 0
    usable: frozenset[str] = frozenset()
    ready: frozenset[str] = frozenset()
    failed: Mapping[str, str] = field(default_factory=dict)
    seconds: Mapping[str, float] = field(default_factory=dict)
    elapsed_s: float = 0.0
    finished: bool = False

    @property
    def left_s(self) -> float | None:
        """About how long it will go on, s; None while nothing can be said of that."""
        if self.finished:
            return 0.0
        if len(self.seconds) < LEAST or not self.total:
            return None
        begun = len(self.seconds) / self.elapsed_s
        return max(self.total - self.done, 1) / begun

    @property
    def sentence(self) -> str:
        """What to tell a person: "compiling, 14 of 41 functions, about 40 s, only once"."""
        if self.finished:
            return "compiled"
        parts = ["compiling"]
        if self.total:
            parts.append(f"{min(self.done, self.total)} of {self.total} functions")
        if self.left_s is not None:
            parts.append(f"about {max(5 * round(self.left_s / 5), 5)} s")
        return ", ".join([*parts, "only once"])
