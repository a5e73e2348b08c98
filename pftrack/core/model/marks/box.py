"""A box: the rectangle of whole pixels around a target."""

import math
from collections.abc import Mapping
from typing import Annotated, ClassVar, Literal, Self

import numpy as np
from pydantic import Field

from pftrack.core.model.drawing import COLOURS, Polyline, Primitive
from pftrack.core.model.frame import Target
from pftrack.core.model.marks.mark import LARGEST_PX, Editor, Mark, MarkNumber
from pftrack.core.model.parameters import NOT_BOOLEAN, ParameterError

__all__ = ["Box"]

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
        parts = text.split(",")
        if len(parts) != 4:
            raise ValueError(f"expected 4 numbers (x,y,w,h), got {len(parts)}: {text!r}")
        try:
            x, y, w, h = (float(part) for part in parts)
        except ValueError:
            raise ValueError(f"expected 4 numbers (x,y,w,h), got {text!r}") from None
        if not all(math.isfinite(value) for value in (x, y, w, h)):
            raise ValueError(f"expected 4 finite numbers (x,y,w,h), got {text!r}")
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
