"""The flat view's painter: every primitive where the film has it, to half a pixel."""

import base64
import itertools
from collections.abc import Callable, Iterator
from typing import Any, TypeAlias

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from pftrack.core.model import drawing as model
from pftrack.core.model.drawing import Drawing, Links, Mesh, Picture, Points, Polyline, Primitive, Text, WorldDrawing
from pftrack.vision.rendering import look_at, render
from pftrack_server.sessions.worker.codec import DrawingEncoder
from tests.browser.host import Server
from tests.vision.ink import f32

Image: TypeAlias = NDArray[np.uint8]
Paint: TypeAlias = Callable[..., Image]
Side: TypeAlias = tuple[float, float]

WIDTH, HEIGHT = 80, 60
BLUE = model.COLOURS["estimate"]
PURE = np.array([[BLUE]], np.uint8)

# Paints a message on its own canvas and returns a PNG file.
PAINT = """async ([message, scale, hidden, side]) => {
    const [{ decode }, { paint }, { Pictures }, { paintWorld }] = await Promise.all(
        ['drawing', 'paint', 'flat_view', 'world_view'].map((name) => import(`./static/session/flat/${name}.js`)));
    const drawing = decode(Uint8Array.from(atob(message), (letter) => letter.charCodeAt(0)).buffer);
    const bitmaps = await new Pictures().of(drawing, 1);
    const canvas = document.createElement('canvas');
    const [width, height] = [Math.round(drawing.width * scale), Math.round(drawing.height * scale)];
    Object.assign(canvas, { width, height });
    const context = canvas.getContext('2d', { alpha: false });
    const surface = { context, width, height, scale, density: 1, picture: (key) => bitmaps.get(key) };
    if (side) paintWorld(context, drawing.worlds[0], ...side, (layer) => !hidden.includes(layer), scale);
    else paint(surface, drawing, (layer) => !hidden.includes(layer));
    return canvas.toDataURL('image/png').split(',')[1];
}"""


@pytest.fixture(scope="module")
def paint(chromium: Any, server: Server) -> Iterator[Paint]:
    """Paint a drawing as the page does, or a world from a side: (rows, columns, 3) RGB."""
    page = chromium.new_page(base_url=f"{server.url}/")
    page.goto("healthz")

    def painted(
        drawn: Drawing | WorldDrawing, scale: float = 1.0, hidden: tuple[str, ...] = (), side: Side | None = None
    ) -> Image:
        drawing = drawn if isinstance(drawn, Drawing) else Drawing(100, 100, worlds=(drawn,))
        message = base64.b64encode(DrawingEncoder().encode(drawing, 0).message()).decode()
        seen = side or ((0.0, 0.0) if drawing is not drawn else None)
        file = base64.b64decode(page.evaluate(PAINT, [message, scale, list(hidden), seen]))
        image = cv2.imdecode(np.frombuffer(file, np.uint8), cv2.IMREAD_COLOR)
        assert image is not None
        return cv2.cvtColor(image, cv2.COLOR_BGR2RGB).astype(np.uint8)

    yield painted
    page.close()


def cloud(count: int) -> Points:
    places = np.random.default_rng(3).normal((44.3, 27.6, 0.0), (6.0, 4.0, 0.0), (count, 3)).astype(np.float32)
    return Points(places, np.tile(np.uint8([BLUE]), (count, 1)), 3.0)


def disc() -> Image:
    """A picture with a blue disc off its middle."""
    image = np.full((HEIGHT, WIDTH, 3), 255, np.uint8)
    cv2.circle(image, (25, 38), 9, BLUE, cv2.FILLED)
    return image


CORNERS = f32([18.2, 10.1, 0], [66.6, 14.3, 4], [30.4, 49.7, 2], [60.3, 44.8, 9])
FACES = np.array([[0, 1, 2], [1, 3, 2]], np.int32)
SPREAD = f32([[60, 25, 3], [25, 40, 2], [3, 2, 9]])
EVERY: dict[str, Primitive] = {
    "picture": Picture(disc()),
    "cloud": cloud(300),
    "dense cloud": cloud(6000),
    "line": Polyline(f32([10.4, 8.2, 0], [60.7, 20.1, 3], [62.5, 26.6, 0]), BLUE, 2.0, "trail"),
    "gap": Polyline(f32([10.4, 8.2, 0], [np.nan, 20.1, 3], [35.5, 50.6, 0]), BLUE, 2.0, "trail"),
    "dashed": model.Ellipse(f32(41.2, 27.9, 0), f32([18, 5], [-4, 11]), BLUE, 2.0, "gate", dashed=True),
    "ellipsoid": model.Ellipsoids(f32([41.2, 27.9, 0]), SPREAD, np.uint8([BLUE]), 0.4, "bodies"),
    "arrow": model.Arrows(f32([[12.4, 9.1, 0], [60.7, 40.3, 3]]), BLUE, 2.0, "arrows"),
    "axes": model.Axes(f32(33.3, 25.5, 0), f32([0.8, -0.6, 0], [0.6, 0.8, 0], [0, 0, 1]), 20.0, BLUE, 2.0, "axes"),
    "mesh": Mesh(CORNERS, FACES, BLUE, 0.8, "solid"),
    "links": Links(f32([[12, 9, 0], [30.5, 14, 0]], [[12, 14, 0], [30.5, 9, 0]]), BLUE, 2.0, "links"),
    "text": Text(f32(20.0, 30.0, 0), "HHH", BLUE, "labels"),
    "middle": Text(f32(40.0, 30.0, 0), "HHH", BLUE, "labels", anchor="middle"),
    "end": Text(f32(60.0, 30.0, 0), "HHH", BLUE, "labels", anchor="end", title="HHHHHHHHHHH"),
}


def blue(image: Image) -> NDArray[np.float64]:
    """How blue each pixel is; paper and the rims of letters are not."""
    signed = image.astype(float)
    return np.clip(signed[..., 2] - signed[..., 0], 0, None)


def centre(image: Image) -> NDArray[np.float64]:
    """Centre of the ink, (x, y) px."""
    weights = blue(image)
    places = np.indices(weights.shape)[::-1]
    return (places * weights).sum(axis=(1, 2)) / weights.sum()


def apart(one: Image, other: Image) -> NDArray[np.float64]:
    """By how much, (x, y) px, the first must be moved to look most like the second: bold or thin lines count alike."""
    still, moving = (cv2.GaussianBlur(blue(image), (0, 0), 1.0) for image in (other, one))
    steps = np.arange(-1.5, 1.6, 0.25)

    def unlike(way: tuple[float, float]) -> float:
        moved = cv2.warpAffine(moving, np.array([[1, 0, way[0]], [0, 1, way[1]]]), moving.shape[::-1])
        return float(((moved - still) ** 2).sum())

    return np.array(min(itertools.product(steps, steps), key=unlike))


@pytest.mark.parametrize("name", EVERY)
def test_a_primitive_stands_where_the_film_has_it(paint: Paint, name: str) -> None:
    """At any scale the centre of its ink is that of the film, to half a pixel of the canvas.

    Letters agree to a whole pixel, since the film has its own font on whole pixels, and to two where they end at
    their position, since a line of the film is longer. Anything else covers the same pixels in both, to a pixel at
    the edge.
    """
    drawing, is_text = Drawing(WIDTH, HEIGHT, {name: EVERY[name]}), isinstance(EVERY[name], Text)
    for scale in (2.3, 0.7):
        film, canvas = render(drawing, scale=scale), paint(drawing, scale)
        if name != "arrow":
            atol = {"text": 1.0, "middle": 1.0, "end": 2.0}.get(name, 0.5)
            np.testing.assert_allclose(centre(canvas), centre(film), atol=atol)
        covers = [blue(image) / blue(PURE).max() for image in (film, canvas)]
        for one, other in (covers, covers[::-1]):
            nearby = cv2.dilate(other, np.ones((3, 3)))
            assert is_text or (nearby[one > 0.7] > 0).all(), scale


WORLD = model.World("head", "Head", "mm", 40.0, middle=(5.0, -3.0, 8.0), up=(0.0, -1.0, 0.0), front=(0.0, 0.0, -1.0))
SPREADS = f32(*SPREAD, [[9, 0, -4], [0, 0, 0], [-4, 0, 30]])
IN_WORLD: dict[str, Primitive] = {
    "cloud": Points(cloud(300).positions - f32(40, 30, 0), cloud(300).colours, 1.5),
    "line": Polyline(f32([-10.4, 8.2, 0], [20.7, 20.1, 13], [22.5, -16.6, 4]), BLUE, 2.0, "trail"),
    "ellipsoids": model.Ellipsoids(f32([11.2, 7.9, 4], [-9, 3, 12]), SPREADS, np.uint8([BLUE, BLUE]), 0.4, "bodies"),
    "axes": model.Axes(f32(3.3, 5.5, 0), f32([0.8, -0.6, 0], [0.6, 0.8, 0], [0, 0, 1]), 20.0, BLUE, 2.0, "axes"),
    "mesh": Mesh(CORNERS - f32(40, 30, 0), FACES, np.uint8([BLUE] * 4), f32(1, 0.6, 0.9, 1), "solid"),
    "links": Links(f32([[12, 9, 0], [30.5, 14, 5]], [[12, 14, 0], [-10.5, 9, 9]]), BLUE, 2.0, "links"),
    "arrows": model.Arrows(f32([[-12, 9, 0], [20.5, 14, 15]], [[2, 14, 0], [-10.5, -9, -9]]), BLUE, 2.0, "arrows"),
    "text": Text(f32(2.0, 10.0, 5.0), "HHH", BLUE, "labels", anchor="middle"),
}


@pytest.mark.parametrize("name", IN_WORLD)
def test_a_primitive_of_a_world_stands_where_the_film_has_it(paint: Paint, name: str) -> None:
    """Seen from any side, to half a pixel of the canvas; letters to a whole one, as in a picture."""
    drawn, item = WorldDrawing(WORLD, {name: IN_WORLD[name]}), IN_WORLD[name]
    for side, scale in (((-35.0, 15.0), 2.3), ((140.0, -50.0), 1.0), ((0.0, 90.0), 1.0)):
        seen = look_at(drawn, model.Viewpoint("v", "V", *side), 100)
        film, canvas = render(seen, scale=scale, caption=False), paint(drawn, scale, side=side)
        assert canvas.shape == film.shape
        assert np.abs(apart(canvas, film)).max() <= (1.0 if isinstance(item, Text) else 0.5)


def test_a_ruler_is_as_long_as_in_the_film(paint: Paint) -> None:
    """Its line covers the same pixels, at the world's scale."""
    drawn = WorldDrawing(WORLD)
    film, canvas = (
        (image[92:, :] < 200).all(axis=2)
        for image in (render(look_at(drawn, model.Viewpoint("v", "V", 0, 0), 100), caption=False), paint(drawn))
    )
    assert film.any()
    np.testing.assert_allclose(*(np.flatnonzero(each.any(axis=0))[[0, -1]] for each in (canvas, film)), atol=1)


def test_what_comes_later_lies_above(paint: Paint) -> None:
    """Primitives are painted in the drawing's order, each over what was there."""
    red, green = (np.array([colour], np.uint8) for colour in ((255, 0, 0), (0, 255, 0)))
    items: dict[str, Primitive] = {
        "picture": Picture(disc()),
        "below": Points(f32([25, 38, 0]), red, 9.0, "below"),
        "above": Points(f32([25, 38, 9]), green, 5.0, "above"),
    }
    drawing = Drawing(WIDTH, HEIGHT, items)
    image = paint(drawing)
    assert (tuple(image[38, 25]), tuple(image[38, 28])) == ((0, 255, 0), (255, 0, 0))
    assert tuple(paint(drawing, hidden=("above",))[38, 25]) == (255, 0, 0)
    np.testing.assert_allclose(paint(drawing, hidden=("above", "below"))[38, 25], BLUE, atol=3)


def test_a_mesh_may_have_a_colour_and_an_opacity_for_each_vertex(paint: Paint) -> None:
    """Each face has the mean of its corners' colours and opacities, and is shaded as in the film."""
    vertices = f32([2, 2, 0], [40, 2, 20], [2, 56, 5], [40, 56, 0], [78, 2, 30], [78, 56, 0])
    faces = np.array([[0, 1, 2], [1, 3, 2], [1, 4, 3], [4, 5, 3]], np.int32)
    colours = np.array([[255, 0, 0], [0, 255, 0], [0, 0, 255], [200, 200, 0], [0, 90, 90], [30, 30, 30]], np.uint8)
    opacities = f32(1, 0.4, 0.9, 0.2, 0.7, 1)
    mesh = Mesh(vertices, faces, colours, opacities, "m")
    drawing = Drawing(WIDTH, HEIGHT, {"picture": Picture(disc()), "mesh": mesh})
    film, canvas = render(drawing), paint(drawing)
    for x, y in ((10, 10), (34, 48), (48, 12), (70, 48)):
        np.testing.assert_allclose(canvas[y, x].astype(int), film[y, x].astype(int), atol=4)


@pytest.mark.parametrize("shift", [(1e9, -1e9, 0), (np.nan, np.nan, np.nan), (np.inf, 0, 0)])
def test_what_lies_outside_or_is_not_finite_does_no_harm(paint: Paint, shift: tuple[float, float, float]) -> None:
    """A lost tracker may draw far outside or nowhere: the paper stays white. A camera does not see its own frustum."""
    away = f32(*shift)
    colours = [cloud(count).colours for count in (9, 6000)]
    corners = f32([-0.5, -0.5, 0], [39.5, -0.5, 0], [39.5, 29.5, 0], [-0.5, 29.5, 0])
    items: dict[str, Primitive] = {
        **{str(len(each)): Points(cloud(len(each)).positions + away, each, 3.0) for each in colours},
        "line": Polyline(f32([5, 5, 0], [30, 20, 0]) + away, BLUE, 2.0, "trail"),
        "ellipse": model.Ellipse(f32(20, 15, 0) + away, f32([8, 0], [0, 5]), BLUE, 1.0, "sigma"),
        "axes": model.Axes(f32(20, 15, 0) + away, np.eye(3, dtype=np.float32), 10.0, BLUE, 2.0, "axes"),
        "mesh": Mesh(CORNERS + away, FACES, BLUE, 1.0, "mesh"),
        "links": Links(f32([[5, 5, 0], [9, 9, 0]]) + away, BLUE, 1.0, "links"),
        "text": Text(f32(5, 20, 0) + away, "lost", BLUE, "labels"),
        "camera": model.Frustum(f32(20, 15, 40), corners, BLUE, 1.0, "camera"),
    }
    assert (paint(Drawing(WIDTH, HEIGHT, items)) == 255).all()
