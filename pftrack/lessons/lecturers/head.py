"""Heads: what a lecturer writes above the text, before it is known whether it fits an experiment."""

import re
from collections.abc import Iterable, Iterator
from difflib import get_close_matches
from typing import Annotated, Any, Final, Literal, TypeVar, get_args

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from pftrack.lessons.lecturers.document import Document, DocumentError

__all__ = ["Head", "QuestionHead", "ask", "errors_of", "near", "read_as"]

Form = TypeVar("Form", bound=BaseModel)

LONGEST_RUN: Final = 2000
"""Frames: a class does not wait longer, and whoever opens the lesson computes its run."""

Line = Annotated[str, Field(min_length=1, max_length=120)]
Words = Annotated[str, Field(min_length=1, max_length=600)]
Name = Annotated[str, Field(min_length=1, max_length=64)]
Scalar = bool | int | float | Annotated[str, Field(max_length=200)]


class _Part(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


class ChangeHead(_Part):
    """Values that take effect in a frame."""

    frame: Annotated[int, Field(ge=0, le=LONGEST_RUN)] = 0
    values: Annotated[dict[Name, Scalar], Field(min_length=1, max_length=100)]


class MistakeHead(_Part):
    """A usual wrong answer: a number, [lowest, highest], or the name of a choice."""

    given: float | tuple[float, float] | Name
    words: Words


class QuestionHead(_Part):
    """The prediction that is asked for."""

    text: Words
    kind: Literal["number", "choice", "point"] = "number"
    words: Words
    tolerance: Annotated[float, Field(gt=0)] | None = None
    unit: Annotated[str, Field(max_length=20)] = ""
    bounds: tuple[float, float] = (-1e6, 1e6)
    choices: Annotated[dict[Name, Words], Field(min_length=2, max_length=8)] | None = None
    panel: Name | None = None
    along: Literal["x", "y"] = "x"
    at: Annotated[dict[Name, Scalar], Field(max_length=100)] = {}
    mistakes: Annotated[tuple[MistakeHead, ...], Field(max_length=12)] = ()
    expected: float | Name | None = None


class Head(_Part):
    """All of a head; what each field means stands in docs/how-to/lessons.md."""

    id: Annotated[str, Field(max_length=64, pattern=r"^[a-z][a-z0-9]*(-[a-z0-9]+)*$")]
    title: Line
    experiment: Name | None = None
    tracker: Name | None = None
    figure: Name | None = None
    parameters: Annotated[dict[Name, Scalar], Field(max_length=100)] = {}
    seed: Annotated[int, Field(ge=0)] | None = None
    frames: Annotated[int, Field(ge=2, le=LONGEST_RUN)] | None = None
    timeline: Annotated[tuple[ChangeHead, ...], Field(max_length=200)] = ()
    unlocked: Annotated[tuple[Name, ...], Field(max_length=8)] = ()
    plots: Annotated[tuple[Name, ...], Field(max_length=8)] = ()
    layers: Annotated[tuple[Words, ...], Field(max_length=8)] = ()
    frame: Annotated[int, Field(ge=0)] = 0
    question: QuestionHead
    answer: str | int | float
    tries: Annotated[tuple[Words, ...], Field(min_length=1, max_length=6)]
    minutes: Annotated[float, Field(gt=0, le=180)] | None = None
    notice: Words


def ask(document: Document) -> Head | list[DocumentError]:
    """Return the head of a document, or all that is wrong with its form."""
    return read_as(document, Head, "lesson", "docs/how-to/lessons.md")


def read_as(document: Document, form: type[Form], what: str, page: str) -> Form | list[DocumentError]:
    """Return the head of a document in a form, or all that is wrong with it.

    Args:
        document: The file.
        form: Of its head.
        what: What such a file is, a word.
        page: Where a whole example stands.
    """
    try:
        return form.model_validate(document.head)
    except ValidationError as error:
        return [_to_document_error(document, each, form, what, page) for each in errors_of(error)]


def errors_of(error: ValidationError) -> list[Any]:
    """Return what is wrong, one for each place: of a value that may be of several kinds, the first kind's."""
    found: dict[tuple[Any, ...], Any] = {}
    for each in error.errors():
        place = tuple(part for part in each["loc"] if not (isinstance(part, str) and KIND.fullmatch(part)))
        found.setdefault(place, {**each, "loc": place})
    return list(found.values())


KIND: Final = re.compile(r"(?:bool|int|float|constrained-str|tuple\[.*\]|function-.*|str)")
"""How pydantic calls the kinds of a value that may be of several; no key is called so."""


def _to_document_error(
    document: Document,
    error: Any,  # noqa: ANN401 - pydantic's
    form: type[BaseModel],
    what: str,
    page: str,
) -> DocumentError:
    place = tuple(error["loc"])
    name = ".".join(map(str, place))
    line = document.line(place)
    match error["type"]:
        case "missing":
            return DocumentError(line, f"`{name}` is missing; {page} shows a whole example")
        case "extra_forbidden":
            known = _form_at(form, place[:-1]).model_fields
            return DocumentError(line, f"there is no `{name}` in a {what}; {near(str(place[-1]), known)}")
        case "string_pattern_mismatch":
            return DocumentError(
                line, f"`{name}` must begin with a letter and have lower-case letters, digits and hyphens between words"
            )
    message = error["msg"][:1].lower() + error["msg"][1:]
    return DocumentError(line, f"`{name}` does not fit: {message}, got {str(error['input'])[:40]!r}")


def _form_at(form: type[BaseModel], place: tuple[Any, ...]) -> type[BaseModel]:
    """Return the form of what stands at a place."""
    for part in place:
        field = form.model_fields.get(part) if isinstance(part, str) else None
        form = next(_forms_in(field.annotation), form) if field else form
    return form


def _forms_in(annotation: Any) -> Iterator[type[BaseModel]]:  # noqa: ANN401 - any annotation
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield annotation
    for part in get_args(annotation):
        yield from _forms_in(part)


def near(name: str, names: Iterable[str]) -> str:
    """Return what was probably meant, or all that there is, as the end of a sentence."""
    known = list(names)
    close = get_close_matches(name, known, n=1)
    return f"did you mean {close[0]}?" if close else f"there are {', '.join(known) or 'none'}"
