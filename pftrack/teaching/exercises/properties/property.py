"""What a property is: a name, what holds, what it can be asked with, and the function that looks."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import TypeAlias

from pftrack.teaching.exercises.submission import Submission
from pftrack.teaching.exercises.verdict import Verdict

__all__ = ["Look", "Option", "Options", "Property"]

Option: TypeAlias = "int | float | str"
Options: TypeAlias = "Mapping[str, Option]"
Look: TypeAlias = "Callable[[Submission, Options, int], Verdict]"
"""(submission, options, first seed) -> what was found."""


@dataclass(frozen=True)
class Property:
    """Something that should hold of a file.

    Attributes:
        name: In the heads of exercises.
        title: What holds, a clause.
        look: Finds out.
        options: Their defaults; an empty text has to be given.
        margin: How far a right solution may be off, and how seldom it fails; a sentence for the documentation.
    """

    name: str
    title: str
    look: Look
    options: Options = field(default_factory=dict)
    margin: str = "Nothing in it is left to chance."
