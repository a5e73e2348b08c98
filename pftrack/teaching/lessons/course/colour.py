"""Lesson 12: everything at once, on a picture."""

from collections.abc import Callable, Mapping
from functools import cache, partial
from statistics import fmean
from typing import TYPE_CHECKING

from pftrack.core.model.parameters import Value
from pftrack.runs.run import Run
from pftrack.teaching.lessons.lesson import Answer, Computed, Outcome

if TYPE_CHECKING:
    from pftrack.reproduce.histogram import Likenesses


SCENE, RUNS, LAWNS = 0, 30, 12
"""On which the checks are made."""

SIR = "condensation"
OFF: dict[str, Value] = {"velocity_retention": 0}


def frame_of_loss(run: Run) -> Answer:
    """Return the frame from which on the target is lost until the end; the number of frames if it is held there."""
    rows = run.diagnostics
    frames = len(rows)
    frame = max((row.frame + 1 for row in rows if row.lost is False), default=0)
    unseen = [row.frame for row in rows if row.hidden]
    hidden = f" Nothing of the target is seen in frames {unseen[0]} to {unseen[-1]}." if unseen else ""
    lost = f"It is lost from frame {frame} on." if frame < frames else "It is held in the last frame."
    return Answer(float(frame), words=lost + hidden, frame=min(frame, frames - 1))


@cache
def _likenesses() -> "Likenesses":
    from pftrack.reproduce.histogram import likenesses  # noqa: PLC0415 - reading alone needs no studies

    return likenesses(SCENE)


def _like(of: "Callable[[Likenesses], float]", exact: float, tolerance: float) -> Outcome:
    return Outcome(of(_likenesses()), exact, tolerance)


def _success(tracker: str, values: Mapping[str, Value], count: int, exact: float, tolerance: float) -> Outcome:
    from pftrack.reproduce.histogram import Case, runs  # noqa: PLC0415 - see above

    return Outcome(runs(Case(SCENE, tracker, values, count)).success, exact, tolerance)


def _walk_wide() -> Outcome:
    """Return how often a random walk holds the target whose cloud is wide enough to reach past the column.

    On this lawn it does in two runs of three, where the reference implementation's lawn of the same number has one in
    four; theirs cannot be drawn again. From lawn to lawn it is anything between none and all, so what can be compared
    is the mean, .39 over their five.
    """
    from pftrack.reproduce.histogram import Case, runs  # noqa: PLC0415 - see above

    walk = {**OFF, "process_noise_px": 3}
    return Outcome(fmean(runs(Case(lawn, SIR, walk, 2)).success for lawn in range(LAWNS)), 0.39, 0.25)


COMPUTED = Computed(
    frame_of_loss,
    {
        "model-sum": partial(_like, lambda found: found.model_sum, 1.0, 1e-12),
        "model-itself": partial(_like, lambda found: found.itself, 1.0, 1e-12),
        "rho-target": partial(_like, lambda found: found.target, 0.99, 0.01),
        "rho-look-alike": partial(_like, lambda found: found.look_alike, 0.96, 0.03),
        "rho-lawn": partial(_like, lambda found: found.lawn, 0.40, 0.08),
        "lambda-20": partial(_success, SIR, {}, RUNS, 1.0, 0.05),
        "lambda-200": partial(_success, SIR, {"sharpness": 200}, RUNS, 0.0, 0.2),
        "random-walk": partial(_success, SIR, OFF, RUNS, 0.2, 0.2),
        "wide-random-walk": _walk_wide,
        "greedy": partial(_success, "greedy", {}, 1, 0.0, 0.0),
    },
)
