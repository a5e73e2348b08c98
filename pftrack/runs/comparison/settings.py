"""Settings: what makes runs different, in words.

A parameter may change in mid-run, so that what a run has of it is a course of values. It is listed where these courses
differ within the frames that are compared, and only there.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

from pftrack.core.model.parameters import Declaration, Value, declarations
from pftrack.runs.comparison.alignment import Alignment
from pftrack.runs.run import Run

__all__ = ["Setting", "settings"]

Steps: TypeAlias = tuple[tuple[int, Value], ...]
"""Values by the frame from which on they are in force, as the frames that are compared are counted."""


@dataclass(frozen=True, slots=True)
class Setting:
    """Something in which runs differ.

    Attributes:
        name: The parameter's; "experiment", "recording", "start", "mark", "tracker" or "seed" for what is none.
        title: What it is called.
        values: What each run has of it, in words with the unit; None for a run that knows no such thing.
    """

    name: str
    title: str
    values: tuple[str | None, ...]

    def as_dict(self) -> dict[str, Any]:
        """Return it as JSON values."""
        return {"name": self.name, "title": self.title, "values": list(self.values)}


def settings(runs: Sequence[Run], alignment: Alignment) -> tuple[Setting, ...]:
    """Return what differs between runs: what they are made on, then tracker and seed, then parameters as declared.

    A parameter is listed where a run has it at another value than suits what it is made on by itself; what follows from
    another experiment or another mark alone is not, and neither is what is only drawn.

    Args:
        runs: The runs.
        alignment: Which frames are compared; what changes after them does not count.
    """
    spans = [(first, alignment.frames) for first in alignment.firsts]
    rows = (
        Setting("experiment", "Experiment", tuple(run.experiment.title for run in runs)),
        *_of_recordings(runs),
        Setting("tracker", "Tracker", tuple(map(_trackers, runs, spans))),
        Setting("seed", "Seed", tuple(map(_seeds, runs, spans))),
        *_of_parameters(runs, spans),
    )
    return tuple(row for row in rows if len(set(row.values)) > 1)


def _of_recordings(runs: Sequence[Run]) -> Iterator[Setting]:
    footage = [run.setup.footage for run in runs]
    names = ((one.name or "a recording") if one else "simulated" for one in footage)
    yield Setting("recording", "Recording", tuple(names))
    yield Setting("start", "Begins at picture", tuple(str(one.start) if one else None for one in footage))
    marks = [one.mark if one else None for one in footage]
    kinds = (None if mark is None else f"mark {marks.index(mark) + 1}" for mark in marks)
    yield Setting("mark", "Target", tuple(kinds))


def _trackers(run: Run, span: tuple[int, int]) -> str:
    titles = {name: tracker.title for name, tracker in run.experiment.trackers.items()}
    return _over_time(_course(((it.start, titles[it.tracker]) for it in run.timeline.segments), span), str)


def _seeds(run: Run, span: tuple[int, int]) -> str:
    seeds = ((it.start, run.seed if it.seed is None else it.seed) for it in run.timeline.segments)
    return _over_time(_course(seeds, span), str)


def _of_parameters(runs: Sequence[Run], spans: Sequence[tuple[int, int]]) -> Iterator[Setting]:
    declared = [_declarations(run) for run in runs]
    every = {name: declaration for known in declared for name, declaration in known.items()}
    for name, declaration in every.items():
        courses = [
            _values(run, name, span) if name in known else None
            for run, known, span in zip(runs, declared, spans, strict=True)
        ]
        if all(course in {None, _usual(run, name)} for run, course in zip(runs, courses, strict=True)):
            continue
        yield Setting(
            name,
            declaration.title,
            tuple(None if course is None else _in_words(declaration, course) for course in courses),
        )


def _declarations(run: Run) -> Mapping[str, Declaration]:
    return {it.name: it for it in declarations(type(run.setup.parameters)) if it.role != "drawing"}


def _usual(run: Run, name: str) -> Steps | None:
    """Return the course of a parameter that nobody has set: what suits the scene or the recording."""
    value = getattr(run.setup.parameters, name, None)
    return None if value is None else ((0, value),)


def _values(run: Run, name: str, span: tuple[int, int]) -> Steps:
    return _course(((it.start, getattr(it.parameters, name)) for it in run.timeline.segments), span)


def _course(steps: Iterable[tuple[int, Value]], span: tuple[int, int]) -> Steps:
    """Return the steps within a span (first frame, how many), counted from there, without those that change nothing."""
    first, count = span
    kept: list[tuple[int, Value]] = []
    for frame, value in steps:
        at = max(0, frame - first)
        if kept and kept[-1][0] == at:
            kept.pop()
        if at < count and not (kept and kept[-1][1] == value):
            kept.append((at, value))
    return tuple(kept)


def _in_words(declaration: Declaration, steps: Steps) -> str:
    """Return the values of a parameter over time: "800, 200 from frame 57 on"."""
    return _over_time(steps, lambda value: _format_value(declaration, value))


def _over_time(steps: Steps, said: Callable[[Value], str]) -> str:
    begin, *later = steps
    return ", ".join([said(begin[1]), *(f"{said(value)} from frame {frame} on" for frame, value in later)])


def _format_value(declaration: Declaration, value: Value) -> str:
    if isinstance(value, bool):
        return "on" if value else "off"
    if declaration.kind == "file":
        return f"a file of {len(str(value))} characters" if value else "none"
    text = f"{value:.6g}" if isinstance(value, int | float) else value or "none"
    return f"{text} {declaration.unit}".strip()
