"""A long body: the axis from its head to the root of its tail, the tip of the tail, and how wide it is.

It suits what is longer than wide and has a front and a back: a fish, a mouse, a worm from above.
"""

import math
from collections.abc import Mapping
from typing import Annotated, ClassVar, Literal, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from pftrack.core.model.drawing import COLOURS, Ellipse, Polyline, Primitive
from pftrack.core.model.marks.mark import LARGEST_PX, Editor, Handle, Mark, MarkNumber
from pftrack.core.model.parameters import NOT_BOOLEAN, ParameterError

__all__ = ["LongBody"]

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
    def centre(self) -> NDArray[np.float64]:
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
        parts = text.split(",")
        try:
            numbers = [float(part) for part in parts]
        except ValueError:
            numbers = []
        if len(numbers) != 7 or not all(map(math.isfinite, numbers)):
            raise ValueError(f"expected 7 finite numbers ({cls.text}), got {text[:60]!r}")
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
