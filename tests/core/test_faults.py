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
    BRANCHES,
    COLOURS,
    CURVES,
    FRONT_SIDE_TOP,
    OKABE_ITO,
    VIRIDIS,
    Drawing,
    Ellipse,
    Key,
    Layer,
    Mesh,
    Palette,
    Picture,
    Points,
    Polyline,
    Primitive,
    Text,
    Viewpoint,
    World,
    WorldDrawing,
    drawn_keys,
    hexadecimal,
    legend,
)
from pftrack.core.model.faults import faults, without_faults
from pftrack.core.texts import read_whole

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


# Layers as an experiment declares them.


def test_a_layer_is_called_by_its_name_unless_told_otherwise() -> None:
    """Its title begins with a capital letter."""
    assert Layer("exact (Kalman)").title == "Exact (Kalman)"
    assert Layer("a", "Another").title == "Another"


def test_a_colour_without_a_meaning_is_refused() -> None:
    """The sentence names those that there are."""
    with pytest.raises(ValueError, match="there is no colour 'pink'; there are estimate, truth"):
        Key("pink", "a dream")


def test_the_legend_says_each_meaning_once_in_the_palettes_order() -> None:
    """Two layers may share a meaning, and one colour may have several."""
    past, pose = Key("prediction", "from its own past"), Key("observation", "from the pose")
    layers = (Layer("clouds", legend=(pose, past)), Layer("traces", legend=(past,)), Layer("truth"))
    assert legend(layers) == (past, pose)


# The legend names what is drawn, and nothing else.

PREDICTED, OBSERVED = Key("prediction", "predicted"), Key("observation", "observed")
LAYERS = (Layer("particles", legend=(PREDICTED, OBSERVED)), Layer("trail", legend=(Key("estimate", "estimate"),)))


def cloud(*colours: str) -> Drawing:
    rgb = np.array([COLOURS[name] for name in colours], dtype=np.uint8).reshape(-1, 3)
    return Drawing(8, 8, {"cloud": Points(np.zeros((len(rgb), 3), dtype=np.float32), rgb, 2.0)})


def test_only_colours_that_are_drawn_have_a_key() -> None:
    """A method that never draws from the observation needs no key for it, and an empty layer none at all."""
    assert drawn_keys(cloud("prediction"), LAYERS) == (("particles", PREDICTED),)
    assert drawn_keys(cloud("prediction", "observation"), LAYERS) == (("particles", PREDICTED), ("particles", OBSERVED))
    assert drawn_keys(cloud(), LAYERS) == ()
    assert drawn_keys(Drawing(8, 8), LAYERS) == ()


def test_shades_need_all_keys_of_their_layer() -> None:
    """A layer in none of its keys' colours is explained whole; a line without places is not there."""
    line = Polyline(np.zeros((2, 3), dtype=np.float32), (1, 2, 3), 1.0, "trail")
    assert drawn_keys(Drawing(8, 8, {"trail": line}), LAYERS) == (("trail", Key("estimate", "estimate")),)
    none = Polyline(np.zeros((0, 3), dtype=np.float32), COLOURS["estimate"], 1.0, "trail")
    assert drawn_keys(Drawing(8, 8, {"trail": none}), LAYERS) == ()


# The palette: which colours mean what, everywhere.

ROOT = Path(__file__).parents[2]


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
            read_whole(Palette, path)


def test_distinct() -> None:
    """No two curves, and no two branches, have the same colour; nor have two meanings."""
    for colours in (CURVES, BRANCHES, tuple(COLOURS.values())):
        assert len(set(colours)) == len(colours)


def test_viridis() -> None:
    """The stops of the map of amounts are matplotlib's."""
    theirs = colormaps["viridis"](np.linspace(0, 1, len(VIRIDIS)), bytes=True)[:, :3]
    np.testing.assert_allclose(np.array(VIRIDIS), theirs, atol=1)


def test_declared_once() -> None:
    """No other module of Python writes one of the eight colours by its digits."""
    digits = "|".join(hexadecimal(colour) for name, colour in OKABE_ITO.items() if name != "black")
    found = [
        str(path.relative_to(ROOT))
        for room in ("pftrack", "server")
        for path in (ROOT / room).rglob("*.py")
        if re.search(digits, path.read_text(encoding="utf-8"), re.IGNORECASE)
    ]
    assert not found


# Worlds are declared whole, and seen from where their viewpoints say.


def world(**other: Any) -> World:
    return World("w", "World", "mm", **{"radius": 100.0, **other})


@pytest.mark.parametrize(
    ("azimuth", "elevation", "rows"),
    [
        (0, 0, [[1, 0, 0], [0, -1, 0], [0, 0, 1]]),
        (90, 0, [[0, 0, -1], [0, -1, 0], [1, 0, 0]]),
        (0, 90, [[1, 0, 0], [0, 0, 1], [0, 1, 0]]),
    ],
)
def test_a_viewer_sees_right_down_and_towards_himself(azimuth: float, elevation: float, rows: Any) -> None:
    """From the front x points to the right and y upwards; so they do from aside and from above, as turned."""
    np.testing.assert_allclose(world().turn(azimuth, elevation), rows, atol=1e-12)


def test_what_is_up_is_seen_upwards() -> None:
    """Where y points down and z away, as in a camera's frame, the picture is that of the camera."""
    seen = world(up=(0, -2, 0), front=(0, 0, -1)).turn(0, 0)
    np.testing.assert_allclose(seen, [[1, 0, 0], [0, 1, 0], [0, 0, -1]], atol=1e-12)


@pytest.mark.parametrize(("radius", "ruler"), [(100, 50), (99, 20), (140, 50), (1, 0.5), (0.03, 0.01), (4000, 2000)])
def test_a_ruler_is_a_round_number(radius: float, ruler: float) -> None:
    """It is 1, 2 or 5 times a power of ten, and at most half of the radius long."""
    assert world(radius=radius).ruler == pytest.approx(ruler)


@pytest.mark.parametrize(
    "wrong",
    [
        {"radius": 0},
        {"radius": float("nan")},
        {"middle": (0, float("inf"), 0)},
        {"front": (0, 1, 1)},
        {"up": (0, 0, 0)},
        {"viewpoints": ()},
        {"viewpoints": FRONT_SIDE_TOP[:1] * 2},
    ],
)
def test_what_cannot_be_shown_is_refused(wrong: dict[str, Any]) -> None:
    """A world without extent, upright axis or viewpoints is refused where it is declared."""
    with pytest.raises(ValueError, match=r"radius|right angles|viewpoints"):
        world(**wrong)


def test_a_viewpoint_is_not_beyond_the_poles() -> None:
    """Nobody looks from above the zenith."""
    with pytest.raises(ValueError, match=r"got 0\.0 and 91"):
        Viewpoint("over", "Over", 0.0, 91.0)
