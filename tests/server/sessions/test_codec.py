"""The codec of drawings: what a page reads is what an experiment drew."""

import dataclasses
import json
import math
from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from numpy.typing import NDArray

from pftrack.core.model import drawing as model
from pftrack_server.sessions.worker.codec import DrawingEncoder
from tests.server.drawings import decode, messages_of

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


def picture(seed: int) -> NDArray[np.uint8]:
    """A disc on a ground of another colour."""
    rows, columns = np.indices((60, 80))
    inside = np.hypot(columns - 30 - seed, rows - 25) < 12
    return np.where(inside[..., None], (213, 94, 0), (90, 140, 200)).astype(np.uint8)


def of_picture(seed: int) -> model.Drawing:
    return model.Drawing(80, 60, {"picture": model.Picture(picture(seed))})


def test_a_picture_keeps_its_colours_and_edges() -> None:
    """JPEG leaves flat colours within two levels, and the centre of a shape within a twentieth of a pixel."""
    shown = picture(0)
    item: Any = decode(DrawingEncoder().encode(of_picture(0), 0).message())[1].primitives["picture"]
    for place in ((25, 30), (5, 5)):
        assert abs(item.image_rgb[place].astype(int) - shown[place]).max() <= 2

    def centre(image: NDArray[np.uint8]) -> NDArray[np.float64]:
        weights = image[..., 0].astype(float) - 90
        rows, columns = np.indices(weights.shape)
        return np.array([(columns * weights).sum(), (rows * weights).sum()]) / weights.sum()

    np.testing.assert_allclose(centre(item.image_rgb), centre(shown), atol=0.05)


def test_a_picture_that_stays_is_sent_once() -> None:
    """A page that has the picture gets the rest alone; another picture has another key."""
    encoder = DrawingEncoder()
    first, same, other = (encoder.encode(of_picture(seed), frame) for frame, seed in enumerate((0, 0, 9)))
    keys = [[it.key for it in each.pictures] for each in (first, same, other)]
    assert keys[0] == keys[1] != keys[2]
    assert len(same.message(keys[0])) < 300 < len(same.message())
    _, before, held = decode(first.message())
    _, after, still_held = decode(same.message(keys[0]), held)
    assert_same(before.primitives, after.primitives)
    assert list(still_held) == keys[0]
    assert list(decode(other.message(keys[0]), still_held)[2]) == keys[2]


def test_an_array_that_two_primitives_share_travels_once() -> None:
    """A cloud that is drawn in two colourings has its places sent once."""
    places = np.zeros((1000, 3), np.float32)
    colours = np.zeros((1000, 3), np.uint8)
    one = model.Drawing(9, 9, {"a": model.Points(places, colours, 2.0)})
    two = model.Drawing(9, 9, {"a": model.Points(places, colours, 2.0), "b": model.Points(places, colours + 1, 2.0)})
    sizes = [len(DrawingEncoder().encode(each, 0).message()) for each in (one, two)]
    assert 3000 <= sizes[1] - sizes[0] < 3500


@given(places=arrays(np.float32, (5, 3), elements=anything))
def test_numbers_can_be_rounded_to_a_share_of_themselves(places: NDArray[np.float32]) -> None:
    """With so many bits of the fraction each number is off by half of the last of them; what is not finite stays."""
    drawing = model.Drawing(9, 9, {"a": model.Points(places, np.zeros((5, 3), np.uint8), 2.0)})
    read = decode(DrawingEncoder(bits=10).encode(drawing, 0).message())[1].primitives["a"].positions
    np.testing.assert_allclose(read, places, rtol=2.0**-10, atol=1e-40)


def test_what_was_told_up_to_it_is_in_its_head() -> None:
    """A page takes over the messages of the stream together with the picture, which they leave as it is."""
    told = [{"type": "changes", "session": {"position": 3}}, {"type": "changes", "session": {"name": "Δ"}}]
    encoded = DrawingEncoder().encode(of_picture(0), 3)
    alone, message = encoded.message(), encoded.message(texts=map(json.dumps, told))
    assert (messages_of(alone), messages_of(message)) == ([], told)
    assert decode(message)[2] == decode(alone)[2]


@pytest.mark.parametrize("size", [math.nan, (2.0,)])
def test_what_a_page_cannot_read_is_refused_by_name(size: Any) -> None:
    """A number that is none, or a tuple in place of one, is told with the primitive's name before anything is sent."""
    cloud = model.Points(np.zeros((5, 3), np.float32), np.zeros((5, 3), np.uint8), size)
    with pytest.raises(ValueError, match="particles cannot be shown: size must be a finite number"):
        DrawingEncoder().encode(model.Drawing(8, 6, {"picture": model.Picture(picture(0)), "particles": cloud}), 0)
