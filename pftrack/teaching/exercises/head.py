"""Heads of exercises: what a lecturer writes above the text."""

from typing import Annotated

from pydantic import Field

from pftrack.teaching.lessons.lecturers.document import Line, Name, Part, Scalar, Words


class CheckHead(Part):
    """A property that is checked."""

    property: Name
    points: Annotated[float, Field(ge=0, le=1000)] = 1.0
    options: dict[Name, Scalar] = Field(default_factory=dict, max_length=20)


class ExerciseHead(Part):
    """All of a head; what each field means stands in docs/how-to/exercises.md."""

    id: Annotated[str, Field(max_length=40, pattern=r"^[a-z][a-z0-9]*(-[a-z0-9]+)*$")]
    title: Line
    experiment: Name
    functions: Annotated[tuple[Name, ...], Field(min_length=1, max_length=8)]
    values: dict[Name, Scalar] = Field(default_factory=dict, max_length=100)
    frames: Annotated[int, Field(ge=2, le=500)] = 60
    checks: Annotated[tuple[CheckHead, ...], Field(min_length=1, max_length=30)]
    hints: Annotated[tuple[Words, ...], Field(max_length=8)] = ()
