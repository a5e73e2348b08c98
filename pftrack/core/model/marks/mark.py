"""What every kind of mark answers, and the description from which an editor is made."""

import json
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, ClassVar, Self

from pydantic import BaseModel, ConfigDict, ValidationError

from pftrack.core.model.drawing import Primitive
from pftrack.core.model.frame import Target
from pftrack.core.model.parameters import ParameterError

__all__ = ["LARGEST_FILE_BYTES", "Editor", "Handle", "Mark", "MarkNumber", "read_mark", "text_of"]

LARGEST_FILE_BYTES = 1024 * 1024
LARGEST_PX = 100_000


class Handle(BaseModel):
    """A point of a mark that a person can drag.

    Attributes:
        name: Where its [x, y] stands in the mark's JSON; the parts of a path are joined by dots.
        title: What people call it.
        at: Where it is at first, as shares of the picture's width and height.
    """

    model_config = ConfigDict(frozen=True)

    name: str
    title: str
    at: tuple[float, float] = (0.5, 0.5)


class MarkNumber(BaseModel):
    """A number of a mark that a person can change.

    Attributes:
        name: Where it stands in the mark's JSON; the parts of a path are joined by dots.
        title: What people call it.
        unit: As printed beside the value; empty for a pure number.
        minimum: Smallest value allowed.
        maximum: Largest value allowed.
        step: Of a slider.
        default: What it is at first.
        about: Name of the handle about which it is a radius, if it is one; it is drawn as a circle.
    """

    model_config = ConfigDict(frozen=True)

    name: str
    title: str
    unit: str = ""
    minimum: float
    maximum: float
    step: float
    default: float
    about: str | None = None


class Editor(BaseModel):
    """All that an editor of one kind of mark has to know.

    Attributes:
        kind: The kind's name.
        title: What people call it, in sentence case.
        instruction: How to make such a mark, a sentence or two.
        text: How it is written on the command line.
        handles: What can be dragged.
        links: Pairs of handles that a line joins.
        closed: Whether a further line joins the last handle to the first, so that the handles outline an area.
        numbers: What can be typed, or set by a slider.
    """

    model_config = ConfigDict(frozen=True)

    kind: str
    title: str
    instruction: str
    text: str
    handles: tuple[Handle, ...] = ()
    links: tuple[tuple[str, str], ...] = ()
    closed: bool = False
    numbers: tuple[MarkNumber, ...] = ()


class Mark(BaseModel, ABC):
    """Base of all kinds: immutable, closed to unknown names, finite numbers only.

    A kind declares its name as a field, `kind: Literal["box"] = "box"`, and the two texts below. Positions are in px of
    the picture, as in drawings.

    Attributes:
        title: What people call the kind, in sentence case.
        instruction: How to make such a mark, a sentence or two.
        text: How it is written on the command line after the kind's name and a colon.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    title: ClassVar[str]
    instruction: ClassVar[str]
    text: ClassVar[str] = "FILE or JSON"

    kind: str

    @classmethod
    def name(cls) -> str:
        """Return the kind's name."""
        return str(cls.model_fields["kind"].default)

    @classmethod
    def parse(cls, text: str) -> Self:
        """Read a mark from text, as the command line gives it: JSON, or the name of a file that holds JSON.

        Raises:
            ValueError: It is no mark of this kind.
        """
        try:
            raw = json.loads(text if text.lstrip().startswith("{") else text_of(Path(text)))
        except json.JSONDecodeError:
            raise ValueError(f"expected a JSON object or a file that holds one, got {text[:40]!r}") from None
        return cls.read(raw)

    @classmethod
    def read(cls, raw: object) -> Self:
        """Read a mark from JSON values; its kind may be left out.

        Raises:
            ParameterError: They are no mark of this kind; it names the field.
        """
        try:
            return cls.model_validate(raw)
        except ValidationError as error:
            first = error.errors()[0]
            cause = first.get("ctx", {}).get("error")
            if isinstance(cause, ParameterError):
                raise cause from None
            place = ".".join(str(part) for part in ("mark", *first["loc"]))
            message = first["msg"].removeprefix("Value error, ").removeprefix("Input should be ")
            raise ParameterError(place, first["input"], f"as a mark of kind {cls.name()} has it: {message}") from None

    @classmethod
    def of_target(cls, target: Target) -> Self | None:
        """Return the mark of a target that is known, as a person would make it; None where the kind cannot tell.

        The check of experiments marks the simulated scene's own target by it, in a recording of that scene.
        """
        del target
        return None

    @abstractmethod
    def check(self, size: tuple[int, int]) -> None:
        """Refuse a mark that does not fit a picture of this width and height, px.

        Raises:
            ParameterError: It does not; it names the field and both sizes.
        """

    @abstractmethod
    def draw(self) -> Mapping[str, Primitive]:
        """Return the mark as primitives by name, in the layer "mark"."""

    @classmethod
    @abstractmethod
    def editor(cls) -> Editor:
        """Return all that an editor of this kind has to know; `describe` has the part common to all kinds."""

    @classmethod
    def describe(cls, **more: Any) -> Editor:  # noqa: ANN401 - the fields of an editor
        """Return an editor's description with the kind's own name and texts."""
        return Editor(kind=cls.name(), title=cls.title, instruction=cls.instruction, text=cls.text, **more)


def read_mark(kinds: Sequence[type[Mark]], raw: object) -> Mark:
    """Read a mark of any of several kinds from JSON values that name the kind.

    Raises:
        ParameterError: They name no such kind, or are no mark of it.
    """
    known = {kind.name(): kind for kind in kinds}
    name = raw.get("kind") if isinstance(raw, Mapping) else None
    if not isinstance(name, str) or name not in known:
        raise ParameterError("mark.kind", name, f"one of {', '.join(known) or 'none'}")
    return known[name].read(raw)


def text_of(path: Path) -> str:
    """Return the text of a file that describes a mark.

    Raises:
        ValueError: It is missing, too large, or no text.
    """
    try:
        if path.stat().st_size > LARGEST_FILE_BYTES:
            raise ValueError(f"{path.name} is larger than the {LARGEST_FILE_BYTES // 1024} KiB allowed")
        return path.read_text(encoding="utf-8-sig")
    except FileNotFoundError:
        raise ValueError(f"there is no file {path}") from None
    except OSError as error:
        raise ValueError(f"{path} cannot be read: {error.strerror}") from None
    except UnicodeDecodeError:
        raise ValueError(f"{path.name} is no text") from None
