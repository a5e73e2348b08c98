"""Drawings are painted where their coordinates say, in their colours, layer by layer."""

import itertools
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from pftrack.core.model import drawing as shapes
from pftrack.core.model.drawing import Drawing, Ellipse, Ellipsoids, Mesh, Points, Text
from pftrack.vision.rendering import render
from tests.vision.ink import BLUE, centre, f32

NAMED = Text(f32(240, 20, 0), "rlc", BLUE, "names", anchor="end", title="right eye, outer corner")


def single(primitive: shapes.Primitive, width: int = 40, height: int = 30, **options: float) -> np.ndarray:
    return render(Drawing(width, height, {"it": primitive}), **options)  # type: ignore[arg-type]


def ink(picture: np.ndarray) -> np.ndarray:
    """How much of each pixel is not paper."""
    return (255.0 - picture.astype(float)).sum(axis=2)


def near(picture: np.ndarray, place: Any) -> float:
    """The most ink within a pixel of a place."""
    x, y = np.rint(place).astype(int)
    return float(ink(picture)[y - 1 : y + 2, x - 1 : x + 2].max())


def point(x: float, y: float, size: float = 6.0) -> Points:
    return Points(f32([x, y, 0]), np.array([BLUE], np.uint8), size)


def every(shift: np.ndarray | int = 0) -> dict[str, shapes.Primitive]:
    """Return a primitive of each kind, moved."""
    middle, line = f32(20, 15, 0) + shift, f32([5, 5, 0], [30, 20, 0]) + shift
    triangle = f32([5, 5, 0], [30, 5, 0], [5, 25, 0]) + shift
    pairs = f32([[5, 5, 0], [9, 9, 0]], [[20, 5, 0], [25, 9, 0]]) + shift
    spread, halves = f32([[25, 10, 3], [10, 16, 2], [3, 2, 9]]), f32([8, 0], [0, 5])
    return {
        "points": Points(middle[None], np.array([BLUE], np.uint8), 6.0),
        "line": shapes.Polyline(line, BLUE, 2.0, "trail"),
        "ellipse": Ellipse(middle, halves, BLUE, 1.0, "sigma"),
        "dashed": Ellipse(middle, halves, BLUE, 1.0, "gate", dashed=True),
        "arrow": shapes.Arrows(line[None], BLUE, 2.0, "arrows"),
        "ellipsoid": Ellipsoids(middle[None], spread, np.uint8([BLUE]), 0.5, "bodies"),
        "axes": shapes.Axes(middle, np.eye(3, dtype=np.float32), 10.0, BLUE, 2.0, "axes"),
        "mesh": Mesh(triangle, np.array([[0, 1, 2]], np.int32), BLUE, 1.0, "mesh"),
        "links": shapes.Links(pairs, BLUE, 1.0, "links"),
        "text": Text(f32(5, 20, 0) + shift, "lost", BLUE, "labels"),
        "middle": Text(f32(20, 20, 0) + shift, "lost", BLUE, "labels", anchor="middle"),
        "end": Text(f32(35, 20, 0) + shift, "lost", BLUE, "labels", anchor="end"),
    }


EVERY = every()


def test_a_frame_is_shown_as_it_is() -> None:
    """At scale 1 the frame's picture comes out pixel for pixel; at scale 2 each pixel becomes four."""
    frame = np.random.default_rng(0).integers(0, 256, (30, 40, 3), dtype=np.uint8)
    np.testing.assert_array_equal(single(shapes.Picture(frame)), frame)
    doubled = frame.repeat(2, axis=0).repeat(2, axis=1)
    np.testing.assert_array_equal(single(shapes.Picture(frame), scale=2.0), doubled)


@pytest.mark.parametrize(("x", "y", "scale"), [(20.25, 14.5, 1.0), (11.75, 9.25, 2.0), (20, 15, 0.5)])
def test_a_point_lies_where_it_is_said_to_be(x: float, y: float, scale: float) -> None:
    """The centre of a point's ink is its position, to a tenth of a pixel, at any scale."""
    expected = scale * (x + 0.5) - 0.5, scale * (y + 0.5) - 0.5
    assert centre(ink(single(point(x, y, 8.0), scale=scale))) == pytest.approx(expected, abs=0.1)


def test_many_points_are_painted_as_few_are() -> None:
    """Thousands of points take a faster way, which puts them in the same places and colours."""
    places = np.array(list(itertools.product(range(2, 38, 9), range(2, 28, 8))), np.float32)
    positions = np.column_stack([places, np.zeros(len(places), np.float32)])
    few, many = (
        ink(single(Points(np.tile(positions, (times, 1)), np.tile(np.uint8(BLUE), (times * len(places), 1)), 3.0)))
        for times in (1, -(-5_000 // len(places)))
    )
    whole = ink(np.array([[BLUE]], np.uint8))[0, 0]
    assert ((few == whole) <= (many == whole)).all()
    assert ((many > 0) <= (few > 0)).all()


@pytest.mark.parametrize("scale", [1.7, 2.0, 0.6])
def test_a_picture_lies_under_what_is_drawn_on_it(scale: float) -> None:
    """A spot in the picture and a point on it have the same centre, at any scale."""
    image = np.full((30, 40, 3), 255, np.uint8)
    image[10:15, 22:27] = BLUE
    spot, mark = (centre(ink(single(it, scale=scale))) for it in (shapes.Picture(image), point(24, 12)))
    assert spot == pytest.approx(mark, abs=0.3)


@pytest.mark.parametrize("name", EVERY)
def test_every_primitive_leaves_its_colour(name: str) -> None:
    """Each kind of primitive is seen, and a layer that is switched off is not.

    A lost tracker draws far outside, or nowhere: the picture stays whole.
    """
    drawing = Drawing(40, 30, {name: EVERY[name]})
    painted = render(drawing)
    assert (painted[:, :, 2].astype(int) - painted[:, :, 0]).max() > 60
    assert (render(drawing, layers={EVERY[name].layer: False}) == 255).all()
    np.testing.assert_array_equal(render(drawing, layers={"another": False}), painted)
    for shift in (f32(1e9, -1e9, 0), np.full(3, np.nan, np.float32), f32(np.inf, 0, 0)):
        assert (single(every(shift)[name]) == 255).all()


def columns_of(width: int, text: Text) -> np.ndarray:
    """The columns of a picture of a width in which a text has left something."""
    return np.flatnonzero((render(Drawing(width, 40, {"name": text})) != 255).any(axis=(0, 2)))


def test_a_name_is_written_out_where_there_is_room() -> None:
    """It is short on a narrow picture and long on a wide one, on the side of its position that its anchor says."""
    short, full = columns_of(500, NAMED), columns_of(640, NAMED)
    other = columns_of(640, replace(NAMED, anchor="start"))
    assert np.ptp(short) < 40
    assert np.ptp(full) > 120
    assert np.ptp(full) == pytest.approx(np.ptp(other), abs=3)
    assert max(short.max(), full.max()) < 244 < other.max()


def test_a_text_stays_in_the_picture() -> None:
    """Near the edge it is moved as far as need be, so that all of it can be read, but not if its place is outside."""
    inside = np.ptp(columns_of(640, replace(NAMED, position=f32(300, 20, 0))))
    beyond = replace(NAMED, position=f32(630, 20, 0), anchor="start")
    for name in (replace(NAMED, position=f32(30, 20, 0)), beyond, replace(beyond, title="", text=NAMED.title)):
        assert np.ptp(columns_of(640, name)) == pytest.approx(inside, abs=3)
    assert not columns_of(640, replace(beyond, position=f32(648, 20, 0))).size


def test_empty_primitives_draw_nothing() -> None:
    """No points, no faces, no segments, a line of one point and axes that are no number are all nothing."""
    none, pairs = np.zeros((0, 3), np.float32), np.zeros((0, 2, 3), np.float32)
    for primitive in (
        Points(none, np.zeros((0, 3), np.uint8), 3.0),
        shapes.Polyline(f32([1, 1, 0]), BLUE, 1.0, "trail"),
        Mesh(none, np.zeros((0, 3), np.int32), BLUE, 1.0, "mesh"),
        shapes.Links(pairs, BLUE, 1.0, "links"),
        shapes.Arrows(np.zeros((1, 2, 3), np.float32) + np.float32(-99), BLUE, 1.0, "no way"),
        Ellipsoids(none, np.zeros((0, 3, 3), np.float32), np.zeros((0, 3), np.uint8), 0.5, "bodies"),
        Ellipse(f32(20, 15, 0), f32([np.nan, 0], [0, 5]), BLUE, 1.0, "gate", dashed=True),
    ):
        assert (single(primitive) == 255).all()


SQUARE = f32([4, 4, 0], [36, 4, 0], [36, 26, 0], [4, 26, 0])
HALVES = np.array([[0, 1, 2], [0, 2, 3]], np.int32)


def square(colour: Any = BLUE, opacity: Any = 1.0) -> np.ndarray:
    return single(Mesh(SQUARE, HALVES, colour, opacity, "mesh"))


def test_a_triangle_has_the_mean_colour_and_opacity_of_its_corners() -> None:
    """Each vertex counts for a third, in the triangles that it belongs to."""
    picture = square(np.array([[0, 0, 0], [240, 0, 0], [0, 120, 0], [0, 0, 60]], np.uint8))
    np.testing.assert_allclose(picture[[8, 22], [30, 10]], [(80, 40, 0), (0, 40, 20)], atol=1)
    faint = square((0, 0, 0), np.array([0.0, 0.6, 0.0, 0.9], np.float32))
    np.testing.assert_allclose(faint[[8, 22], [30, 10], 0], [255 * (1 - 0.2), 255 * (1 - 0.3)], atol=2)


def test_a_mesh_lets_through_what_lies_below() -> None:
    """One of half opacity that faces the viewer is half its colour; a nearer side hides the further one.

    What that does not let through is its own opacity, not the product of both.
    """
    assert int(square((0, 0, 0), 0.5)[8, 8, 0]) == pytest.approx(127, abs=1)
    two = np.concatenate([SQUARE, SQUARE + f32(0, 0, 9)])
    opacities = np.repeat(np.float32([1.0, 0.4]), 4)
    mesh = Mesh(two, np.concatenate([HALVES, HALVES + 4]), (0, 0, 0), opacities, "mesh")
    np.testing.assert_allclose(single(mesh)[15, 20], 255 * 0.6, atol=2)


def test_an_ellipse_passes_through_the_ends_of_its_half_axes() -> None:
    """The outline goes through centre +- each half axis, whatever their directions; a dashed one has gaps."""
    axes = f32([30, 12], [-10, 25])
    picture = single(Ellipse(f32(60, 50, 0), axes, (0, 0, 0), 2.0, "sigma"), 120, 100)
    for end in (*axes, *-axes):
        assert near(picture, f32(60, 50) + end) > 400
    solid, dashed = (ink(single(EVERY[name])).sum() for name in ("ellipse", "dashed"))
    assert 0.3 < dashed / solid < 0.8


def black_ellipsoid(*variances: float) -> np.ndarray:
    spread, colour = np.diag(f32(*variances))[None], np.uint8([(0, 0, 0)])
    return single(Ellipsoids(f32([60, 50, 0]), spread, colour, 0.5, "bodies"), 120, 100)


def test_an_ellipsoid_is_seen_by_its_outline() -> None:
    """Its spread across the line of sight, two standard deviations, is opaque at the rim and faint within.

    Seen from its edge a flat one is a line.
    """
    picture = black_ellipsoid(100.0, 25.0, 900.0)
    for place in ((80, 50), (40, 50), (60, 60), (60, 40)):
        assert near(picture, place) > 500
    assert int(picture[50, 60, 0]) == pytest.approx(127, abs=2)
    assert ink(picture)[50, 83:].sum() == 0
    flat = ink(black_ellipsoid(100.0, 0.0, 100.0))
    assert flat[50, 45:75].min() > 300
    assert flat[:48].sum() == 0


def test_an_arrow_has_its_head_at_its_end() -> None:
    """There it is wider than its line, and ends in a point."""
    picture = single(shapes.Arrows(f32([[10, 50, 0], [100, 50, 0]]), (0, 0, 0), 3.0, "arrows"), 120, 100)
    across = (ink(picture) > 300).sum(axis=0)
    assert across[50] == pytest.approx(3, abs=2)
    assert across[83:86].max() > 10
    assert not across[103:].any()


def test_captions_are_written_in_letters_that_there_are() -> None:
    """A caption with signs that the font lacks is written without question marks, and can be left out."""
    signs = Drawing(300, 40, caption="σ 3 × γ · 5°")
    np.testing.assert_array_equal(render(signs), render(Drawing(300, 40, caption="sigma 3 x gamma - 5 deg")))
    assert (ink(render(signs)) > 0).any()
    assert (render(signs, caption=False) == 255).all()


@pytest.mark.parametrize(("width", "scale"), [(0, 1.0), (40, -1.0), (40_000, 100.0)])
def test_impossible_sizes_are_refused(width: int, scale: float) -> None:
    """A picture without pixels or with too many is refused with both sizes."""
    with pytest.raises(ValueError, match="a picture must have 1 to 64000000 pixels, got"):
        render(Drawing(width, 30), scale=scale)
