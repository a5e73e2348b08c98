"""Why a target was lost: a diagnosis from a run's own numbers, by the declared roles of what it reports.

- `course`: what a run's rows say over time, and the moment in question;
- `pictures`: what the frames themselves say;
- `rules`: a function for each cause; what they say in words stands in signs.yaml.
"""

import tomllib
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import computed_field

from pftrack.analysis.diagnosis.course import COLUMNS, Course, Evidence, Moment, Rule, Sign, course_of
from pftrack.analysis.diagnosis.rules import RULES
from pftrack.core.model.measures import Witness
from pftrack.core.model.preset import CAUSES, CauseId
from pftrack.core.model.series import as_json, to_json
from pftrack.core.refusal import ParameterError
from pftrack.runs.run import Run

__all__ = [
    "COLUMNS",
    "RULES",
    "Course",
    "Diagnosis",
    "Evidence",
    "Rule",
    "Sign",
    "course_of",
    "course_of_run",
    "diagnose",
    "diagnose_course",
    "picture_size",
]


# A rule measures one mechanism around a moment and returns a `Sign` if it is at work: since when, how strongly, and the
# numbers that this is said from. Several may be: the diagnosis orders them by when they began. What follows from
# another sign begins later, so no rule needs to know the others.

LEAD_IN, LEAD_OUT = 12, 12
"""So many frames before the first sign and after the moment belong to the evidence."""

DOUBT = 3
"""Without truth, a person may ask about a frame up to so many frames before the loss."""

OF_PICTURES: frozenset[CauseId] = frozenset(
    {"nothing-to-measure", "noisy-picture", "changed-look", "target-not-in-the-picture"}
)
"""Causes that are seen in pictures or measurements, whatever the filter."""

BY_WITNESS: dict[Witness, str] = {
    "truth": "Lost in frame {frame}",
    "tracker": "Lost in frame {frame} by its own account",
    "": "Frame {frame}",
}


@dataclass(frozen=True)
class Diagnosis:
    """What is wrong at a moment of a run.

    Attributes:
        frame: The first frame of the loss, or the one that was asked about; None where nothing was lost or asked.
        lost: Whether the target is lost there.
        witness: Who says so.
        signs: What is at work, ordered by when it began.
        first_lost_frame: The first frame of all in which the target is lost, for however short a time.
    """

    frame: int | None
    lost: bool
    witness: Witness
    signs: tuple[Sign, ...] = ()
    first_lost_frame: int | None = None

    @computed_field  # type: ignore[prop-decorator]
    @property
    def cause(self) -> CauseId:
        """What began first; "unclear" where nothing is found."""
        return self.signs[0].cause if self.signs else "unclear"

    @computed_field  # type: ignore[prop-decorator]
    @property
    def sentence(self) -> str:
        """What went wrong, in a sentence."""
        if self.frame is None:
            return HELD[self.witness]
        when = BY_WITNESS[self.witness if self.lost else ""].format(frame=self.frame)
        if self.lost and self.first_lost_frame not in {None, self.frame}:
            when += f", first in frame {self.first_lost_frame}"
        if not self.signs and not self.lost:
            return f"{when}: the numbers show nothing wrong."
        if not self.signs:
            return f"{when}: unclear; no known cause shows in the numbers."
        told = [f"{CAUSES[sign.cause]}, since frame {sign.since}" for sign in self.signs]
        return f"{when}: {'; then '.join(told)}."

    @computed_field  # type: ignore[prop-decorator]
    @property
    def reliability(self) -> str:
        """How often a cause that is named is right, in a sentence; empty where none is named."""
        way = "with the truth" if self.witness == "truth" else "without the truth"
        told = "In {} lost runs kept aside, with flaws of any kind, {:.0%} of the causes named {} were right."
        return told.format(OPEN_SET["cases"], OPEN_SET[way], way) if self.signs and OPEN_SET["cases"] else ""

    def as_dict(self) -> dict[str, Any]:
        """Return all of it as JSON values."""
        return as_json(self)


OPEN_SET = tomllib.loads(Path(__file__).with_name("open_set.toml").read_text("utf-8"))
"""What was found of the cases kept aside; `python -m tools.diagnosis table` writes it."""

NEVER = "The target is not lost in any frame computed so far."
HELD: dict[Witness, str] = {
    "truth": NEVER,
    "tracker": NEVER,
    "": "pftrack cannot tell whether the target is lost: the truth is unknown, the tracker reports no losses, and "
    "P(lost) is not calibrated on recordings. Mark the target in a few pictures (in a session the key T).",
}
"""The sentence on a run that has not lost its target, by its witness."""


def diagnose(run: Run, frame: int | None = None) -> Diagnosis:
    """Say what went wrong with a run, as far as it has been computed.

    Args:
        run: The run; it may be a recording, a plug-in's or one that somebody else's tracker has made.
        frame: The frame to ask about; the first lasting loss if not given.

    Raises:
        ParameterError: The frame has not been computed.
    """
    return diagnose_course(course_of_run(run), frame)


def course_of_run(run: Run) -> Course:
    """Return the course of a run, as far as it has been computed."""
    return course_of(
        run.diagnostics,
        run.experiment.all_series(),
        unit=run.experiment.judge.unit,
        size=picture_size(run),
        frame=lambda index: run.source.frame(index, run.timeline.history),
    )


def picture_size(run: Run) -> tuple[int, int] | None:
    """Return width and height of the picture, px, where estimates are places in it; None elsewhere."""
    image = run.current.frame.image_rgb
    return (image.shape[1], image.shape[0]) if image is not None and run.experiment.judge.unit == "px" else None


def diagnose_course(course: Course, frame: int | None = None, rules: Sequence[Rule] = RULES) -> Diagnosis:
    """Say what went wrong in a course.

    Args:
        course: The run.
        frame: The frame to ask about; the first lasting loss if not given. Of a frame in a loss the loss is meant.
        rules: What to look for.

    Raises:
        ParameterError: The course has no such frame.
    """
    if frame is not None and frame not in range(len(course)):
        raise ParameterError("frame", frame, f"a frame that has been computed, 0 to {len(course) - 1}")
    loss = course.loss
    at = loss.lasting if frame is None else loss.begin(int(frame))
    if at is None:
        return Diagnosis(None, lost=False, witness=loss.witness)
    moment = Moment(course, at)
    with np.errstate(divide="ignore", invalid="ignore"):
        found = [sign for sign in (rule(moment) for rule in rules) if sign is not None]
    if not course.lost[at]:
        last = at if moment.knows_truth else at + DOUBT
        # What is where it is believed to be has not been lost, whatever it went through.
        held = bool(np.isfinite(course.error[at])) and not moment.is_off
        found = [sign for sign in found if sign.since <= last and not held]
    # What happens to all pictures explains what a filter shows at the time, and not the other way round.
    seen = [sign.since for sign in found if sign.cause in OF_PICTURES]
    found = [sign for sign in found if sign.cause in OF_PICTURES or not seen or sign.since > min(seen)]
    ordered = sorted(found, key=lambda sign: sign.since)
    signs = tuple(replace(sign, unit=course.unit, evidence=_evidence(course, sign, at)) for sign in ordered)
    return Diagnosis(at, bool(course.lost[at]), loss.witnesses[at], signs, loss.first_lost_frame)


def _evidence(course: Course, sign: Sign, at: int) -> tuple[Evidence, ...]:
    first = max(min(sign.since, at) - LEAD_IN, 0)
    behind = min(max(sign.since, at) + LEAD_OUT, len(course) - 1) + 1
    shown = []
    for name in sign.kind.evidence:
        values = getattr(course, name)[first:behind]
        if np.isfinite(values).any():
            numbers = tuple(to_json(value) for value in values.tolist())
            shown.append(Evidence(name, COLUMNS[name].title, course.unit_of(name), first, numbers))
    return tuple(shown)
