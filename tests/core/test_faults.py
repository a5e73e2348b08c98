"""What is drawn: layers, legend, palette and worlds, and faults that no viewer can show."""

import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib import colormaps

from pftrack.core.model import drawing
from pftrack.core.model.faults import faults, without_faults

PICTURE = drawing.Picture(np.zeros((6, 8, 3), np.uint8))
CLOUD = drawing.Points(np.zeros((5, 3), np.float32), np.zeros((5, 3), np.uint8), 2.0)
DISC = drawing.Ellipse(np.zeros(3, np.float32), np.eye(2, dtype=np.float32), drawing.COLOURS["truth"], 2.0, "truth")
SOLID = drawing.Mesh(np.zeros((3, 3), np.float32), np.zeros((1, 3), np.int32), (0, 0, 0), 0.5, "estimate")
LABEL = drawing.Text(np.zeros(3, np.float32), "here", (0, 0, 0), "truth")


def drawn(item: drawing.Primitive) -> drawing.Drawing:
    return drawing.Drawing(8, 6, {"picture": PICTURE, "cloud": CLOUD, "this": item}, "frame 7")


@pytest.mark.parametrize(
    ("item", "clause"),
    [
        (replace(CLOUD, size=float("nan")), "size must be a finite number .*, got nan"),
        (replace(DISC, width=-1.0), "width must be a finite number that is not negative, got -1.0"),
        (replace(DISC, width=np.ones(2)), "width must be a finite number .*, got one of float64"),
        (replace(SOLID, faces=np.array([[0, 1, 3]], np.int32)), "faces must name vertices 0 to 2, got 0 to 3"),
        (replace(SOLID, faces=np.zeros((1, 3))), "faces must hold whole numbers, got float64"),
        (replace(LABEL, text=7), "text must be a text, got 7"),
        (replace(LABEL, point=np.zeros(2, np.float32)), r"point must be an array \(3\), got"),
        (replace(LABEL, anchor=np.zeros(2)), "anchor must be start, .*, got one of float64"),
        (replace(DISC, colour=np.zeros(3)), "colour must be three numbers .*, got one of"),
        (replace(CLOUD, positions=[[0.0, 0.0, 0.0]]), r"positions must be an array \(n, 3\), got \[\["),
        (replace(CLOUD, positions=np.zeros((5, 3), np.object_)), r"an array \(n, 3\), got one of object"),
        (replace(DISC, colour=(1, 2)), r"colour must be three numbers from 0 to 255, got \(1, 2\)"),
        (replace(LABEL, colour=(0, 256, 0)), "colour must be three numbers from 0 to 255"),
        (drawing.Picture(np.zeros((6, 8, 3))), r"image_rgb must be \(height, width, 3\) bytes"),
    ],
)
def test_each_fault_is_told(item: drawing.Primitive, clause: str) -> None:
    """The primitive is named, and the field with what it should hold and what it does; the others are sound."""
    found = faults(drawn(item))
    assert list(found) == ["this"]
    with pytest.raises(ValueError, match=clause):
        raise ValueError(found["this"])


def test_what_has_a_fault_is_left_out() -> None:
    """The rest stays what it is, also of a world, and the caption says what is missing and why.

    NumPy's numbers are numbers, and a place of NaN is a gap.
    """
    whole = drawn(replace(CLOUD, size=float("nan")))
    shown = without_faults(whole)
    assert shown.primitives == {"picture": PICTURE, "cloud": CLOUD}
    assert shown.caption.startswith("Left out of the drawing: this: size must be")
    assert (shown.width, shown.height) == (8, 6)
    gap = drawing.Polyline(np.full((4, 3), np.nan), (0, 0, 0), 0, "trail")
    for item in (DISC, replace(CLOUD, size=np.float32(2)), gap):
        sound = drawn(item)
        assert without_faults(sound) is sound
    both: dict[str, drawing.Primitive] = {"good": CLOUD, "bad": replace(CLOUD, size=float("inf"))}
    around = replace(sound, worlds=(drawing.WorldDrawing(drawing.World("model", "Model", "mm", 10.0), both),))
    assert list(faults(around)) == ["model/bad"]
    shown = without_faults(around)
    assert (list(shown.worlds[0].primitives), list(shown.primitives)) == (["good"], ["picture", "cloud", "this"])


# The legend names what is drawn, and nothing else.

PREDICTED, OBSERVED = drawing.Key("prediction", "predicted"), drawing.Key("observation", "observed")
ESTIMATED = drawing.Key("estimate", "estimate")
LAYERS = (drawing.Layer("particles", legend=(PREDICTED, OBSERVED)), drawing.Layer("trail", legend=(ESTIMATED,)))


def cloud(*colours: str) -> drawing.Drawing:
    rgb = np.array([drawing.COLOURS[name] for name in colours], dtype=np.uint8).reshape(-1, 3)
    return drawing.Drawing(8, 8, {"cloud": drawing.Points(np.zeros((len(rgb), 3), dtype=np.float32), rgb, 2.0)})


def test_only_colours_that_are_drawn_have_a_key() -> None:
    """A method that never draws from the observation needs no key for it, and an empty layer none at all.

    A layer in none of its keys' colours is explained whole; each meaning is in the legend once.
    """
    both = ("particles", PREDICTED), ("particles", OBSERVED)
    assert drawing.drawn_keys(cloud("prediction"), LAYERS) == both[:1]
    assert drawing.drawn_keys(cloud("prediction", "observation"), LAYERS) == both
    assert drawing.drawn_keys(cloud(), LAYERS) == drawing.drawn_keys(drawing.Drawing(8, 8), LAYERS) == ()
    line = drawing.Polyline(np.zeros((2, 3), dtype=np.float32), (1, 2, 3), 1.0, "trail")
    assert drawing.drawn_keys(drawing.Drawing(8, 8, {"trail": line}), LAYERS) == (("trail", ESTIMATED),)
    legend = drawing.legend((*LAYERS, drawing.Layer("more", legend=(OBSERVED,))))
    assert (len(legend), set(legend)) == (3, {PREDICTED, OBSERVED, ESTIMATED})
    with pytest.raises(ValueError, match="there is no colour 'pink'; there are estimate, truth"):
        drawing.Key("pink", "a dream")


ROOT = Path(__file__).parents[2]


# The palette: which colours mean what, everywhere.


def test_colours_are_distinct_and_viridis_is_matplotlibs() -> None:
    """No two curves, and no two branches, have the same colour; nor have two meanings."""
    for colours in (drawing.CURVES, drawing.BRANCHES, tuple(drawing.COLOURS.values())):
        assert len(set(colours)) == len(colours)
    theirs = colormaps["viridis"](np.linspace(0, 1, len(drawing.VIRIDIS)), bytes=True)[:, :3]
    np.testing.assert_allclose(np.array(drawing.VIRIDIS), theirs, atol=1)


def test_declared_once() -> None:
    """No other module of Python writes one of the eight colours by its digits."""
    digits = "|".join(drawing.hexadecimal(colour) for name, colour in drawing.OKABE_ITO.items() if name != "black")
    every = [path for room in ("pftrack", "server") for path in (ROOT / room).rglob("*.py")]
    assert not [path for path in every if re.search(digits, path.read_text(encoding="utf-8"), re.IGNORECASE)]


# Worlds are declared whole, and seen from where their viewpoints say.


def world(**other: Any) -> drawing.World:
    return drawing.World("w", "World", "mm", **{"radius": 100.0, **other})


@pytest.mark.parametrize(
    ("axes", "azimuth", "elevation", "rows"),
    [
        ({}, 90, 0, [[0, 0, -1], [0, -1, 0], [1, 0, 0]]),
        ({}, 0, 90, [[1, 0, 0], [0, 0, 1], [0, 1, 0]]),
        ({"up": (0, -2, 0), "front": (0, 0, -1)}, 0, 0, [[1, 0, 0], [0, 1, 0], [0, 0, -1]]),
    ],
)
def test_a_viewer_sees_right_down_and_towards_himself(axes: Any, azimuth: float, elevation: float, rows: Any) -> None:
    """From the front x points to the right and y upwards, or as in a camera; so they do from aside and from above."""
    np.testing.assert_allclose(world(**axes).turn(azimuth, elevation), rows, atol=1e-12)


@pytest.mark.parametrize(("radius", "ruler"), [(100, 50), (99, 20), (0.03, 0.01), (4000, 2000)])
def test_a_ruler_is_a_round_number(radius: float, ruler: float) -> None:
    """It is 1, 2 or 5 times a power of ten, and at most half of the radius long."""
    assert world(radius=radius).ruler == pytest.approx(ruler)


@pytest.mark.parametrize(
    ("wrong", "clause"),
    [
        ({"radius": 0}, "radius"),
        ({"middle": (0, float("inf"), 0)}, "radius"),
        ({"front": (0, 1, 1)}, "right angles"),
        ({"up": (0, 0, 0)}, "right angles"),
        ({"viewpoints": drawing.FRONT_SIDE_TOP[:1] * 2}, "viewpoints"),
    ],
)
def test_what_cannot_be_shown_is_refused(wrong: dict[str, Any], clause: str) -> None:
    """A world without extent, upright axis or viewpoints, and a viewpoint above the zenith are refused."""
    with pytest.raises(ValueError, match=clause):
        world(**wrong)
    with pytest.raises(ValueError, match=r"got 0\.0 and 91"):
        drawing.Viewpoint("over", "Over", 0.0, 91.0)
