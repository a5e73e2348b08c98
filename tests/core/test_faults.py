"""What no viewer can show is told by the name of the primitive and the field, and left out of the drawing."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from pftrack.core.model.drawing import (
    COLOURS,
    Drawing,
    Ellipse,
    Mesh,
    Picture,
    Points,
    Polyline,
    Primitive,
    Text,
    World,
    WorldDrawing,
)
from pftrack.core.model.faults import faults, without_faults

PICTURE = Picture(np.zeros((6, 8, 3), np.uint8))
CLOUD = Points(np.zeros((5, 3), np.float32), np.zeros((5, 3), np.uint8), 2.0)
DISC = Ellipse(np.zeros(3, np.float32), np.eye(2, dtype=np.float32), COLOURS["truth"], 2.0, "truth")
SOLID = Mesh(np.zeros((3, 3), np.float32), np.zeros((1, 3), np.int32), COLOURS["truth"], 0.5, "estimate")
LABEL = Text(np.zeros(3, np.float32), "here", COLOURS["truth"], "truth")

BROKEN: dict[str, tuple[Primitive, str]] = {
    "a size that is no number": (replace(CLOUD, size=float("nan")), "size must be a finite number .*, got nan"),
    "a size that is a tuple": (replace(CLOUD, size=(2.0,)), r"size must be a finite number .*, got \(2.0,\)"),
    "a width of minus one": (replace(DISC, width=-1.0), "width must be a finite number that is not negative, got -1.0"),
    "an endless opacity": (replace(SOLID, opacity=np.inf), "opacity must be a finite number .*, got inf"),
    "faces of vertices that are not there": (
        replace(SOLID, faces=np.array([[0, 1, 3]], np.int32)),
        "faces must name vertices 0 to 2, got 0 to 3",
    ),
    "faces before the first vertex": (replace(SOLID, faces=np.array([[0, 1, -1]])), "got -1 to 1"),
    "faces of no vertices": (replace(SOLID, vertices=np.zeros((0, 3), np.float32)), "faces must name vertices"),
    "faces between vertices": (replace(SOLID, faces=np.zeros((1, 3))), "faces must hold whole numbers, got float64"),
    "a label that is a number": (replace(LABEL, text=7), "text must be a text, got 7"),
    "a title that is none": (replace(LABEL, title=None), "title must be a text, got None"),
    "a named point in the plane": (replace(LABEL, point=np.zeros(2, np.float32)), r"point must be an array \(3\), got"),
    "a text that is an array": (replace(LABEL, text=np.zeros(2)), r"text must be a text, got one of float64 \(2,\)"),
    "an anchor that is an array": (replace(LABEL, anchor=np.zeros(2)), "anchor must be start, .*, got one of float64"),
    "a width that is an array": (
        replace(DISC, width=np.ones(2)),
        "width must be a finite number .*, got one of float64",
    ),
    "a colour that is an array": (replace(DISC, colour=np.zeros(3)), "colour must be three numbers .*, got one of"),
    "a layer of a mesh that is an array": (replace(SOLID, layer=np.zeros(3)), "layer must be a text, got one of"),
    "an anchor in between": (replace(LABEL, anchor="left"), "anchor must be start, middle or end, got 'left'"),
    "a list of places": (replace(CLOUD, positions=[[0.0, 0.0, 0.0]]), r"positions must be an array \(n, 3\), got \[\["),
    "places in the plane": (
        replace(CLOUD, positions=np.zeros((5, 2), np.float32)),
        r"positions must be an array \(n, 3\), got one of float32 \(5, 2\)",
    ),
    "places of any kind": (
        replace(CLOUD, positions=np.zeros((5, 3), np.object_)),
        r"positions must be an array \(n, 3\), got one of object",
    ),
    "a colour of two": (replace(DISC, colour=(1, 2)), r"colour must be three numbers from 0 to 255, got \(1, 2\)"),
    "a colour that is none": (replace(LABEL, colour=(0, np.nan, 0)), "colour must be three numbers from 0 to 255"),
    "a colour that is too bright": (replace(LABEL, colour=(0, 256, 0)), "colour must be three numbers from 0 to 255"),
    "a picture of shares": (Picture(np.zeros((6, 8, 3))), r"image_rgb must be \(height, width, 3\) bytes"),
    "a picture without pixels": (Picture(np.zeros((0, 8, 3), np.uint8)), "image_rgb must be"),
}


def drawn(item: Primitive) -> Drawing:
    return Drawing(8, 6, {"picture": PICTURE, "cloud": CLOUD, "this": item}, "frame 7")


@pytest.mark.parametrize("name", BROKEN)
def test_each_fault_is_told(name: str) -> None:
    """The primitive is named, and the field with what it should hold and what it does; the others are sound."""
    item, clause = BROKEN[name]
    found = faults(drawn(item))
    assert list(found) == ["this"]
    with pytest.raises(ValueError, match=clause):
        raise ValueError(found["this"])


def test_what_has_a_fault_is_left_out() -> None:
    """The rest stays what it is, and the caption says what is missing and why."""
    whole = drawn(replace(CLOUD, size=float("nan")))
    shown = without_faults(whole)
    assert shown.primitives == {"picture": PICTURE, "cloud": CLOUD}
    assert shown.caption.startswith("Left out of the drawing: this: size must be")
    assert (shown.width, shown.height) == (8, 6)
    sound = drawn(DISC)
    assert without_faults(sound) is sound


def test_a_world_is_looked_through_as_well() -> None:
    """Its primitives are named with it, and those with a fault are left out of it."""
    world = World("model", "Model", "mm", 10.0)
    both: dict[str, Primitive] = {"good": CLOUD, "bad": replace(CLOUD, size=float("inf"))}
    drawing = replace(drawn(DISC), worlds=(WorldDrawing(world, both),))
    assert list(faults(drawing)) == ["model/bad"]
    shown = without_faults(drawing)
    assert list(shown.worlds[0].primitives) == ["good"]
    assert list(shown.primitives) == ["picture", "cloud", "this"]


@pytest.mark.parametrize(
    "item",
    [
        replace(CLOUD, size=np.float32(2)),
        replace(DISC, colour=tuple(np.array([1, 2, 3], np.uint8))),
        replace(SOLID, opacity=np.ones(3, np.float32)),
        Polyline(np.full((4, 3), np.nan, np.float32), COLOURS["truth"], 0, "trail"),
        Polyline(np.zeros((0, 3)), COLOURS["truth"], 1, "trail"),
    ],
    ids=["numpy's number", "numpy's colour", "opacity of vertices", "gaps", "nothing"],
)
def test_what_can_be_shown_is_no_fault(item: Any) -> None:
    """NumPy's numbers are numbers, a place that is none is a gap, and an empty array is nothing to see."""
    assert faults(drawn(item)) == {}
