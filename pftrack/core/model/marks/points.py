"""Named points of a target, as a person has marked or a finder has found them."""

import csv
import io
import json
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Annotated, ClassVar, Literal, Self

import numpy as np
from pydantic import Field

from pftrack.core.model.drawing import COLOURS, Links, Points, Primitive
from pftrack.core.model.frame import Target
from pftrack.core.model.marks.mark import LARGEST_PX, Editor, Handle, Mark, text_of
from pftrack.core.model.parameters import NOT_BOOLEAN, ParameterError

__all__ = ["FeaturePoints"]

Coordinate = Annotated[float, Field(ge=-LARGEST_PX, le=LARGEST_PX), NOT_BOOLEAN]


class FeaturePoints(Mark):
    """Named points; an experiment's own subclass says which there are.

    A file of them is JSON, `{"nose": [203.5, 148], ...}` or a list of `{"name": "nose", "x": 203.5, "y": 148}`, or
    comma-separated text with the columns `name, x, y`; positions are in px of the picture.

    Attributes:
        features: What people call the points, by name.
        joined: Pairs of points between which a line helps the eye.
        offered: Where points stand that a person is to drag, by name, as shares of the picture's width and height.
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
        content = text_of(path)
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
