"""A kind of mark: a circle around the target."""

from collections.abc import Mapping
from typing import ClassVar, Literal

import numpy as np
from pydantic import Field

from pftrack.core.model.drawing import Ellipse, Primitive
from pftrack.core.model.marks import Editor, Handle, Mark, MarkNumber
from pftrack.core.model.palette import COLOURS
from pftrack.core.model.parameters import ParameterError


class Circle(Mark):
    """A circle by its centre and its radius, px."""

    title: ClassVar[str] = "Circle"
    instruction: ClassVar[str] = "Drag the centre onto the target, and set the radius so that the circle encloses it."

    kind: Literal["circle"] = "circle"
    centre: tuple[float, float]
    radius: float = Field(ge=2, le=200)

    def check(self, size: tuple[int, int]) -> None:
        """Refuse a circle whose centre is not in the picture."""
        if not all(0 <= place <= length - 1 for place, length in zip(self.centre, size, strict=True)):
            raise ParameterError("mark.centre", self.centre, f"within the picture of {size[0]} x {size[1]} px")

    def draw(self) -> Mapping[str, Primitive]:
        """Return the circle."""
        centre, half_axes = np.array([*self.centre, 1], np.float32), self.radius * np.eye(2, dtype=np.float32)
        return {"circle": Ellipse(centre, half_axes, COLOURS["estimate"], 2.0, "mark")}

    @classmethod
    def editor(cls) -> Editor:
        """Return a handle for the centre, and the radius about it."""
        named = {"name": "radius", "title": "Radius", "unit": "px", "about": "centre"}
        radius = MarkNumber(minimum=2, maximum=200, step=1, default=20, **named)
        return cls.describe(handles=(Handle(name="centre", title="Centre"),), numbers=(radius,))
