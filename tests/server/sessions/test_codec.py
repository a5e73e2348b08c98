"""Drawings for pages: a page reads what an experiment drew, and each picture is encoded once."""

import dataclasses
import math
from collections.abc import Mapping
from typing import Any

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from numpy.typing import NDArray

from pftrack.core.model import drawing as model
from pftrack.core.model.drawing import COLOURS, Drawing, Picture, Polyline
from pftrack_server.core import pictures
from pftrack_server.core.pictures import PictureEncoder
from pftrack_server.sessions.worker.codec import DrawingEncoder
from tests.server.drawings import decode

anything = st.floats(width=32)  # a lost tracker draws what is not finite
extent, share = st.floats(0, 1e3), st.floats(0, 1)
byte = st.integers(0, 255)
colour = st.tuples(byte, byte, byte)
layer = st.text(max_size=20)


def floats(*shape: int) -> st.SearchStrategy[Any]:
    return arrays(np.float32, shape, elements=anything)


def placed(rows: int) -> st.SearchStrategy[model.Primitive]:
    """All primitives whose number of points may vary, with so many."""
    places, colours = floats(rows, 3), arrays(np.uint8, (rows, 3))
    faces = arrays(np.int32, (rows, 3), elements=st.integers(0, max(rows - 1, 0)))
    opacity = share | arrays(np.float32, rows, elements=st.floats(0, 1, width=32))
    return st.one_of(
        st.builds(model.Points, places, colours, extent, layer),
        st.builds(model.Polyline, places, colour, extent, layer),
        *(st.builds(kind, floats(rows, 2, 3), colour, extent, layer) for kind in (model.Links, model.Arrows)),
        st.builds(model.Ellipsoids, places, floats(rows, 3, 3), colours, share, layer, extent),
        st.builds(model.Mesh, places, faces, colour | colours, opacity, layer),
    )


anchor = st.sampled_from(["start", "middle", "end"])
single = st.one_of(
    st.builds(model.Ellipse, floats(3), floats(2, 2), colour, extent, layer, st.booleans()),
    st.builds(model.Axes, floats(3), floats(3, 3), extent, colour, extent, layer),
    st.builds(model.Text, floats(3), layer, colour, layer, anchor, st.text(max_size=30), st.none() | floats(3)),
    st.builds(model.Frustum, floats(3), floats(4, 3), colour, extent, layer),
)
anywhere = st.one_of(single, st.integers(0, 40).flatmap(placed))
number = st.floats(-1e3, 1e3)
viewpoint = st.builds(model.Viewpoint, st.text(), st.text(), number, st.floats(-90, 90))
viewpoints = st.lists(viewpoint, min_size=1, max_size=4, unique_by=lambda viewpoint: viewpoint.name).map(tuple)
name, scale = st.text(max_size=10), st.floats(1e-3, 1e6)
middle = st.tuples(number, number, number)
world = st.builds(model.World, name, name, name, scale, middle, viewpoints=viewpoints)
in_world = anywhere.filter(lambda item: not isinstance(item, model.Ellipse | model.Frustum))
worlds = st.lists(st.builds(model.WorldDrawing, world, st.dictionaries(name, in_world, max_size=4)), max_size=2)
drawings = st.builds(
    model.Drawing,
    st.integers(1, 4000),
    st.integers(1, 4000),
    st.dictionaries(name, anywhere, max_size=8),
    st.text(max_size=60),
    worlds.map(tuple),
)


def assert_same(first: Mapping[str, model.Primitive], second: Mapping[str, model.Primitive]) -> None:
    assert [(name, type(item)) for name, item in first.items()] == [(name, type(it)) for name, it in second.items()]
    for name, item in first.items():
        for field in dataclasses.fields(item):
            one, other = getattr(item, field.name), getattr(second[name], field.name)
            if isinstance(one, np.ndarray):
                assert one.dtype == other.dtype
                np.testing.assert_array_equal(one, other)
            else:
                assert one == other


@given(drawings, st.integers(0, 100_000))
def test_a_drawing_comes_back_as_it_was(drawing: model.Drawing, frame: int) -> None:
    """Every primitive arrives with its name, its order and the bits of its arrays, whatever they hold."""
    number, read, pictures = decode(DrawingEncoder().encode(drawing, frame).message())
    assert (number, read.width, read.height, read.caption) == (frame, drawing.width, drawing.height, drawing.caption)
    assert_same(drawing.primitives, read.primitives)
    assert [each.world for each in read.worlds] == [each.world for each in drawing.worlds]
    for one, other in zip(drawing.worlds, read.worlds, strict=True):
        assert_same(one.primitives, other.primitives)
    assert pictures == {}


def test_a_picture_keeps_its_colours_and_edges() -> None:
    """JPEG leaves flat colours within two levels, also next to an edge of another colour."""
    rows, columns = np.indices((60, 80))
    inside = np.hypot(columns - 30, rows - 25) < 12
    shown = np.where(inside[..., None], (213, 94, 0), (90, 140, 200)).astype(np.uint8)
    drawing = model.Drawing(80, 60, {"picture": model.Picture(shown)})
    item: Any = decode(DrawingEncoder().encode(drawing, 0).message())[1].primitives["picture"]
    for place in ((25, 30), (5, 5)):
        assert abs(item.image_rgb[place].astype(int) - shown[place]).max() <= 2
    centres = []
    for image in (item.image_rgb, shown):
        weights = image[..., 0].astype(float) - 90
        centres.append(np.array([(columns * weights).sum(), (rows * weights).sum()]) / weights.sum())
    np.testing.assert_allclose(*centres, atol=0.05)


@given(places=arrays(np.float32, (5, 3), elements=anything))
def test_numbers_can_be_rounded_to_a_share_of_themselves(places: NDArray[np.float32]) -> None:
    """With so many bits of the fraction each number is off by half of the last of them; what is not finite stays."""
    drawing = model.Drawing(9, 9, {"a": model.Points(places, np.zeros((5, 3), np.uint8), 2.0)})
    read = decode(DrawingEncoder(bits=10).encode(drawing, 0).message())[1].primitives["a"].positions
    np.testing.assert_allclose(read, places, rtol=2.0**-10, atol=1e-40)


@pytest.mark.parametrize("size", [math.nan, (2.0,)])
def test_what_a_page_cannot_read_is_refused_by_name(size: Any) -> None:
    """A NaN, or a tuple in place of a number, is refused with the primitive's name before anything is sent."""
    cloud = model.Points(np.zeros((5, 3), np.float32), np.zeros((5, 3), np.uint8), size)
    with pytest.raises(ValueError, match="particles cannot be shown: size must be a finite number"):
        DrawingEncoder().encode(model.Drawing(8, 6, {"particles": cloud}), 0)


@pytest.fixture
def encoded(monkeypatch: pytest.MonkeyPatch) -> list[tuple[int, ...]]:
    """Shapes of the pictures that were encoded."""
    shapes: list[tuple[int, ...]] = []
    encode = cv2.imencode

    def counted(suffix: str, image: Any, form: Any) -> Any:
        shapes.append(image.shape)
        return encode(suffix, image, form)

    monkeypatch.setattr(pictures.cv2, "imencode", counted)
    return shapes


def drawing(level: int = 200, size: tuple[int, int] = (60, 80)) -> Drawing:
    line = Polyline(np.zeros((2, 3), np.float32), COLOURS["truth"], 1.0, "truth")
    picture = Picture(np.full((*size, 3), (level, 40, 90), np.uint8), "video")
    return Drawing(80, 60, {"line": line, "picture": picture}, "Frame 3")


def test_a_scene_is_sent_files_and_no_pixels() -> None:
    """Pictures keep their name, layer and place in the painting order; everything else stays the same."""
    before = drawing()
    sent = PictureEncoder().for_scene(before)
    assert list(sent.drawing.primitives) == ["line", "picture"]
    assert sent.drawing.primitives["line"] is before.primitives["line"]
    bare: Any = sent.drawing.primitives["picture"]
    assert (bare.image_rgb.size, bare.layer, sent.drawing.caption) == (0, "video", "Frame 3")
    picture = sent.pictures["picture"]
    assert (picture.width, picture.height) == (80, 60)
    seen = cv2.imdecode(np.frombuffer(picture.file, np.uint8), cv2.IMREAD_COLOR)
    assert seen.shape == (60, 80, 3)
    np.testing.assert_allclose(seen[30, 30, ::-1], (200, 40, 90), atol=4)


def test_a_picture_may_be_drawn_over_the_last_one() -> None:
    """An experiment that keeps one array for all frames has each of them sent."""
    encoder, shown = PictureEncoder(), drawing()
    picture: Any = shown.primitives["picture"]
    first = encoder.for_scene(shown).pictures["picture"]
    picture.image_rgb[:] = 7
    second = encoder.for_scene(shown).pictures["picture"]
    assert first.key != second.key
    picture.image_rgb.flags.writeable = False
    assert encoder.for_scene(shown).pictures["picture"] is second


def test_a_picture_is_encoded_once(encoded: list[tuple[int, ...]]) -> None:
    """A picture that stays keeps its key, and an equal copy is the same picture.

    A picture fine enough for a flat view is used for the scene; one made for the scene alone is made again.
    """
    encoder = PictureEncoder()
    flat = DrawingEncoder(encoder)
    (fine,) = flat.encode(drawing(), 0).pictures
    for _ in range(2):
        assert encoder.for_scene(drawing()).pictures["picture"] is fine
    coarse = encoder.for_scene(drawing(100, (120, 160))).pictures["picture"]
    assert (coarse.width, coarse.height) == (160, 120)
    (finer,) = flat.encode(drawing(100, (120, 160)), 1).pictures
    assert encoded == [(60, 80, 3), (120, 160, 3), (120, 160, 3)]
    assert len({fine.key, coarse.key, finer.key}) == 3
    assert len(finer.file) >= len(coarse.file)
    assert encoder.for_scene(drawing(100, (120, 160))).pictures["picture"] is finer
