"""Refusals: a request cannot be met; the sentence names both sides and the remedy."""

from collections.abc import Sequence
from typing import Any


class RefusedError(ValueError):
    """A request cannot be met.

    Attributes:
        field: Name of the wrong part; empty if no single part is wrong.
        bound: Allowed values, in words, if known.
        value: The given value.
    """

    def __init__(self, message: str, field: str = "", *, bound: str | None = None, value: object = None) -> None:
        super().__init__(message)
        self.field, self.bound, self.value = field, bound, value


class ConflictError(RefusedError):
    """The present state does not allow it, whatever the arguments: no further frame, nothing to draw."""


class ParameterError(RefusedError):
    """A value that is not accepted; the sentence is built from its parts."""

    def __init__(self, field: str, value: object, bound: str) -> None:
        super().__init__(f"{field} must be {bound}, got {_format_value(value)}", field, bound=bound, value=value)

    def __reduce__(self) -> tuple[type["ParameterError"], tuple[str, object, str | None]]:
        """Travel between processes whole: the default would rebuild from the message alone."""
        return type(self), (self.field, self.value, self.bound)


def first_problem(errors: Sequence[Any]) -> Any:  # noqa: ANN401 - as pydantic tells it
    """Return pydantic's first error.

    Raises:
        RefusedError: A validator has raised it.
    """
    first = errors[0]
    cause = first.get("ctx", {}).get("error")
    if isinstance(cause, RefusedError):
        raise cause from None
    return first


def _format_value(value: object) -> str:
    if isinstance(value, str) and "\n" in value:  # the content of a file, whose beginning does not help
        return f"a text of {len(value)} characters"
    text = repr(value)
    return text if len(text) <= 60 else f"{text[:57]}..."
