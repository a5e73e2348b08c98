"""The example with a kind of mark that the project does not know: a circle around the disc."""

from collections.abc import Mapping
from dataclasses import replace
from typing import ClassVar, Literal

from pftrack_turning import EXPERIMENT as TURNING
from pftrack_turning import wire

from pftrack.core.model.drawing import Primitive
from pftrack.core.model.marks import Box, Editor, Handle, Mark, MarkNumber
from pftrack.experiments.experiment import Video


class Circle(Mark):
    """A circle by its centre and its radius, px."""

    title: ClassVar[str] = "Circle"
    instruction: ClassVar[str] = "Drag the centre onto the target, and set the radius so that the circle encloses it."
    kind: Literal["circle"] = "circle"
    centre: tuple[float, float]
    radius: float

    @property
    def box(self) -> Box:
        (x, y), r = self.centre, self.radius
        return Box.of(x - r, y - r, 2 * r + 1, 2 * r + 1)

    def check(self, size: tuple[int, int]) -> None:
        self.box.check(size)

    def draw(self) -> Mapping[str, Primitive]:
        return self.box.draw()

    @classmethod
    def editor(cls) -> Editor:
        named = {"name": "radius", "title": "Radius", "about": "centre"}
        radius = MarkNumber(minimum=2, maximum=50, step=1, default=20, **named)
        return cls.describe(handles=(Handle(name="centre", title="Centre"),), numbers=(radius,))


VIDEO = Video(lambda sequence, mark, *more: wire(sequence, mark.box, *more), marks=(Circle,), wanted="a circle")
DISPLAY = replace(TURNING.display, thumbnail=None)
EXPERIMENT = replace(TURNING, id="circled", title="A turn in a circle", video=VIDEO, display=DISPLAY)
