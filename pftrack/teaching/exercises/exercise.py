"""What an exercise is: a text, a file to begin with, and what is checked of what becomes of it."""

from collections.abc import Mapping
from dataclasses import dataclass

from pftrack.core.model.parameters import Value

__all__ = ["Check", "Exercise"]


@dataclass(frozen=True)
class Check:
    """One property that a file is checked for.

    Attributes:
        property: Its name.
        points: What it is worth.
        options: What differs from the property's own, by name.
    """

    property: str
    points: float
    options: Mapping[str, Value]


@dataclass(frozen=True)
class Exercise:
    """What a student is asked to write.

    Attributes:
        id: Name in commands and in files.
        title: A few words.
        experiment: Whose target the file follows.
        functions: That are to be written, of those that a filter's file may define.
        values: Parameters of the experiment that differ from its defaults.
        frames: Length of a run.
        checks: In the order in which they are told.
        text: What is asked, as Markdown.
        skeleton: The file to begin with.
        hints: One after the other.
        origin: Where it is from, as people call it.
    """

    id: str
    title: str
    experiment: str
    functions: tuple[str, ...]
    values: Mapping[str, Value]
    frames: int
    checks: tuple[Check, ...]
    text: str
    skeleton: str
    hints: tuple[str, ...]
    origin: str

    @property
    def points(self) -> float:
        """All that can be reached."""
        return sum(check.points for check in self.checks)
