"""Loss: in which frames a run has lost its target, who says so, and where one looks to see why.

Everything that names a loss takes it from here: summaries, comparisons, sweeps, *Why?*, *What if*, pages and exports.
The rule for one frame is `pftrack.core.model.measures.judge_loss`: the truth judges where it is known, which is that of
a scene, of a table or of a person's marks; elsewhere the tracker's own account judges; where there is none, nobody
does. The probability that the target is lost never judges, since it is not calibrated on recordings, and in scenes the
truth is known.

Three facts have one name each:

- *first lost frame*: the first frame in which the target is lost, for however short a time;
- *lasting loss*: the first loss of five frames or more, or to the end, which is the one to explain;
- *held at the end*: the target is lost in none of the last ten frames that are judged.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pftrack.core.arrays import Bools, Floats, spans
from pftrack.core.model.measures import END_FRAMES, Witness, is_inside, judge_loss
from pftrack.core.model.source import Target
from pftrack.core.model.tracker import Diagnostics, TrackState
from pftrack.experiments.experiment import Experiment

LASTING_FRAMES = 5
"""A loss lasts if it has so many frames, or goes to the end."""

GOOD_FRAMES = 3
"""Fewer frames in which the target is held show no track that anybody could watch being lost."""

APPROACH_FRAMES = 10
"""Frames before a loss at which one begins to watch: there another choice can still save the target."""

MEMORY_FRAMES = 40
"""A target that was out of sight this many frames before it was lost was lost because of that."""

BY_WORD: tuple[Witness, ...] = ("truth", "tracker")
"""Witnesses, whose word counts more first."""


@dataclass(frozen=True, slots=True)
class Truths:
    """What is true of L frames.

    Attributes:
        positions: (L, d) true positions, NaN where unknown.
        sizes: (L,) of the target.
        extents: (L, 2) of the box around it, NaN where unknown.
    """

    positions: Floats
    sizes: Floats
    extents: Floats

    def at(self, places: slice | NDArray[np.intp]) -> "Truths":
        """Return those of some of the frames; one may be several times among them."""
        return Truths(self.positions[places], self.sizes[places], self.extents[places])


@dataclass(frozen=True, eq=False)
class Loss:
    """What is said of L frames of a run.

    Attributes:
        lost: (L,) whether the target is lost; False in a frame that nobody judges.
        witnesses: Who judges each frame.
    """

    lost: Bools
    witnesses: tuple[Witness, ...]

    @classmethod
    def of(cls, rows: Sequence[Diagnostics]) -> "Loss":
        """Return what is said of the frames of some rows, such as all of a run."""
        verdicts = [judge_loss(row.lost, row.searching) for row in rows]
        lost = np.array([one.lost is True for one in verdicts], dtype=np.bool_)
        return cls(lost, tuple(one.witness for one in verdicts))

    @property
    def witness(self) -> Witness:
        """Who says most: the truth where it is known of any frame, else the tracker, or nobody."""
        said = set(self.witnesses)
        return next((one for one in BY_WORD if one in said), "")

    @property
    def lost_frames(self) -> int | None:
        """In how many frames the target is lost; None where nobody judges any."""
        return int(np.count_nonzero(self.lost)) if self.witness else None

    @property
    def first_lost_frame(self) -> int | None:
        """The first frame in which the target is lost; None if it never is."""
        return int(np.argmax(self.lost)) if self.lost.any() else None

    @property
    def held_at_end(self) -> bool | None:
        """Whether the target is lost in none of the last ten frames that are judged; None where nobody judges any."""
        judged = [lost for lost, witness in zip(self.lost.tolist(), self.witnesses, strict=True) if witness]
        return not any(judged[-END_FRAMES:]) if judged else None

    @property
    def spans(self) -> list[tuple[int, int]]:
        """The first and the last frame of each loss, in order."""
        return spans(self.lost)

    @property
    def lasting(self) -> int | None:
        """The frame in which the first lasting loss begins, failing that the first lost frame; None without a loss."""
        lasting = (at for at, last in self.spans if last - at + 1 >= LASTING_FRAMES or last + 1 == len(self.lost))
        return next(lasting, self.first_lost_frame)

    def begin(self, frame: int) -> int:
        """Return the first frame of the loss in which a frame lies, or the frame itself."""
        return next((first for first, last in self.spans if first <= frame <= last), frame)

    def approach(self, hidden: Sequence[bool], frame: int) -> int | None:
        """Return the frame from which to watch how the target was lost: a good one shortly before.

        In a good frame the target is held and in sight, and was so in the two frames before it. The last one that is
        ten frames or more before the loss is meant, or before the target went out of sight if that led to it; for want
        of such a one the first good frame. A loss that a mark tells began after the last mark that held.

        Args:
            hidden: For each frame, whether the target is out of sight.
            frame: The last loss that began at or before this frame is meant; failing that, the first one after it.

        Returns:
            The frame, the one just before where none is good; None if the target was never lost.
        """
        begun = list(self._separate())
        if not begun:
            return None
        loss = max((start for start in begun if start <= frame), default=begun[0])
        since = max((index + 1 for index in range(loss) if self.lost[index]), default=0)
        went = max((start for start, _ in spans(hidden) if start <= loss), default=None)
        led_to_it = went is not None and any(hidden[max(went, loss - MEMORY_FRAMES) : loss + 1])
        event = went if went is not None and led_to_it and went > since else loss
        found = approach(event, [index < since or hidden[index] for index in range(event)])
        if self.witnesses[loss] == "truth":
            marks = (at for at in range(loss - 1, -1, -1) if self.witnesses[at] == "truth" and not self.lost[at])
            found = min(found, next(marks, 0))
        return found

    def _separate(self) -> Iterator[int]:
        """Yield the frames in which losses begin, those left out that follow another one after a few frames."""
        before = -GOOD_FRAMES - 1
        for first, last in self.spans:
            if first - before > GOOD_FRAMES:
                yield first
            before = last


def judge_state(
    experiment: Experiment,
    state: TrackState,
    target: Target | None,
    parameters: Any,  # noqa: ANN401 - the experiment's own model
) -> tuple[float | None, bool | None]:
    """Return the error of a frame and whether its target is lost by the truth.

    None where the truth is unknown, or there is no notion of lost.
    """
    if target is None:
        return None, None
    judge = experiment.judge
    error = float(judge.error(state.estimate, target.position))
    if math.isnan(error):  # of an estimate that is not finite: NaN would count as an unknown truth
        error = math.inf
    if target.extent is not None and is_judged_by_box(parameters):
        return error, not is_inside(state.estimate, target.position, target.extent)
    missed = judge.missed(state, target) if judge.missed else None
    if missed is not None:
        return error, bool(missed)
    return error, bool(judge.lost(error, target.size, parameters)) if judge.lost else None


def judge_estimates(
    experiment: Experiment,
    estimates: Floats,
    truths: Truths,
    parameters: Any,  # noqa: ANN401 - the experiment's own model
) -> tuple[Floats, Floats]:
    """Return what `judge_state` says of each of many estimates, where no more than places decides.

    Args:
        experiment: One without `missed`, unless true boxes decide.
        estimates: (L, d).
        truths: Of the L frames.
        parameters: In force in all of them.

    Returns:
        Errors (L,), and 1 where the target is lost, else 0 (L,); NaN where the truth is unknown.
    """
    known, extents = np.isfinite(truths.positions).all(axis=1), truths.extents
    errors = np.asarray(experiment.judge.error(estimates, truths.positions), np.float64)
    errors = np.where(known & np.isnan(errors), np.inf, errors)
    boxed = is_judged_by_box(parameters) & np.isfinite(extents).all(axis=1)
    lost = np.full(len(errors), np.nan)
    if experiment.judge.lost is not None and (known & ~boxed).any():
        lost = np.where(known, experiment.judge.lost(errors, truths.sizes, parameters), np.nan)
    if boxed.any():
        lost = np.where(boxed & known, ~is_inside(estimates, truths.positions, extents), lost)
    return errors, lost


def is_judged_by_box(parameters: Any) -> bool:  # noqa: ANN401 - the experiment's own model
    """Return whether a true box, where one is known, decides by parameters whether the target is lost."""
    # Each frame asks: an instance of a pydantic model takes four times as long as its class to say no.
    return hasattr(type(parameters), "judged_by_box") and bool(parameters.judged_by_box)


def approach(loss: int, bad: Sequence[bool] = ()) -> int:
    """Return the frame from which to watch what happens in another one; see `Loss.approach`.

    Args:
        loss: The other frame.
        bad: For each frame before it, whether the target is lost or out of sight; it is in none if not given.
    """
    good = [at for at in range(GOOD_FRAMES - 1, loss) if not any(bad[at + 1 - GOOD_FRAMES : at + 1])]
    early = [at for at in good if at <= loss - APPROACH_FRAMES]
    return early[-1] if early else good[0] if good else max(0, loss - 1)


def loss_start(frame: int, before: int | None, *, lost: bool | None) -> int | None:
    """Return the frame in which the loss began that goes on in a frame.

    Args:
        frame: The frame.
        before: The same of the frame before it.
        lost: Whether the target is lost.

    Returns:
        The frame; None if the target is not lost here.
    """
    if not lost:
        return None
    return frame if before is None else before


def loss_words(frames: int, lost_frames: int, first_lost_frame: int | None) -> str:
    """Say in which of a run's frames the target is lost, a clause for lists and tables."""
    if first_lost_frame is None:
        return f"Never lost in {frames} frames"
    return f"Lost in {lost_frames} of {frames} frames, first in frame {first_lost_frame}"
