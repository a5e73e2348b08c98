"""Marks: a user's or a detector's statement on a target in one picture of a recording.

A mark is a small frozen value with a `kind`. A kind reads itself from text and JSON, checks whether it fits a picture,
draws itself, and describes itself to an editor: its handles, the lines between them, and its numbers. Command line,
REST interface, saved runs and the page's editors use this interface without depending on any kind; an experiment
declares its kinds, so other packages can add their own. The kinds here are a long body with a front and a back, a box
of whole pixels, and named points.
"""

import csv
import io
import json
import math
from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal, Self

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from pftrack.core.arrays import Floats
from pftrack.core.files import read_text
from pftrack.core.model.drawing import COLOURS, Ellipse, Links, Points, Polyline, Primitive
from pftrack.core.model.parameters import NOT_BOOLEAN
from pftrack.core.model.source import Target
from pftrack.core.refusal import ParameterError, first_problem

LARGEST_FILE_BYTES = 1024 * 1024
LARGEST_PX = 100_000


class Handle(BaseModel):
    """A point of a mark that a person can drag.

    Attributes:
        name: Path of its [x, y] in the mark's JSON, joined by dots.
        title: What people call it.
        at: Its first place, as shares of the picture's width and height.
    """

    model_config = ConfigDict(frozen=True)

    name: str
    title: str
    at: tuple[float, float] = (0.5, 0.5)


class MarkNumber(BaseModel):
    """A number of a mark that a person can change.

    Attributes:
        name: Its path in the mark's JSON, joined by dots.
        title: What people call it.
        unit: As printed beside the value; empty for a pure number.
        minimum: Smallest value allowed.
        maximum: Largest value allowed.
        step: Step of a slider.
        default: First value.
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
    """Description of one kind of mark for editors.

    Attributes:
        kind: The kind's name.
        title: Its title, in sentence case.
        instruction: How to make such a mark, a sentence or two.
        text: Its form on the command line.
        handles: Handles that can be dragged.
        links: Pairs of handles that a line joins.
        closed: Whether a further line joins the last handle to the first, so the handles outline an area.
        numbers: Values that can be typed, or set by a slider.
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
        title: Title of the kind, in sentence case.
        instruction: How to make such a mark, a sentence or two.
        text: Its form on the command line after the kind's name and a colon.
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
            ValueError: It is not a mark of this kind.
        """
        try:
            raw = json.loads(text if text.lstrip().startswith("{") else read_text(Path(text), LARGEST_FILE_BYTES))
        except json.JSONDecodeError:
            raise ValueError(f"expected a JSON object or a file that holds one, got {text[:40]!r}") from None
        return cls.read(raw)

    @classmethod
    def read(cls, raw: object) -> Self:
        """Read a mark from JSON values; its kind may be left out.

        Raises:
            ParameterError: They are not a mark of this kind; it names the field.
        """
        try:
            return cls.model_validate(raw)
        except ValidationError as error:
            first = first_problem(error.errors())
            place = ".".join(str(part) for part in ("mark", *first["loc"]))
            message = first["msg"].removeprefix("Value error, ").removeprefix("Input should be ")
            raise ParameterError(place, first["input"], f"as a mark of kind {cls.name()} has it: {message}") from None

    @classmethod
    def of_target(cls, target: Target) -> Self | None:
        """Return the mark of a target that is known, as a person would make it; None if the kind cannot derive it.

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
        """Return the description of this kind for editors; `describe` has the part common to all kinds."""

    @classmethod
    def describe(cls, **more: Any) -> Editor:  # noqa: ANN401 - the fields of an editor
        """Return an editor's description with the kind's own name and texts."""
        return Editor(kind=cls.name(), title=cls.title, instruction=cls.instruction, text=cls.text, **more)


def read_mark(kinds: Sequence[type[Mark]], raw: object) -> Mark:
    """Read a mark of any of several kinds from JSON values that name the kind.

    Raises:
        ParameterError: The kind is unknown, or they are not a mark of it.
    """
    known = {kind.name(): kind for kind in kinds}
    name = raw.get("kind") if isinstance(raw, Mapping) else None
    if not isinstance(name, str) or name not in known:
        raise ParameterError("mark.kind", name, f"one of {', '.join(known) or 'none'}")
    return known[name].read(raw)


def _numbers(text: str, count: int, form: str) -> list[float]:
    """Return the finite numbers of a mark that is written as so many, separated by commas."""
    try:
        numbers = [float(part) for part in text.split(",")]
    except ValueError:
        numbers = []
    if len(numbers) != count or not all(map(math.isfinite, numbers)):
        raise ValueError(f"expected {count} finite numbers ({form}), got {text[:60]!r}")
    return numbers


Coordinate = Annotated[float, Field(ge=-LARGEST_PX, le=LARGEST_PX), NOT_BOOLEAN]
Point = tuple[Coordinate, Coordinate]

SHORTEST_PX = 4.0
"""From head to root."""


class LongBody(Mark):
    """A body with an axis and a tail.

    Attributes:
        head: Front end of the body, (x, y) px.
        root: Rear end of the body, where the tail begins.
        tip: End of the tail; on the root for a body without one.
        half_width: Half of the body across, px.
    """

    title: ClassVar[str] = "Long body"
    instruction: ClassVar[str] = (
        "Drag the head to the front end of the body, the root to where the tail begins, and the tip to the end of the "
        "tail; then set half the width of the body."
    )
    text: ClassVar[str] = "head x,y,root x,y,tip x,y,half width"

    kind: Literal["body"] = "body"
    head: Point
    root: Point
    tip: Point
    half_width: Annotated[float, Field(ge=1, le=1000), NOT_BOOLEAN]

    @property
    def centre(self) -> Floats:
        """(2,) middle between head and root, px."""
        return np.array([0.5 * (self.head[axis] + self.root[axis]) for axis in range(2)])

    @property
    def half_length(self) -> float:
        """Half of the body along its axis, px."""
        return 0.5 * math.dist(self.head, self.root)

    @property
    def tail_length(self) -> float:
        """From the root to the tip of the tail, px."""
        return math.dist(self.root, self.tip)

    @property
    def heading(self) -> float:
        """Direction to the head, rad."""
        return math.atan2(self.head[1] - self.root[1], self.head[0] - self.root[0])

    @property
    def bend(self) -> float:
        """Direction of the tail relative to the axis, rad within half a turn; 0 is straight, and of no tail."""
        if self.tail_length < 1.0:
            return 0.0
        tail = math.atan2(self.root[1] - self.tip[1], self.root[0] - self.tip[0])
        return math.remainder(tail - self.heading, 2.0 * math.pi)

    @classmethod
    def parse(cls, text: str) -> Self:
        """Read a body from seven numbers.

        Raises:
            ValueError: There are not seven finite numbers, or they are no body.
        """
        numbers = _numbers(text, 7, cls.text)
        points = [numbers[0:2], numbers[2:4], numbers[4:6]]
        return cls.read(dict(zip(("head", "root", "tip"), points, strict=True)) | {"half_width": numbers[6]})

    def check(self, size: tuple[int, int]) -> None:
        """Refuse a body that is not in the picture, has no length, or folds its tail back."""
        width, height = size
        for name in ("head", "root", "tip"):
            x, y = getattr(self, name)
            if not (0 <= x <= width - 1 and 0 <= y <= height - 1):
                raise ParameterError(f"mark.{name}", [x, y], f"within the picture of {width} x {height} px")
        length = 2.0 * self.half_length
        if length < SHORTEST_PX:
            raise ParameterError("mark.root", list(self.root), f"at least {SHORTEST_PX:g} px from the head")
        if self.half_width > length:
            raise ParameterError("mark.half_width", self.half_width, f"at most the {length:.0f} px from head to root")
        if abs(self.bend) > 0.5 * math.pi:
            raise ParameterError("mark.tip", list(self.tip), "behind the body: the tail bends by at most 90 degrees")

    def draw(self) -> Mapping[str, Primitive]:
        """Return the ellipse of the body, and its axis with the tail."""
        ahead = self.half_length * np.array([math.cos(self.heading), math.sin(self.heading)])
        across = self.half_width * np.array([-math.sin(self.heading), math.cos(self.heading)])
        centre = np.append(self.centre, 1.0).astype(np.float32)
        axis = np.array([(*point, 1.0) for point in (self.head, self.root, self.tip)], np.float32)
        axes = np.stack([ahead, across]).astype(np.float32)
        return {
            "body": Ellipse(centre, axes, COLOURS["estimate"], 2.0, "mark"),
            "axis": Polyline(axis, COLOURS["estimate"], 2.0, "mark"),
        }

    @classmethod
    def editor(cls) -> Editor:
        """Return its three points, joined from head to tip, and the width about the root."""
        handles = (
            Handle(name="head", title="Head", at=(0.6, 0.5)),
            Handle(name="root", title="Root of the tail", at=(0.45, 0.5)),
            Handle(name="tip", title="Tip of the tail", at=(0.35, 0.5)),
        )
        half_width = MarkNumber(
            name="half_width", title="Half width", unit="px", minimum=1, maximum=200, step=0.5, default=10, about="root"
        )
        return cls.describe(handles=handles, links=(("head", "root"), ("root", "tip")), numbers=(half_width,))


Length = Annotated[float, Field(le=LARGEST_PX), NOT_BOOLEAN]


class Box(Mark):
    """A rectangle around a target.

    Attributes:
        x: Left edge, px.
        y: Upper edge, px.
        width: In px.
        height: In px.
    """

    title: ClassVar[str] = "Box"
    instruction: ClassVar[str] = "Draw a box around the target."
    text: ClassVar[str] = "x,y,w,h"

    kind: Literal["box"] = "box"
    x: Length
    y: Length
    width: Length
    height: Length

    @property
    def corner_and_size(self) -> tuple[float, float, float, float]:
        """Its x, y, width and height, px."""
        return self.x, self.y, self.width, self.height

    @classmethod
    def of(cls, x: float, y: float, width: float, height: float) -> Self:
        """Return the box of these numbers, px."""
        return cls(x=x, y=y, width=width, height=height)

    @classmethod
    def parse(cls, text: str) -> Self:
        """Read a box from four numbers, `x,y,w,h`.

        Raises:
            ValueError: There are not four finite numbers, or the box has no area.
        """
        x, y, w, h = _numbers(text, 4, cls.text)
        return cls.read({"x": x, "y": y, "width": w, "height": h})

    @classmethod
    def of_target(cls, target: Target) -> Self | None:
        """Return the box of whole pixels around the target's landmarks, or a square of its size around its position."""
        if target.landmarks is not None:
            low, high = target.landmarks.points_px.min(axis=0), target.landmarks.points_px.max(axis=0)
        elif len(target.position) == 2 and target.size > 0:
            reach = (target.size - 1.0) / 2.0
            low, high = target.position - reach, target.position + reach
        else:
            return None
        (x, y), (right, bottom) = np.floor(low), np.ceil(high)
        return cls.of(float(x), float(y), float(right - x + 1.0), float(bottom - y + 1.0))

    def check(self, size: tuple[int, int]) -> None:
        """Refuse a box that has no area or reaches beyond the picture."""
        width, height = size
        inside = self.x >= 0 and self.y >= 0 and self.x + self.width <= width and self.y + self.height <= height
        if not (inside and self.width >= 1 and self.height >= 1):
            shown = f"x = {self.x:g}, y = {self.y:g}, width = {self.width:g}, height = {self.height:g}"
            raise ParameterError("mark", shown, f"a box of at least 1 px within the picture of {width} x {height} px")

    def draw(self) -> Mapping[str, Primitive]:
        """Return its outline, around the pixels that belong to it."""
        left, top = self.x - 0.5, self.y - 0.5
        right, bottom = left + self.width, top + self.height
        corners = [(left, top, 1), (right, top, 1), (right, bottom, 1), (left, bottom, 1), (left, top, 1)]
        return {"box": Polyline(np.array(corners, np.float32), COLOURS["estimate"], 2.0, "mark")}

    @classmethod
    def editor(cls) -> Editor:
        """Return its four numbers."""
        named = {"x": ("Left edge", 0), "y": ("Upper edge", 0), "width": ("Width", 40), "height": ("Height", 40)}
        numbers = [
            MarkNumber(name=name, title=title, unit="px", minimum=0, maximum=LARGEST_PX, step=1, default=default)
            for name, (title, default) in named.items()
        ]
        return cls.describe(numbers=tuple(numbers))


class FeaturePoints(Mark):
    """Named points; an experiment's own subclass declares them.

    A file of them is JSON, `{"nose": [203.5, 148], ...}` or a list of `{"name": "nose", "x": 203.5, "y": 148}`, or
    comma-separated text with the columns `name, x, y`; positions are in px of the picture.

    Attributes:
        features: Titles of the points, by name.
        joined: Pairs of points between which a line helps the eye.
        offered: First places of points to drag, by name, as shares of the picture's width and height.
        points: Position (x, y) in px by name; those left out are to be placed by a model.
    """

    title: ClassVar[str] = "Points"
    instruction: ClassVar[str] = "Drag each point to where it belongs."
    text: ClassVar[str] = "FILE, JSON or CSV with name,x,y"
    features: ClassVar[Mapping[str, str]]
    joined: ClassVar[tuple[tuple[str, str], ...]] = ()
    offered: ClassVar[Mapping[str, tuple[float, float]]] = {}

    kind: Literal["points"] = "points"
    points: Annotated[dict[str, tuple[Coordinate, Coordinate]], Field(min_length=1, max_length=100)]

    @classmethod
    def parse(cls, text: str) -> Self:
        """Read points from a file.

        Raises:
            ValueError: The file is missing, is neither JSON nor such a table, or lists a point twice.
            ParameterError: A point is unknown or not at two finite numbers.
        """
        path = Path(text)
        content = read_text(path, LARGEST_FILE_BYTES)
        try:
            rows = list(_from_json(content) if path.suffix.lower() == ".json" else _from_table(content))
        except (csv.Error, ValueError, TypeError, KeyError, AttributeError, IndexError):
            raise ValueError(
                f"{path.name} does not list points: expected JSON as {{name: [x, y]}} or a table with the columns "
                "name, x, y"
            ) from None
        for place, (name, _) in enumerate(rows):
            if name in {other for other, _ in rows[:place]}:
                raise ValueError(f"{path.name}: {name} is listed twice")
        if not rows:
            raise ValueError(f"{path.name} lists no points")
        return cls.read({"points": dict(rows)})

    @classmethod
    def of_target(cls, target: Target) -> Self | None:
        """Return the target's landmarks of the names that there are."""
        if target.landmarks is None:
            return None
        places = zip(target.landmarks.names, target.landmarks.points_px.tolist(), strict=True)
        named = {name: place for name, place in places if name in cls.features}
        return cls.read({"points": named}) if named else None

    def check(self, size: tuple[int, int]) -> None:
        """Refuse a point that is none of the target's or lies outside the picture."""
        width, height = size
        for name, (x, y) in self.points.items():
            if name not in self.features:
                raise ParameterError(f"mark.points.{name}", name, f"one of {', '.join(self.features)}")
            if not (-0.5 <= x < width - 0.5 and -0.5 <= y < height - 0.5):
                bound = f"(x, y) within the picture of {width} x {height} px"
                raise ParameterError(f"mark.points.{name}", (x, y), bound)

    def draw(self) -> Mapping[str, Primitive]:
        """Return the points, and the lines between them."""
        placed = {name: (x, y, 1.0) for name, (x, y) in self.points.items()}
        positions = np.array(list(placed.values()), np.float32)
        colours = np.tile(np.array(COLOURS["estimate"], np.uint8), (len(positions), 1))
        drawn: dict[str, Primitive] = {"points": Points(positions, colours, 3.0, "mark")}
        lines = [(placed[a], placed[b]) for a, b in self.joined if a in placed and b in placed]
        if lines:
            drawn["links"] = Links(np.array(lines, np.float32), COLOURS["estimate"], 1.0, "mark")
        return drawn

    @classmethod
    def editor(cls) -> Editor:
        """Return one handle a point."""
        centre = (0.5, 0.5)
        handles = (
            Handle(name=f"points.{name}", title=title, at=cls.offered.get(name, centre))
            for name, title in cls.features.items()
        )
        return cls.describe(handles=tuple(handles), links=tuple((f"points.{a}", f"points.{b}") for a, b in cls.joined))


Row = tuple[str, tuple[float, float]]


def _from_json(text: str) -> Iterable[Row]:
    content = json.loads(text)
    if isinstance(content, list):
        return [(str(item["name"]), (float(item["x"]), float(item["y"]))) for item in content]
    return [(str(name), (float(place[0]), float(place[1]))) for name, place in content.items()]


def _from_table(text: str) -> Iterable[Row]:
    rows = csv.DictReader(io.StringIO(text), skipinitialspace=True)
    return [(row["name"].strip(), (float(row["x"]), float(row["y"]))) for row in rows]
