"""Loss: frames in which a run has lost its target, the judge, and the frame from which to watch the loss.

Summaries, comparisons, sweeps, *Why?*, *What if*, pages and exports all take losses from this module. The rule for one
frame is `pftrack.core.model.measures.judge_loss`: the truth judges where it is known, from a scene, a table or a
person's marks; elsewhere the tracker's own report judges; without a report nobody does. The probability that the target
is lost never judges: it is not calibrated on recordings, and in scenes the truth is known.

Three facts have one name each:

- *first lost frame*: the first frame in which the target is lost, however briefly;
- *lasting loss*: the first loss that lasts five frames or more, or to the end; this is the loss to explain;
- *held at the end*: the target is lost in none of the last ten judged frames.
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
"""Frames after which a loss counts as lasting; one that reaches the end lasts, too."""

GOOD_FRAMES = 3
"""Frames in which the target must be held before a loss, so that there is a track to lose."""

APPROACH_FRAMES = 10
"""Frames before a loss from which to watch: there another choice can still save the target."""

MEMORY_FRAMES = 40
"""Frames before a loss within which hiding the target counts as its cause."""

BY_WORD: tuple[Witness, ...] = ("truth", "tracker")
"""Witnesses in order of precedence."""


@dataclass(frozen=True, slots=True)
class Truths:
    """The truth of L frames.

    Attributes:
        positions: (L, d) true positions, NaN where unknown.
        sizes: (L,) sizes of the target.
        extents: (L, 2) width and height of the box around it, NaN where unknown.
    """

    positions: Floats
    sizes: Floats
    extents: Floats

    def at(self, places: slice | NDArray[np.intp]) -> "Truths":
        """Return the truth of some of the frames; a frame may occur several times."""
        return Truths(self.positions[places], self.sizes[places], self.extents[places])


@dataclass(frozen=True, eq=False)
class Loss:
    """The verdict on L frames of a run.

    Attributes:
        lost: (L,) whether the target is lost; False in a frame without a judge.
        witnesses: Judge of each frame.
    """

    lost: Bools
    witnesses: tuple[Witness, ...]

    @classmethod
    def of(cls, rows: Sequence[Diagnostics]) -> "Loss":
        """Return the verdict on the frames of some rows, for example all rows of a run."""
        verdicts = [judge_loss(row.lost, row.searching) for row in rows]
        lost = np.array([one.lost is True for one in verdicts], dtype=np.bool_)
        return cls(lost, tuple(one.witness for one in verdicts))

    @property
    def witness(self) -> Witness:
        """The best judge of any frame: the truth, else the tracker, else nobody."""
        said = set(self.witnesses)
        return next((one for one in BY_WORD if one in said), "")

    @property
    def lost_frames(self) -> int | None:
        """Number of lost frames; None if nobody judges any frame."""
        return int(np.count_nonzero(self.lost)) if self.witness else None

    @property
    def first_lost_frame(self) -> int | None:
        """The first frame in which the target is lost; None if it never is."""
        return int(np.argmax(self.lost)) if self.lost.any() else None

    @property
    def held_at_end(self) -> bool | None:
        """Whether the target is lost in none of the last ten judged frames; None if nobody judges any."""
        judged = [lost for lost, witness in zip(self.lost.tolist(), self.witnesses, strict=True) if witness]
        return not any(judged[-END_FRAMES:]) if judged else None

    @property
    def spans(self) -> list[tuple[int, int]]:
        """First and last frame of each loss, in order."""
        return spans(self.lost)

    @property
    def lasting(self) -> int | None:
        """First frame of the first lasting loss, else the first lost frame; None without a loss."""
        lasting = (at for at, last in self.spans if last - at + 1 >= LASTING_FRAMES or last + 1 == len(self.lost))
        return next(lasting, self.first_lost_frame)

    def begin(self, frame: int) -> int:
        """Return the first frame of the loss in which a frame lies, or the frame itself."""
        return next((first for first, last in self.spans if first <= frame <= last), frame)

    def approach(self, hidden: Sequence[bool], frame: int) -> int | None:
        """Return the frame from which to watch how the target was lost: a good one shortly before.

        In a good frame and in the two frames before it the target is held and in sight. The result is the last good
        frame that is at least ten frames before the loss, or before the target went out of sight if that led to the
        loss; without such a frame it is the first good one. A loss shown by a mark began after the last mark that held.

        Args:
            hidden: For each frame, whether the target is out of sight.
            frame: Selects the last loss that began at or before this frame, else the first one after it.

        Returns:
            The frame, or the one just before the loss if none is good; None if the target was never lost.
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
        """Yield the first frames of losses, except losses that follow another after a few frames."""
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

    Either is None where the truth is unknown or the experiment does not define a loss.
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
    """Return the verdicts of `judge_state` on many estimates whose positions alone decide.

    Args:
        experiment: An experiment without `missed`, unless true boxes decide.
        estimates: (L, d) estimates.
        truths: Truth of the L frames.
        parameters: Parameters in force in all of them.

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
    """Return whether, by these parameters, a known true box decides whether the target is lost."""
    # Each frame asks: an instance of a pydantic model takes four times as long as its class to say no.
    return hasattr(type(parameters), "judged_by_box") and bool(parameters.judged_by_box)


def approach(loss: int, bad: Sequence[bool] = ()) -> int:
    """Return the frame from which to watch another frame; see `Loss.approach`.

    Args:
        loss: The other frame.
        bad: For each frame before it, whether the target is lost or out of sight (default: in none).
    """
    good = [at for at in range(GOOD_FRAMES - 1, loss) if not any(bad[at + 1 - GOOD_FRAMES : at + 1])]
    early = [at for at in good if at <= loss - APPROACH_FRAMES]
    return early[-1] if early else good[0] if good else max(0, loss - 1)


def loss_start(frame: int, before: int | None, *, lost: bool | None) -> int | None:
    """Return the first frame of the loss that includes a frame.

    Args:
        frame: The frame.
        before: First frame of the loss that includes the frame before.
        lost: Whether the target is lost.

    Returns:
        The first frame of the loss; None if the target is not lost in this frame.
    """
    if not lost:
        return None
    return frame if before is None else before


def loss_words(frames: int, lost_frames: int, first_lost_frame: int | None) -> str:
    """Return a clause for lists and tables on the frames in which the target is lost."""
    if first_lost_frame is None:
        return f"Never lost in {frames} frames"
    return f"Lost in {lost_frames} of {frames} frames, first in frame {first_lost_frame}"
