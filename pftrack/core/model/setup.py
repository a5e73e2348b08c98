"""Setups: a simulated scene or a recording wired for an experiment, with what the experiment offers for it.

- Suitability: can this likelihood follow this target? It is judged before tracking.
- Finders: how to find the target of a recording without a mark.
- Exports: files of a frame and the frames before it. Saved runs and columns of series need no declaration; an
  experiment declares further files that are useful in other programs, such as the model of a head, and commands and
  pages list them.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import isnan
from pathlib import Path
from statistics import median
from typing import Any, Literal, Protocol, TypeAlias, TypeVar

import numpy as np

from pftrack.core.arrays import Floats
from pftrack.core.model.marks import Mark
from pftrack.core.model.measures import HIT_RATE
from pftrack.core.model.parameters import Parameters
from pftrack.core.model.recipe import Footage
from pftrack.core.model.series import Series
from pftrack.core.model.source import Frame, FrameSequence, Source
from pftrack.core.model.tracker import Diagnostics
from pftrack.core.refusal import ParameterError

# An experiment for recordings may declare how to judge a marked or found target (`Experiment.suits`). The result is a
# number from 0 to 1, its description, and advice. `docs/reference/measures.md` says how well the number predicts
# whether the target is lost.
#
# The appearance of a target and of its surroundings changes. So on a recording a run measures in every frame how likely
# the surroundings of the estimate are in relation to the estimate itself (`BESIDE`, by `Setup.beside`).

Grade: TypeAlias = Literal["well", "poorly", "not at all", "no verdict"]

WELL, NOT_AT_ALL = 0.6, 0.3
"""Bounds of "well" and "not at all". By colour both came true at every start on real clips
(`benchmarks/suitability.py`); between them a tracker may hold or lose its target."""

BESIDE = Series("beside", "likelihood around the estimate, over that on it")
"""Series whose values mean "separates well" below 1 - `WELL` and "not at all" above 1 - `NOT_AT_ALL`."""

SETTLED = 5
"""Number of last frames whose median value says how well a target separates."""


@dataclass(frozen=True, slots=True, eq=False)
class Suitability:
    """The suitability of a target.

    Attributes:
        value: Suitability, 0..1; higher is better.
        remark: The finding, a sentence without capital and full stop.
        advice: Advice, one clause each.
        better: A more suitable mark of the same target, if found.
        likelihood: (height, width) over the picture with the mark, 0..1 relative to its peak, at every n-th pixel of a
            large picture; None if the likelihood is not a function of places in the picture.
        tells: Whether the value predicts loss; if not, the grade is "no verdict".
    """

    value: float
    remark: str
    advice: tuple[str, ...] = ()
    better: Mark | None = None
    likelihood: Floats | None = None
    tells: bool = True

    @property
    def sentences(self) -> tuple[str, ...]:
        """The finding and the advice, one sentence each."""
        return tuple(f"{said[:1].upper()}{said[1:]}." for said in (self.remark, *self.advice))

    @property
    def grade(self) -> Grade:
        """The value in words."""
        return _in_words(self.value) if self.tells else "no verdict"


def describe_course(beside: Sequence[float]) -> str:
    """Describe how well a target separates from its surroundings in the last frame, and since when.

    Args:
        beside: Values of `BESIDE` in the frames from 0 on, NaN where unknown.

    Returns:
        A sentence without its full stop; empty if the last value is unknown.
    """
    found = _settled(beside, len(beside) - 1)
    if found is None:
        return ""
    said = _in_words(1.0 - found)
    since = len(beside) - 1
    while since > 0 and (before := _settled(beside, since - 1)) is not None and _in_words(1.0 - before) == said:
        since -= 1
    when = f" since frame {since}" if since > 0 else " from the start"
    if found > 1.0:
        return f"Separates {said}{when}: the estimate is {100 / found:.0f} % as likely as what is beside it"
    return f"Separates {said}{when}: what is beside the estimate is {100 * found:.0f} % as likely as it"


def _settled(beside: Sequence[float], frame: int) -> float | None:
    if frame < 0 or isnan(beside[frame]):
        return None
    return median(value for value in beside[max(frame - SETTLED + 1, 0) : frame + 1] if not isnan(value))


def _in_words(value: float) -> Grade:
    return "well" if value >= WELL else "poorly" if value >= NOT_AT_ALL else "not at all"


def grade(value: float, unusable: float, usable: float) -> float:
    """Return the suitability, 0..1, for a quantity; larger ones are better.

    Args:
        value: Measured value.
        unusable: Bound of "not at all".
        usable: Bound of "well"; at twice this value the suitability is 1.
    """
    return float(np.interp(value, (0.0, unusable, usable, 2.0 * usable), (0.0, NOT_AT_ALL, WELL, 1.0)))


@dataclass(frozen=True)
class Setup:
    """A source wired for one experiment, with its defaults.

    Attributes:
        open_source: (seed, parameters of frame 0) -> source.
        parameters: Defaults for this source; one flat model of scene and tracker.
        footage: The recording with its target, marked or found; None for a simulated scene.
        success: Name of the measure that decides on success, a share; the parameter with the role "loss_share" limits
            its missed frames.
        units: Parameters of frame 0 -> units of this source, by the name of a plot, and under "estimate" the unit of
            estimate and error; None if the experiment's own units hold.
        beside: (frame, state, parameters) -> value of `BESIDE`, if the likelihood is a function of places.
    """

    open_source: Callable[[int, Any], Source[Any]]
    parameters: Parameters
    footage: Footage | None = None
    success: str = HIT_RATE.name
    units: Callable[[Any], Mapping[str, str]] | None = None
    beside: Callable[[Frame, Any, Any], float] | None = None


class Suits(Protocol):
    """Judge whether a target in a recording can be followed, before tracking."""

    def __call__(self, sequence: FrameSequence, footage: Footage, parameters: Any) -> Suitability:  # noqa: ANN401 - the experiment's own model
        """Return the suitability of a target.

        Args:
            sequence: The pictures.
            footage: The recording with its first picture and mark.
            parameters: Parameters of frame 0.
        """


@dataclass(frozen=True, slots=True)
class Sighting:
    """The result of searching for a target in one picture of a recording.

    Attributes:
        frame: Number of the picture.
        mark: The target; None if it was not found.
        sure: Whether the picture shows at least a part of the target; if not, a model placed all of it.
        placed: Names of the mark's handles that a model placed.
        remarks: Points for a person to check, or why nothing was found, one sentence each.
    """

    frame: int
    mark: Mark | None = None
    sure: bool = False
    placed: tuple[str, ...] = ()
    remarks: tuple[str, ...] = ()


class Search(Protocol):
    """Search for a target through a recording."""

    def __call__(self, sequence: FrameSequence, frames: Sequence[int]) -> Iterator[Sighting]:
        """Search one picture after the other.

        Args:
            sequence: The pictures.
            frames: Numbers of the pictures, in this order. Only the first result says why nothing was found, because
                that takes several times as long as the search.
        """


@dataclass(frozen=True, slots=True)
class Finder:
    """How an experiment finds its target in a recording.

    Attributes:
        frames: (first, last) -> numbers of the pictures to search, as many as some seconds allow.
        search: Searches pictures.
        better: (sequence, sighting) -> a better sighting soon after it, or the same.
        kind: Kind of the resulting marks.
        within: (sequence, frame, mark of another kind by a person) -> the target there, if necessary placed completely
            by a model.
        hints: Kinds of mark that `within` accepts.
    """

    frames: Callable[[int, int], Sequence[int]]
    search: Search
    better: Callable[[FrameSequence, Sighting], Sighting]
    kind: type[Mark]
    within: Callable[[FrameSequence, int, Mark], Sighting] | None = None
    hints: tuple[type[Mark], ...] = ()


Make: TypeAlias = Callable[[Any, Sequence[Diagnostics]], bytes]
"""(the tracker's state, the rows of all frames from 0 to this one) -> the file; a `ConflictError` says why not."""


@dataclass(frozen=True, slots=True)
class Export:
    """A file format for a frame.

    Attributes:
        name: Name in commands and addresses.
        title: Title in a few words.
        suffix: Suffix of the file name without the dot, unique among the exports of the experiment.
        media_type: Media type of the file.
        make: Function that makes its content.
    """

    name: str
    title: str
    suffix: str
    media_type: str
    make: Make


@dataclass(frozen=True, slots=True)
class Exported:
    """The result of an export.

    Attributes:
        files: The file, and its separate manifest, if any.
        frames: The exported part of the run in words.
        complete: Whether it is the complete run.
    """

    files: tuple[Path, ...]
    frames: str
    complete: bool


class Named(Protocol):
    """An object with the name and the suffix of an export."""

    @property
    def name(self) -> str:
        """Name in commands and addresses."""

    @property
    def suffix(self) -> str:
        """Suffix of the file name, without the dot."""


N = TypeVar("N", bound=Named)


def find_export(exports: Iterable[N], name: str) -> N:
    """Return the export with a name or suffix.

    Raises:
        ParameterError: No export has it; the message lists all of them.
    """
    offered = tuple(exports)
    for one in offered:
        if name in {one.name, one.suffix}:
            return one
    raise ParameterError("export", name, f"one of {', '.join(one.name for one in offered) or 'none'}")
