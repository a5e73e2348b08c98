"""What is drawn: layers, legend, palette and worlds, and faults that no viewer can show."""

import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib import colormaps

from pftrack.core.model import drawing
from pftrack.core.model.drawing import (
    COLOURS,
    Drawing,
    Key,
    Layer,
    Picture,
    Points,
    Polyline,
    Primitive,
    World,
    drawn_keys,
)
from pftrack.core.model.faults import faults, without_faults
from pftrack.core.texts import read_whole

PICTURE = Picture(np.zeros((6, 8, 3), np.uint8))
CLOUD = Points(np.zeros((5, 3), np.float32), np.zeros((5, 3), np.uint8), 2.0)
DISC = drawing.Ellipse(np.zeros(3, np.float32), np.eye(2, dtype=np.float32), COLOURS["truth"], 2.0, "truth")
SOLID = drawing.Mesh(np.zeros((3, 3), np.float32), np.zeros((1, 3), np.int32), COLOURS["truth"], 0.5, "estimate")
LABEL = drawing.Text(np.zeros(3, np.float32), "here", COLOURS["truth"], "truth")


def drawn(item: Primitive) -> Drawing:
    return Drawing(8, 6, {"picture": PICTURE, "cloud": CLOUD, "this": item}, "frame 7")


@pytest.mark.parametrize(
    ("item", "clause"),
    [
        (replace(CLOUD, size=float("nan")), "size must be a finite number .*, got nan"),
        (replace(CLOUD, size=(2.0,)), r"size must be a finite number .*, got \(2.0,\)"),
        (replace(DISC, width=-1.0), "width must be a finite number that is not negative, got -1.0"),
        (replace(SOLID, opacity=np.inf), "opacity must be a finite number .*, got inf"),
        (replace(SOLID, faces=np.array([[0, 1, 3]], np.int32)), "faces must name vertices 0 to 2, got 0 to 3"),
        (replace(SOLID, faces=np.array([[0, 1, -1]])), "got -1 to 1"),
        (replace(SOLID, vertices=np.zeros((0, 3), np.float32)), "faces must name vertices"),
        (replace(SOLID, faces=np.zeros((1, 3))), "faces must hold whole numbers, got float64"),
        (replace(LABEL, text=7), "text must be a text, got 7"),
        (replace(LABEL, title=None), "title must be a text, got None"),
        (replace(LABEL, point=np.zeros(2, np.float32)), r"point must be an array \(3\), got"),
        (replace(LABEL, text=np.zeros(2)), r"text must be a text, got one of float64 \(2,\)"),
        (replace(LABEL, anchor=np.zeros(2)), "anchor must be start, .*, got one of float64"),
        (replace(DISC, width=np.ones(2)), "width must be a finite number .*, got one of float64"),
        (replace(DISC, colour=np.zeros(3)), "colour must be three numbers .*, got one of"),
        (replace(SOLID, layer=np.zeros(3)), "layer must be a text, got one of"),
        (replace(LABEL, anchor="left"), "anchor must be start, middle or end, got 'left'"),
        (replace(CLOUD, positions=[[0.0, 0.0, 0.0]]), r"positions must be an array \(n, 3\), got \[\["),
        (replace(CLOUD, positions=np.zeros((5, 2), np.float32)), r"an array \(n, 3\), got one of float32 \(5, 2\)"),
        (replace(CLOUD, positions=np.zeros((5, 3), np.object_)), r"an array \(n, 3\), got one of object"),
        (replace(DISC, colour=(1, 2)), r"colour must be three numbers from 0 to 255, got \(1, 2\)"),
        (replace(LABEL, colour=(0, np.nan, 0)), "colour must be three numbers from 0 to 255"),
        (replace(LABEL, colour=(0, 256, 0)), "colour must be three numbers from 0 to 255"),
        (Picture(np.zeros((6, 8, 3))), r"image_rgb must be \(height, width, 3\) bytes"),
        (Picture(np.zeros((0, 8, 3), np.uint8)), "image_rgb must be"),
    ],
)
def test_each_fault_is_told(item: Primitive, clause: str) -> None:
    """The primitive is named, and the field with what it should hold and what it does; the others are sound."""
    found = faults(drawn(item))
    assert list(found) == ["this"]
    with pytest.raises(ValueError, match=clause):
        raise ValueError(found["this"])


def test_what_has_a_fault_is_left_out() -> None:
    """The rest stays what it is, also of a world, and the caption says what is missing and why."""
    whole = drawn(replace(CLOUD, size=float("nan")))
    shown = without_faults(whole)
    assert shown.primitives == {"picture": PICTURE, "cloud": CLOUD}
    assert shown.caption.startswith("Left out of the drawing: this: size must be")
    assert (shown.width, shown.height) == (8, 6)
    sound = drawn(DISC)
    assert without_faults(sound) is sound
    both: dict[str, Primitive] = {"good": CLOUD, "bad": replace(CLOUD, size=float("inf"))}
    around = replace(sound, worlds=(drawing.WorldDrawing(World("model", "Model", "mm", 10.0), both),))
    assert list(faults(around)) == ["model/bad"]
    shown = without_faults(around)
    assert (list(shown.worlds[0].primitives), list(shown.primitives)) == (["good"], ["picture", "cloud", "this"])


@pytest.mark.parametrize(
    "item",
    [
        replace(CLOUD, size=np.float32(2)),
        replace(DISC, colour=tuple(np.array([1, 2, 3], np.uint8))),
        replace(SOLID, opacity=np.ones(3, np.float32)),
        Polyline(np.full((4, 3), np.nan, np.float32), COLOURS["truth"], 0, "trail"),
        Polyline(np.zeros((0, 3)), COLOURS["truth"], 1, "trail"),
    ],
)
def test_what_can_be_shown_is_no_fault(item: Any) -> None:
    """NumPy's numbers are numbers, a place that is none is a gap, and an empty array is nothing to see."""
    assert faults(drawn(item)) == {}


# Layers as an experiment declares them.


def test_layers_have_a_title_and_a_legend() -> None:
    """The title is the name with a capital unless told otherwise; each meaning is there once, in the palette order."""
    assert [layer.title for layer in (Layer("exact (Kalman)"), Layer("a", "Another"))] == ["Exact (Kalman)", "Another"]
    past, pose = Key("prediction", "from its own past"), Key("observation", "from the pose")
    layers = (Layer("clouds", legend=(pose, past)), Layer("traces", legend=(past,)), Layer("truth"))
    assert drawing.legend(layers) == (past, pose)
    with pytest.raises(ValueError, match="there is no colour 'pink'; there are estimate, truth"):
        Key("pink", "a dream")


# Layers as an experiment declares them.


# The legend names what is drawn, and nothing else.

PREDICTED, OBSERVED = Key("prediction", "predicted"), Key("observation", "observed")
LAYERS = (Layer("particles", legend=(PREDICTED, OBSERVED)), Layer("trail", legend=(Key("estimate", "estimate"),)))


def cloud(*colours: str) -> Drawing:
    rgb = np.array([COLOURS[name] for name in colours], dtype=np.uint8).reshape(-1, 3)
    return Drawing(8, 8, {"cloud": Points(np.zeros((len(rgb), 3), dtype=np.float32), rgb, 2.0)})


def test_only_colours_that_are_drawn_have_a_key() -> None:
    """A method that never draws from the observation needs no key for it, and an empty layer none at all."""
    both = ("particles", PREDICTED), ("particles", OBSERVED)
    assert drawn_keys(cloud("prediction"), LAYERS) == both[:1]
    assert drawn_keys(cloud("prediction", "observation"), LAYERS) == both
    assert drawn_keys(cloud(), LAYERS) == drawn_keys(Drawing(8, 8), LAYERS) == ()


def test_shades_need_all_keys_of_their_layer() -> None:
    """A layer in none of its keys' colours is explained whole; a line without places is not there."""
    line = Polyline(np.zeros((2, 3), dtype=np.float32), (1, 2, 3), 1.0, "trail")
    assert drawn_keys(Drawing(8, 8, {"trail": line}), LAYERS) == (("trail", Key("estimate", "estimate")),)
    none = Polyline(np.zeros((0, 3), dtype=np.float32), COLOURS["estimate"], 1.0, "trail")
    assert drawn_keys(Drawing(8, 8, {"trail": none}), LAYERS) == ()


ROOT = Path(__file__).parents[2]


# The palette: which colours mean what, everywhere.


def test_a_wrong_colour_is_refused_with_its_line(tmp_path: Path) -> None:
    """A channel beyond 255 and a list that nobody knows are named with file and line."""
    known = Path(drawing.__file__).with_name("palette.yaml").read_text(encoding="utf-8")
    path = tmp_path / "palette.yaml"
    wrong = {
        known.replace("black [0, 0, 0]", "black [0, 0, 256]"): "line 6: okabe_ito.black has a wrong '2'",
        f"{known}\nblacks: [0, 0, 0]\n": "palette.yaml has an unknown field 'blacks'",
    }
    for text, problem in wrong.items():
        path.write_text(text, encoding="utf-8")
        with pytest.raises(ValueError, match=problem):
            read_whole(drawing.Palette, path)


def test_colours_are_distinct_and_viridis_is_matplotlibs() -> None:
    """No two curves, and no two branches, have the same colour; nor have two meanings."""
    for colours in (drawing.CURVES, drawing.BRANCHES, tuple(COLOURS.values())):
        assert len(set(colours)) == len(colours)
    theirs = colormaps["viridis"](np.linspace(0, 1, len(drawing.VIRIDIS)), bytes=True)[:, :3]
    np.testing.assert_allclose(np.array(drawing.VIRIDIS), theirs, atol=1)


def test_declared_once() -> None:
    """No other module of Python writes one of the eight colours by its digits."""
    digits = "|".join(drawing.hexadecimal(colour) for name, colour in drawing.OKABE_ITO.items() if name != "black")
    every = [path for room in ("pftrack", "server") for path in (ROOT / room).rglob("*.py")]
    assert not [path for path in every if re.search(digits, path.read_text(encoding="utf-8"), re.IGNORECASE)]


# Worlds are declared whole, and seen from where their viewpoints say.


def world(**other: Any) -> World:
    return World("w", "World", "mm", **{"radius": 100.0, **other})


@pytest.mark.parametrize(
    ("axes", "azimuth", "elevation", "rows"),
    [
        ({}, 0, 0, [[1, 0, 0], [0, -1, 0], [0, 0, 1]]),
        ({}, 90, 0, [[0, 0, -1], [0, -1, 0], [1, 0, 0]]),
        ({}, 0, 90, [[1, 0, 0], [0, 0, 1], [0, 1, 0]]),
        ({"up": (0, -2, 0), "front": (0, 0, -1)}, 0, 0, [[1, 0, 0], [0, 1, 0], [0, 0, -1]]),
    ],
)
def test_a_viewer_sees_right_down_and_towards_himself(axes: Any, azimuth: float, elevation: float, rows: Any) -> None:
    """From the front x points to the right and y upwards, or as in a camera; so they do from aside and from above."""
    np.testing.assert_allclose(world(**axes).turn(azimuth, elevation), rows, atol=1e-12)


@pytest.mark.parametrize(("radius", "ruler"), [(100, 50), (99, 20), (140, 50), (1, 0.5), (0.03, 0.01), (4000, 2000)])
def test_a_ruler_is_a_round_number(radius: float, ruler: float) -> None:
    """It is 1, 2 or 5 times a power of ten, and at most half of the radius long."""
    assert world(radius=radius).ruler == pytest.approx(ruler)


@pytest.mark.parametrize(
    ("wrong", "clause"),
    [
        ({"radius": 0}, "radius"),
        ({"radius": float("nan")}, "radius"),
        ({"middle": (0, float("inf"), 0)}, "radius"),
        ({"front": (0, 1, 1)}, "right angles"),
        ({"up": (0, 0, 0)}, "right angles"),
        ({"viewpoints": ()}, "viewpoints"),
        ({"viewpoints": drawing.FRONT_SIDE_TOP[:1] * 2}, "viewpoints"),
    ],
)
def test_what_cannot_be_shown_is_refused(wrong: dict[str, Any], clause: str) -> None:
    """A world without extent, upright axis or viewpoints, and a viewpoint above the zenith are refused."""
    with pytest.raises(ValueError, match=clause):
        world(**wrong)
    with pytest.raises(ValueError, match=r"got 0\.0 and 91"):
        drawing.Viewpoint("over", "Over", 0.0, 91.0)
