"""Setups: a source wired for an experiment, a simulated scene or a recording, and what the experiment offers of it.

- Suitability: can this target be followed by this likelihood? Asked before tracking, not after.
- Finders: how a target is found on a recording that nobody has marked.
- Exports: files of a frame and of those before it. A run is saved, and its series are written as columns, without
  anybody's help. What a belief has beyond that and is worth taking to another program, such as the model of a head, its
  experiment declares; commands and pages list what there is.
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

# An experiment that takes recordings may declare how it looks at a target that was marked or found
# (`Experiment.suits`). The answer is a number from 0 to 1, the words that go with it, and what would help.
# `docs/reference/measures.md` says how well the number predicts whether the target is lost.
#
# The look of a target changes, and so does what is around it. On a recording a run therefore measures in every frame
# how likely what is around the estimate is beside the estimate itself (`BESIDE`, by `Setup.beside`).

Grade: TypeAlias = Literal["well", "poorly", "not at all", "no verdict"]

WELL, NOT_AT_ALL = 0.6, 0.3
"""Bounds of "well" and "not at all". By colour both came true at every start on real clips
(`benchmarks/suitability.py`); between them a tracker may hold or lose its target."""

BESIDE = Series("beside", "likelihood around the estimate, over that on it")
"""Below 1 - `WELL` the target separates well, above 1 - `NOT_AT_ALL` not at all."""

SETTLED = 5
"""So many frames, this one the last, say together how a target separates: the middle one of their values."""


@dataclass(frozen=True, slots=True, eq=False)
class Suitability:
    """What came of looking at a target.

    Attributes:
        value: 0..1, the higher the better.
        remark: What was found, a sentence without its capital and full stop.
        advice: What would help, a clause each.
        better: A mark of the same target that suits better, where one was found.
        likelihood: (height, width) over the picture in which the target is marked, 0..1 relative to its peak, of a
            large picture every so-many-th pixel; None for a likelihood that is not one of places in the picture.
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
        """What was found, and what would help, a sentence each."""
        return tuple(f"{said[:1].upper()}{said[1:]}." for said in (self.remark, *self.advice))

    @property
    def grade(self) -> Grade:
        """The number in words."""
        return _in_words(self.value) if self.tells else "no verdict"


def describe_course(beside: Sequence[float]) -> str:
    """Say how a target separates from its surroundings in the last of some frames, and since when.

    Args:
        beside: Values of `BESIDE` in the frames from 0 on, NaN where they are not known.

    Returns:
        A sentence without its full stop; empty where nothing is known of the last frame.
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
    """Return how suitable a quantity is, 0..1, of which more is better.

    Args:
        value: What was measured.
        unusable: Below this it is suitable "not at all".
        usable: From here on it is "well"; twice as much is as good as it gets.
    """
    return float(np.interp(value, (0.0, unusable, usable, 2.0 * usable), (0.0, NOT_AT_ALL, WELL, 1.0)))


@dataclass(frozen=True)
class Setup:
    """A source wired for one experiment, with the defaults that suit it.

    Attributes:
        open_source: (seed, parameters of frame 0) -> source.
        parameters: Defaults in force for this source; one flat model of scene and tracker.
        footage: What a recipe says of the recording, with the target where it was marked or found; None for a
            simulated scene.
        success: Name of the measure that decides on success, a share: its frames that miss are counted against the
            parameter with the role "loss_share".
        units: Parameters of frame 0 -> units that this source has for itself, by the name of a plot, and by "estimate"
            that of the estimate and its error; None where the experiment's own hold.
        beside: (frame, state, parameters) -> the value of `BESIDE`, where a target's likelihood is one of places.
    """

    open_source: Callable[[int, Any], Source[Any]]
    parameters: Parameters
    footage: Footage | None = None
    success: str = HIT_RATE.name
    units: Callable[[Any], Mapping[str, str]] | None = None
    beside: Callable[[Frame, Any, Any], float] | None = None


class Suits(Protocol):
    """Look whether a target in a recording can be followed, before it is tracked."""

    def __call__(self, sequence: FrameSequence, footage: Footage, parameters: Any) -> Suitability:  # noqa: ANN401 - the experiment's own model
        """Return how suitable it is.

        Args:
            sequence: The pictures.
            footage: What a setup says of the recording: where it starts, and the target's mark there.
            parameters: Of frame 0.
        """


@dataclass(frozen=True, slots=True)
class Sighting:
    """What came of looking for a target in one picture of a recording.

    Attributes:
        frame: Number of the picture.
        mark: The target; None if it was not found.
        sure: Whether the picture has shown it, wholly or in part, rather than a model has placed all of it.
        placed: Names of the mark's handles that a model has placed rather than the picture shown.
        remarks: What a person should look at, or why there is nothing, one sentence each.
    """

    frame: int
    mark: Mark | None = None
    sure: bool = False
    placed: tuple[str, ...] = ()
    remarks: tuple[str, ...] = ()


class Search(Protocol):
    """Look for a target through a recording."""

    def __call__(self, sequence: FrameSequence, frames: Sequence[int]) -> Iterator[Sighting]:
        """Look into one picture after the other.

        Args:
            sequence: The pictures.
            frames: Which of them, in this order. Only of the first is it said why there is nothing, since that takes
                several times as long as looking.
        """


@dataclass(frozen=True, slots=True)
class Finder:
    """How an experiment finds its target on a recording by itself.

    Attributes:
        frames: (first, last) -> numbers of the pictures to look into, as many as can be looked into in some seconds.
        search: Look into pictures.
        better: (sequence, sighting) -> one soon after it that is a better start, or the same.
        kind: Of the marks that it gives.
        within: (sequence, frame, mark of another kind that a person has made) -> the target there, if need be all of
            it placed.
        hints: Kinds of mark that `within` takes.
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
    """A file that can be made of a frame.

    Attributes:
        name: Name in commands and addresses.
        title: What it is, a few words.
        suffix: Of the file's name, without the dot; no other export of the experiment has it.
        media_type: Of the file.
        make: What makes it.
    """

    name: str
    title: str
    suffix: str
    media_type: str
    make: Make


@dataclass(frozen=True, slots=True)
class Exported:
    """What came of an export.

    Attributes:
        files: The file, and that of its manifest where it has one of its own.
        frames: How much of the run they hold, in words.
        complete: Whether that is all of it.
    """

    files: tuple[Path, ...]
    frames: str
    complete: bool


class Named(Protocol):
    """What has the name and the suffix of an export."""

    @property
    def name(self) -> str:
        """Name in commands and addresses."""

    @property
    def suffix(self) -> str:
        """Of the file's name, without the dot."""


N = TypeVar("N", bound=Named)


def find_export(exports: Iterable[N], name: str) -> N:
    """Return the export of a name, or with a suffix.

    Raises:
        ParameterError: No export has it; the sentence lists all of them.
    """
    offered = tuple(exports)
    for one in offered:
        if name in {one.name, one.suffix}:
            return one
    raise ParameterError("export", name, f"one of {', '.join(one.name for one in offered) or 'none'}")
