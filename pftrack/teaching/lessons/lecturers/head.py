"""Heads: what a lecturer writes above the text, before it is known whether it fits an experiment."""

import re
from collections.abc import Iterable, Iterator
from difflib import get_close_matches
from typing import Annotated, Any, Final, Literal, TypeVar, get_args

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from pftrack.teaching.lessons.lecturers.document import Document, DocumentError, Place

__all__ = ["Head", "Line", "Name", "Part", "QuestionHead", "Scalar", "Words", "ask", "errors_of", "near"]

M = TypeVar("M", bound=BaseModel)

LONGEST_RUN: Final = 2000
"""Frames: a class does not wait longer, and whoever opens the lesson computes its run."""

Line = Annotated[str, Field(min_length=1, max_length=120)]
Words = Annotated[str, Field(min_length=1, max_length=600)]
Name = Annotated[str, Field(min_length=1, max_length=64)]
Scalar = bool | int | float | Annotated[str, Field(max_length=200)]


class Part(BaseModel):
    """A part of a head; it has nothing but what is declared."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


class ChangeHead(Part):
    """Values that take effect in a frame."""

    frame: Annotated[int, Field(ge=0, le=LONGEST_RUN)] = 0
    values: Annotated[dict[Name, Scalar], Field(min_length=1, max_length=100)]


class MistakeHead(Part):
    """A usual wrong answer: a number, [lowest, highest], or the name of a choice."""

    given: float | tuple[float, float] | Name
    words: Words


class QuestionHead(Part):
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


class Head(Part):
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


def ask(document: Document, model: type[M], kind: str, page: str) -> M | list[DocumentError]:
    """Return the head of a document, or all that is wrong with its form.

    Args:
        document: The file.
        model: What its head may hold.
        kind: What the file is, "a lesson".
        page: Of the documentation, with a whole example.
    """
    try:
        return model.model_validate(document.head)
    except ValidationError as error:
        return [_to_document_error(document, each, model, kind, page) for each in errors_of(error)]


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
    model: type[BaseModel],
    kind: str,
    page: str,
) -> DocumentError:
    place = tuple(error["loc"])
    name = ".".join(map(str, place))
    line = document.line(place)
    match error["type"]:
        case "missing":
            return DocumentError(line, f"`{name}` is missing; {page} shows a whole example")
        case "extra_forbidden":
            known = _part_at(model, place[:-1]).model_fields
            return DocumentError(line, f"there is no `{name}` in {kind}; {near(str(place[-1]), known)}")
        case "string_pattern_mismatch":
            return DocumentError(
                line, f"`{name}` must begin with a letter and have lower-case letters, digits and hyphens between words"
            )
    message = error["msg"][:1].lower() + error["msg"][1:]
    return DocumentError(line, f"`{name}` does not fit: {message}, got {str(error['input'])[:40]!r}")


def _part_at(model: type[BaseModel], place: Place) -> type[BaseModel]:
    """Return the model of a part of a head."""
    for key in place:
        if isinstance(key, str) and key in model.model_fields:
            model = next(_models_in(model.model_fields[key].annotation), model)
    return model


def _models_in(annotation: Any) -> Iterator[type[BaseModel]]:  # noqa: ANN401 - of any kind
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield annotation
    for inner in get_args(annotation):
        yield from _models_in(inner)


def near(name: str, names: Iterable[str]) -> str:
    """Return what was probably meant, or all that there is, as the end of a sentence."""
    known = list(names)
    close = get_close_matches(name, known, n=1)
    return f"did you mean {close[0]}?" if close else f"there are {', '.join(known) or 'none'}"
