"""What an experiment says of the bands of its trackers: which there are, and where they are not to be believed.

A band of 95 % should hold the truth in 95 % of the reports. Where a method cannot do that, whoever declares the tracker
says so, with the setting and the reason; whoever shows, summarises or exports a run passes the reason on. There are two
ways: bands that hold the truth less often than they say, and those that hold it more often.
"""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any, Literal, TypeAlias, get_args

from pftrack.core.model.band import Band, EstimateBand
from pftrack.core.model.parameters import Value

__all__ = ["DIRECTIONS", "STANDARD_CALIBRATION", "TITLES", "Calibration", "Direction", "Miscalibration", "reasons"]

Direction: TypeAlias = Literal["overconfident", "underconfident"]

DIRECTIONS: tuple[Direction, ...] = get_args(Direction)

TITLES: Mapping[Direction, str] = {
    "overconfident": "Error bands too narrow",
    "underconfident": "Error bands too wide",
}
"""What a screen says of them, before the reason."""

Bounds: TypeAlias = tuple[float, float]


@dataclass(frozen=True, slots=True)
class Miscalibration:
    """A setting in which bands hold the truth less often than they say, or more often.

    Attributes:
        trackers: Names of those that it is about.
        reason: Why, and how far off they are; one or two sentences.
        values: Values of parameters in which it holds, by name; of a parameter that is not named, any. None stands for
            a run whose parameters have none of that name, such as one of a scene on a recording.
        ranges: Least and greatest value of parameters in which it holds, by name.
        bands: What the bands are about that it holds of; empty if it holds of all.
        direction: Whether they are surer than they may be, or less sure.
    """

    trackers: tuple[str, ...]
    reason: str
    values: Mapping[str, tuple[Value | None, ...]] = field(default_factory=dict)
    ranges: Mapping[str, Bounds] = field(default_factory=dict)
    bands: tuple[str, ...] = ()
    direction: Direction = "overconfident"

    def holds(self, tracker: str, parameters: Any) -> bool:  # noqa: ANN401 - the experiment's own model
        """Return whether it holds of a tracker with these parameters."""
        return (
            tracker in self.trackers
            and all(getattr(parameters, name, None) in allowed for name, allowed in self.values.items())
            and all(low <= getattr(parameters, name, math.nan) <= high for name, (low, high) in self.ranges.items())
        )

    @property
    def setting(self) -> str:
        """The values of parameters in which it holds, in words; empty if it is in all."""
        said = {name: ["none" if it is None else str(it) for it in allowed] for name, allowed in self.values.items()}
        exact = [f"{name} = {' or '.join(allowed)}" for name, allowed in said.items()]
        return "; ".join([*exact, *(f"{name} {_words(bounds)}" for name, bounds in self.ranges.items())])

    def as_dict(self) -> dict[str, Any]:
        """Return it as JSON values by name."""
        ranges = {name: [end if math.isfinite(end) else None for end in bounds] for name, bounds in self.ranges.items()}
        return {
            "direction": self.direction,
            "trackers": list(self.trackers),
            "bands": list(self.bands),
            "values": {name: list(allowed) for name, allowed in self.values.items()},
            "ranges": ranges,
            "reason": self.reason,
        }


@dataclass(frozen=True, slots=True)
class Calibration:
    """What is said of the bands of an experiment's trackers.

    Attributes:
        bands: What its trackers say of their own error, and how it is compared with the truth; empty if nothing is
            promised of them.
        faults: Settings in which that is not so.
        presets: Names of those in which bands are measured, beside the default scene.
        scene: Name of the parameter that numbers scenes of one kind, such as people; measured are as many of them as
            seeds. Empty where the seed alone makes another scene.
        frames: How many frames of a run are measured at most.
    """

    bands: tuple[Band, ...] = (EstimateBand(),)
    faults: tuple[Miscalibration, ...] = ()
    presets: tuple[str, ...] = ()
    scene: str = ""
    frames: int = 120


STANDARD_CALIBRATION = Calibration()
"""Of an experiment that says nothing of it: the band of the estimate, which is to be believed."""


def reasons(declared: Iterable[Miscalibration], in_force: Iterable[tuple[str, Any]]) -> dict[Direction, str]:
    """Return why bands are not to be believed in the ways that hold of any of several trackers with their parameters.

    Each reason is said once; a way in which nothing holds is left out.
    """
    settings, said = list(in_force), tuple(declared)
    found: dict[Direction, str] = {}
    for direction in DIRECTIONS:
        holding = (
            one.reason for one in said if one.direction == direction and any(one.holds(*each) for each in settings)
        )
        if words := " ".join(dict.fromkeys(holding)):
            found[direction] = words
    return found


def _words(bounds: Bounds) -> str:
    low, high = bounds
    if not math.isfinite(low):
        return f"up to {high:g}"
    return f"from {low:g}" if not math.isfinite(high) else f"{low:g} to {high:g}"
