"""Findings: what is wrong in a document, gathered with its lines, so that a file is mended in one go."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TypeVar

from pftrack.core.model.parameters import ParameterError
from pftrack.teaching.lessons.lecturers.document import Document, DocumentError, Place
from pftrack.teaching.lessons.lecturers.expression import ExpressionError

__all__ = ["Findings"]

T = TypeVar("T")


@dataclass
class Findings:
    """What is wrong so far.

    Attributes:
        document: In which.
        problems: In the order in which they were found.
    """

    document: Document
    problems: list[DocumentError] = field(default_factory=list)

    def add(self, place: Place, message: str) -> None:
        """Note that something is wrong with a value."""
        self.problems.append(DocumentError(self.document.line(place), message))

    def attempt(self, place: Place, what: Callable[[], T]) -> T | None:
        """Return what a function gives; None if it refuses, which is noted."""
        try:
            return what()
        except ParameterError as error:
            inner = (*place, error.field)
            self.add(inner if inner in self.document.lines else place, str(error))
        except (LookupError, ExpressionError) as error:
            self.add(place, f"`{'.'.join(map(str, place))}`: {error.args[0]}")
        return None
