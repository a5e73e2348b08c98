"""What functions of other people return, checked: arrays of the right shape, without NaN, that say what they say.

A filter in a person's own file, and a model that `pftrack.filter` runs, are called between the steps of a filter. What
comes back wrong is refused in one sentence that names the function and both sides.
"""

import inspect
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from pftrack.core.arrays import Floats, Ints
from pftrack.core.model.likelihood import Component

MOST_PARTICLES = 1_000_000
LARGEST_EXCESS = 1e-6
"""By which a sum of weights may differ from one."""


def named_arguments(
    name: str, function: Callable[..., object], allowed: Sequence[str], refuse: Callable[[str, str], Exception]
) -> tuple[str, ...]:
    """Return the arguments that a function names, of those that it may have.

    Args:
        name: Of the function.
        function: Of somebody else.
        allowed: Names of all arguments that it may have.
        refuse: See `Answers`; it is raised for an argument of another name.
    """
    try:
        wanted = inspect.signature(getattr(function, "py_func", function)).parameters.values()
    except (TypeError, ValueError):
        return tuple(allowed)
    needed = [one for one in wanted if one.kind not in {one.VAR_POSITIONAL, one.VAR_KEYWORD}]
    for one in needed:
        if one.name not in allowed and one.default is one.empty:
            raise refuse(name, f"asks for {one.name}, but it can have {', '.join(allowed)}")
    return tuple(one.name for one in needed if one.name in allowed)


@dataclass(frozen=True)
class Answers:
    """The checks of one model's functions.

    Attributes:
        refuse: (name of the function, what is wrong) -> the error to raise.
        components: Of the states, in order; empty where nobody has named them, and then their number is free.
    """

    refuse: Callable[[str, str], Exception]
    components: Sequence[Component] = ()

    def states(self, function: str, found: object, count: int | None) -> Floats:
        """Return states (N, d), contiguous.

        Args:
            function: What has returned them.
            found: What it has returned.
            count: N; any number of particles if None.
        """
        names = ", ".join(each.name for each in self.components)
        states = self.array(function, found)
        width = len(self.components) or (states.shape[1] if states.ndim == 2 else 0)
        if states.ndim != 2 or states.shape[1] != width or width == 0 or count not in {None, len(states)}:
            wanted = f"({'N' if count is None else count}, {width or 'd'})"
            named = f", the columns being {names}" if names else ""
            raise self.refuse(function, f"returned states of shape {states.shape}; expected {wanted}{named}")
        if not 1 <= len(states) <= MOST_PARTICLES:
            raise self.refuse(function, f"returned {len(states):,} particles; expected 1 to {MOST_PARTICLES:,}")
        bad = ~np.isfinite(states).all(axis=1)
        if bad.any():
            first = int(np.argmax(bad))
            raise self.refuse(
                function,
                f"returned states that are not finite for {bad.sum()} of {len(states)} particles; particle {first} is "
                f"{self.describe(states[first])}",
            )
        return np.ascontiguousarray(states)

    def logs(self, function: str, found: object, count: int, what: str = "", states: Floats | None = None) -> Floats:
        """Return logarithms (count,) that may be -inf.

        Args:
            function: What has returned them.
            found: What it has returned.
            count: N.
            what: They are, as the sentence names them.
            states: (N, d) of which they are, for the sentence.
        """
        logs = self.array(function, found)
        named = f" {what}" if what else ""
        if logs.shape != (count,):
            raise self.refuse(function, f"returned{named} of shape {logs.shape}; expected ({count},)")
        bad = np.isnan(logs) | (logs == np.inf)
        if bad.any():
            first = int(np.argmax(bad))
            of = f", which is {self.describe(states[first])}" if states is not None else ""
            raise self.refuse(
                function,
                f"returned{named} {'NaN' if np.isnan(logs[first]) else 'infinity'} for {bad.sum()} of {count} "
                f"particles, first for particle {first}{of}",
            )
        return logs

    def places(self, function: str, found: object, count: int) -> Ints:
        """Return the places of parents among `count` particles."""
        places = np.asarray(found)
        if places.ndim != 1 or places.dtype.kind not in "iu":
            raise self.refuse(
                function,
                f"must return the places of the parents as whole numbers, one after the other; got an array of "
                f"{places.dtype} of shape {places.shape}",
            )
        if not 1 <= len(places) <= MOST_PARTICLES:
            raise self.refuse(function, f"returned {len(places):,} parents; expected 1 to {MOST_PARTICLES:,}")
        if places.min() < 0 or places.max() >= count:
            worst = int(places.min() if places.min() < 0 else places.max())
            raise self.refuse(function, f"returned the parent {worst}; there are 0 to {count - 1}")
        return places.astype(np.int64)

    def array(self, function: str, found: object) -> Floats:
        """Return an array of numbers."""
        try:
            return np.array(found, dtype=np.float64)
        except (TypeError, ValueError):
            raise self.refuse(function, f"returned {type(found).__name__}, which is no array of numbers") from None

    def describe(self, state: Floats) -> str:
        """Return the coordinates of a state (d,) with their names and units, as a sentence has them."""
        if not self.components:
            return ", ".join(f"{value:.4g}" for value in state)
        return ", ".join(
            f"{each.name} = {value:.4g}{' ' + each.unit if each.unit else ''}"
            for each, value in zip(self.components, state, strict=False)
        )
