"""Refusals: what is asked for cannot be done, in a sentence that names both sides and the remedy."""

from collections.abc import Sequence
from typing import Any


class RefusedError(ValueError):
    """What was asked for cannot be done.

    Attributes:
        field: What of it is wrong; empty where that is nothing in particular.
        bound: What is allowed, in words, where that is known.
        value: What was given.
    """

    def __init__(self, message: str, field: str = "", *, bound: str | None = None, value: object = None) -> None:
        super().__init__(message)
        self.field, self.bound, self.value = field, bound, value


class ConflictError(RefusedError):
    """It cannot be done with what is there now, whatever is given with it: no further frame, nothing to draw."""


class ParameterError(RefusedError):
    """A value that cannot be accepted; the sentence is made of its parts."""

    def __init__(self, field: str, value: object, bound: str) -> None:
        super().__init__(f"{field} must be {bound}, got {_format_value(value)}", field, bound=bound, value=value)

    def __reduce__(self) -> tuple[type["ParameterError"], tuple[str, object, str | None]]:
        """Travel between processes whole: the default would rebuild from the message alone."""
        return type(self), (self.field, self.value, self.bound)


def first_problem(errors: Sequence[Any]) -> Any:  # noqa: ANN401 - as pydantic tells it
    """Return what pydantic found wrong, first of all that it lists.

    Raises:
        RefusedError: A validator has raised it.
    """
    first = errors[0]
    cause = first.get("ctx", {}).get("error")
    if isinstance(cause, RefusedError):
        raise cause from None
    return first


def _format_value(value: object) -> str:
    if isinstance(value, str) and "\n" in value:  # the content of a file, of which the beginning says nothing
        return f"a text of {len(value)} characters"
    text = repr(value)
    return text if len(text) <= 60 else f"{text[:57]}..."
