"""Scenes of many kinds, drawn at random: a probability is fitted on some of them and judged on others.

What a tracker's own numbers mean hangs on the scene: in one that never hides its target, a small likelihood is bad
news, in another one it is the rule. So an experiment says between which bounds its parameters are to be drawn, and
each number is a scene: the same on every machine, and of a number that was not fitted one that was never seen.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field

from pftrack.core.model.parameters import Value
from pftrack.core.numerics.random import Purpose, Stream

__all__ = ["FIRST_JUDGED", "Scenes"]

FIRST_JUDGED = 10_000


@dataclass(frozen=True, slots=True)
class Scenes:
    """Where the parameters of a scene are drawn from.

    Attributes:
        ranges: Least and greatest value by name of a parameter, drawn evenly; whole numbers if both are.
        choices: Values by name, of which one is drawn.
        frames: Length of a run; of a scene that is shorter, all of it.
        fitted: How many scenes a probability is fitted on, of the numbers from 0 on.
        judged: How many others it is judged on, of the numbers from `FIRST_JUDGED` on.
        trackers: Names of those trackers that are fitted, where some would take too long; all if empty.
    """

    ranges: Mapping[str, tuple[float, float]]
    choices: Mapping[str, tuple[Value, ...]] = field(default_factory=dict)
    frames: int = 120
    fitted: int = 160
    judged: int = 80
    trackers: tuple[str, ...] = ()

    def draw(self, number: int) -> dict[str, Value]:
        """Return the parameters of a scene, by its number."""
        shares = Stream(number, 0, Purpose.SCENE).random(len(self.ranges) + len(self.choices))
        drawn: dict[str, Value] = {}
        for share, (name, (low, high)) in zip(shares, self.ranges.items(), strict=False):
            if isinstance(low, int) and isinstance(high, int):
                drawn[name] = low + int(share * (high - low + 1))
            else:
                drawn[name] = round(low + float(share) * (high - low), 3)
        for share, (name, values) in zip(shares[len(self.ranges) :], self.choices.items(), strict=True):
            drawn[name] = values[int(share * len(values))]
        return drawn
