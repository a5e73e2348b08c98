"""The example with a kind of mark that the project does not know: a circle around the disc."""

from collections.abc import Mapping
from dataclasses import replace
from typing import ClassVar, Literal

import numpy as np
from pftrack_turning import EXPERIMENT as TURNING
from pftrack_turning import wire
from pydantic import Field

from pftrack.core.model.drawing import Primitive
from pftrack.core.model.marks import Box, Editor, Handle, Mark, MarkNumber
from pftrack.core.model.palette import COLOURS
from pftrack.core.model.parameters import ParameterError
from pftrack.core.model.setup import Setup
from pftrack.core.model.source import FrameSequence, Truth
from pftrack.experiments.shared.sketch import circle
from pftrack.experiments.video import Video


class Circle(Mark):
    """A circle by its centre and its radius, px."""

    title: ClassVar[str] = "Circle"
    instruction: ClassVar[str] = "Drag the centre onto the target, and set the radius so that the circle encloses it."

    kind: Literal["circle"] = "circle"
    centre: tuple[float, float]
    radius: float = Field(ge=2, le=200)

    def check(self, size: tuple[int, int]) -> None:
        if not all(0 <= place <= length - 1 for place, length in zip(self.centre, size, strict=True)):
            raise ParameterError("mark.centre", self.centre, f"within the picture of {size[0]} x {size[1]} px")

    def draw(self) -> Mapping[str, Primitive]:
        return {"circle": circle(np.array(self.centre), self.radius, COLOURS["estimate"], "mark")}

    @classmethod
    def editor(cls) -> Editor:
        named = {"name": "radius", "title": "Radius", "unit": "px", "about": "centre"}
        radius = MarkNumber(minimum=2, maximum=200, step=1, default=20, **named)
        return cls.describe(handles=(Handle(name="centre", title="Centre"),), numbers=(radius,))


def wire_circle(sequence: FrameSequence, mark: Circle, start: int, truth: Truth | None) -> Setup:
    (x, y), r = mark.centre, mark.radius
    return wire(sequence, Box.of(max(x - r, 0), max(y - r, 0), 2 * r + 1, 2 * r + 1), start, truth)


EXPERIMENT = replace(
    TURNING,
    id="circled",
    title="A turn in a circle",
    video=Video(wire_circle, marks=(Circle,), wanted="a circle around the target"),
)
