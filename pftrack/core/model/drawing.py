"""Drawings: the state of a tracker as a dozen primitives that are independent of viewers; layers, worlds and legends.

An experiment turns a step of a run into a `Drawing`. The library renders drawings to pictures and video
(`pftrack.vision.rendering`), the server renders them into a 3-D scene. Coordinates are those of the picture: x =
column, y = row, in px with the origin at the centre of the top left pixel; z is the height above the picture plane
towards the viewer, px, and negative behind the picture, for example for the past. A renderer without depth ignores z.
If a drawing has a camera (`Frustum`), a raised object lies on the line from its pixel to the camera, so that it has its
true proportions from every side.

Each primitive names its layer; people switch layers on and off in a viewer. An experiment lists its layers in the order
of display. A viewer or a film depends on their roles only, not on the experiment. Colours are those of the palette.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Annotated, Literal, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field

from pftrack.core.arrays import Floats
from pftrack.core.texts import read_whole

# The palette: all colours with a meaning, for scenes, films, figures, maps and pages.
#
# They are the eight colours of Okabe and Ito (Color Universal Design, 2008) or mixtures of them, which colour-blind
# people can distinguish. A colour is sRGB (red, green, blue), each 0 to 255; `hexadecimal` writes it for CSS and
# matplotlib. A `Themed` pair holds a colour for the light and one for the dark theme. The colours are in
# `palette.yaml`.

Level: TypeAlias = Annotated[int, Field(ge=0, le=255)]
Colour: TypeAlias = tuple[Level, Level, Level]


class Themed(NamedTuple):
    """A colour for the light theme and its counterpart for the dark one."""

    light: Colour
    dark: Colour


class Palette(BaseModel):
    """The content of `palette.yaml`.

    Attributes:
        okabe_ito: The eight colours by their authors' names.
        viridis: Colour map of amounts in equal steps.
        colours: Colours by meaning, for scenes, plots, video and maps.
        curves: Colours of the curves in one figure, in order.
        branches: Colours of a session's branches, the active one first.
        verdicts: Colours of the outcomes of a test between two methods.
        diverging: Colour map of differences in equal steps, from "second better" over "equal" to "first better".
        neutrals: Greys of axes, grids and frames, by use.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    okabe_ito: dict[str, Colour]
    viridis: tuple[Colour, ...]
    colours: dict[str, Colour]
    curves: tuple[Colour, ...]
    branches: tuple[Colour, ...]
    verdicts: dict[str, Themed]
    diverging: tuple[Themed, ...]
    neutrals: dict[str, Colour]


_PALETTE = read_whole(Palette, Path(__file__).with_name("palette.yaml"))
OKABE_ITO, VIRIDIS, COLOURS = _PALETTE.okabe_ito, _PALETTE.viridis, _PALETTE.colours
CURVES, BRANCHES, VERDICTS = _PALETTE.curves, _PALETTE.branches, _PALETTE.verdicts
DIVERGING, NEUTRALS = _PALETTE.diverging, _PALETTE.neutrals


def hexadecimal(colour: Colour) -> str:
    """Return a colour as "#rrggbb"."""
    return "#{:02x}{:02x}{:02x}".format(*colour)


LayerRole: TypeAlias = Literal["", "through time", "flat only"]


@dataclass(frozen=True, slots=True)
class Key:
    """An entry of the legend.

    Attributes:
        colour: Name of a colour in `pftrack.core.model.drawing.COLOURS`.
        meaning: Meaning in a few words.

    Raises:
        ValueError: The colour is unknown.
    """

    colour: str
    meaning: str

    def __post_init__(self) -> None:
        """Refuse an unknown colour."""
        if self.colour not in COLOURS:
            raise ValueError(f"there is no colour {self.colour!r}; there are {', '.join(COLOURS)}")


@dataclass(frozen=True, slots=True)
class Layer:
    """A part of a drawing that can be switched on and off.

    A layer "through time" has frames of the run, a density or space as its third dimension. It is shown only from the
    side, instead of the layers that are "flat only", which viewers without depth show.

    Attributes:
        name: Name in primitives.
        title: Title on the screen; by default its name with a capital letter.
        shown: Whether it is visible at first.
        legend: Meanings of its colours, where needed.
        role: How a viewer with depth shows it.
    """

    name: str
    title: str = ""
    shown: bool = True
    legend: tuple[Key, ...] = ()
    role: LayerRole = ""

    def __post_init__(self) -> None:
        """Make a title from the name."""
        if not self.title:
            object.__setattr__(self, "title", self.name[:1].upper() + self.name[1:])


def legend(layers: Iterable[Layer]) -> tuple[Key, ...]:
    """Return the legend of some layers, each entry once, in the order of the palette."""
    return sort_keys(key for layer in layers for key in layer.legend)


def sort_keys(keys: Iterable[Key]) -> tuple[Key, ...]:
    """Return keys, each once, in the order of the palette."""
    return tuple(sorted(dict.fromkeys(keys), key=lambda key: list(COLOURS).index(key.colour)))


# A drawing is in the space of the picture. An object with a shape, such as the model of a head, is better seen in a
# world, too: in its own coordinates and unit, at rest while the picture moves, and from all sides. An experiment
# declares its worlds and layers, and each drawing fills them. Only widths of lines stay in px of the screen.
#
# A world is right-handed and shown without perspective, so that equal lengths look equal and a ruler is valid
# everywhere. Everything within `radius` of its middle is visible from each side at the same scale.

Vector: TypeAlias = tuple[float, float, float]

RULERS = (5.0, 2.0, 1.0)
"""A ruler's length is one of these times a power of ten."""
RULER_SHARE = 0.5
"""The longest ruler, as a share of the world's radius."""
SQUARE = 1e-6
"""How far from a right angle `front` and `up` may be, as a cosine."""


@dataclass(frozen=True, slots=True)
class Viewpoint:
    """A direction from which to look at a world.

    Attributes:
        name: Name in commands and addresses.
        title: Title of its button.
        azimuth_deg: Angle around the upright axis from the front to the right, degrees.
        elevation_deg: Angle above the middle, -90 to 90 degrees.

    Raises:
        ValueError: An angle is not finite, or the elevation is out of range.
    """

    name: str
    title: str
    azimuth_deg: float
    elevation_deg: float

    def __post_init__(self) -> None:
        """Refuse invalid angles."""
        if not (np.isfinite(self.azimuth_deg) and -90.0 <= self.elevation_deg <= 90.0):
            raise ValueError(
                f"expected a finite azimuth and an elevation of -90 to 90 degrees, got {self.azimuth_deg} and "
                f"{self.elevation_deg}"
            )


FRONT_SIDE_TOP = (
    Viewpoint("front", "Front", 0.0, 0.0),
    Viewpoint("side", "Side", 60.0, 15.0),
    Viewpoint("top", "Top", 0.0, 90.0),
)
"""Three viewpoints for most objects."""


@dataclass(frozen=True)
class World:
    """A space with a unit, an extent, an upright axis and viewpoints.

    Attributes:
        name: Name in drawings.
        title: Title on the screen.
        unit: Unit of its coordinates, such as "mm".
        middle: (x, y, z) centre of rotation.
        radius: Extent around the middle.
        up: Direction shown upwards.
        front: Direction from the middle to a viewer in front, at right angles to `up`.
        viewpoints: Viewpoints; the first one is the initial one.

    Raises:
        ValueError: A number is not finite, the radius is not positive, `up` and `front` are not at right angles, or
            viewpoints are missing or have equal names.
    """

    name: str
    title: str
    unit: str
    radius: float
    middle: Vector = (0.0, 0.0, 0.0)
    up: Vector = (0.0, 1.0, 0.0)
    front: Vector = (0.0, 0.0, 1.0)
    viewpoints: tuple[Viewpoint, ...] = FRONT_SIDE_TOP

    def __post_init__(self) -> None:
        """Refuse invalid numbers and names."""
        if not (np.isfinite([*self.middle, *self.up, *self.front]).all() and 0.0 < self.radius < np.inf):
            raise ValueError(f"the world {self.name!r} must have a finite place and a radius above 0")
        lengths = float(np.linalg.norm(self.up) * np.linalg.norm(self.front))
        if lengths <= 0.0 or abs(float(np.dot(self.up, self.front))) > SQUARE * lengths:
            raise ValueError(f"up and front must be at right angles, got {self.up} and {self.front}")
        names = [viewpoint.name for viewpoint in self.viewpoints]
        if not names or len(set(names)) < len(names):
            raise ValueError(f"expected viewpoints with different names, got {', '.join(names) or 'none'}")

    @property
    def ruler(self) -> float:
        """Length of its ruler, a round number in its unit."""
        longest = RULER_SHARE * self.radius
        power = 10.0 ** np.floor(np.log10(longest))
        return float(next(length for length in RULERS if length * power <= longest * (1.0 + 1e-9)) * power)

    def turn(self, azimuth_deg: float, elevation_deg: float) -> Floats:
        """Return as rows (3, 3) the directions right, down and towards the viewer."""
        front, up, right = self._axes
        azimuth, elevation = np.deg2rad((azimuth_deg, elevation_deg))
        level = np.cos(azimuth) * front + np.sin(azimuth) * right
        towards = np.cos(elevation) * level + np.sin(elevation) * up
        across = np.cos(azimuth) * right - np.sin(azimuth) * front
        return np.stack((across, np.cross(across, towards), towards))

    @cached_property
    def _axes(self) -> Floats:
        front, up = (np.array(axis) / np.linalg.norm(axis) for axis in (self.front, self.up))
        return np.stack((front, up, np.cross(up, front)))


TITLES_FROM_PX = 520.0
"""Smallest width of a picture, with text 12 px high, for names in full."""


LIFT = 1.0 / 6.0
"""Height above the picture of the heaviest particle, and of the top of a relief, as a share of the longer side."""


@dataclass(frozen=True, slots=True)
class Picture:
    """The frame itself, lying in the plane z = 0.

    Attributes:
        image_rgb: (height, width, 3) uint8.
        layer: Layer of the picture.
        relief: (rows, columns) heights 0..1 at the centres of equal cells, for viewers with depth; None without.
    """

    image_rgb: NDArray[np.uint8]
    layer: str = "picture"
    relief: NDArray[np.float32] | None = None


@dataclass(frozen=True, slots=True)
class Points:
    """A cloud of points.

    Attributes:
        positions: (n, 3) float32, px.
        colours: (n, 3) uint8 RGB.
        size: Size of a point, px.
        layer: Layer of the points.
        stems: Whether thin lines join the points with the picture, for viewers with depth.
    """

    positions: NDArray[np.float32]
    colours: NDArray[np.uint8]
    size: float
    layer: str = "particles"
    stems: bool = False


@dataclass(frozen=True, slots=True)
class Polyline:
    """An open line through positions (n, 3) float32, px."""

    positions: NDArray[np.float32]
    colour: Colour
    width: float
    layer: str


@dataclass(frozen=True, slots=True)
class Ellipse:
    """An ellipse in a plane of constant z: centre (3,) and the two half axes as vectors, (2, 2), px."""

    centre: NDArray[np.float32]
    half_axes: NDArray[np.float32]
    colour: Colour
    width: float
    layer: str
    dashed: bool = False


@dataclass(frozen=True, slots=True)
class Axes:
    """A coordinate frame: origin (3,), rotation (3, 3) with the axes as columns, length in px.

    An affine camera may show the axes skewed and of unequal lengths.
    """

    origin: NDArray[np.float32]
    rotation: NDArray[np.float32]
    length: float
    colour: Colour
    width: float
    layer: str


@dataclass(frozen=True, slots=True)
class Mesh:
    """A triangle mesh.

    Attributes:
        vertices: (n, 3) px.
        faces: (m, 3) indices of vertices, clockwise as seen from outside.
        colour: One colour, or (n, 3) RGB of the vertices, interpolated between them.
        opacity: One opacity, 0..1, or (n,) opacities of the vertices.
        layer: Layer of the mesh.

    Raises:
        ValueError: The number of colours or opacities differs from that of the vertices.
    """

    vertices: NDArray[np.float32]
    faces: NDArray[np.int32]
    colour: Colour | NDArray[np.uint8]
    opacity: float | NDArray[np.float32]
    layer: str

    def __post_init__(self) -> None:
        """Refuse colours and opacities of the wrong shape."""
        count = len(self.vertices)
        for what, values, shape in (("colour", self.colour, (count, 3)), ("opacity", self.opacity, (count,))):
            if isinstance(values, np.ndarray) and values.shape != shape:
                raise ValueError(f"expected one {what} or an array of shape {shape}, got one of {values.shape}")

    @property
    def is_uniform(self) -> bool:
        """Whether it has one colour and one opacity."""
        return not (isinstance(self.colour, np.ndarray) or isinstance(self.opacity, np.ndarray))

    @property
    def rgba(self) -> NDArray[np.float32]:
        """Colour and opacity of each vertex, (n, 4), 0..1."""
        values = np.empty((len(self.vertices), 4), dtype=np.float32)
        values[:, :3] = np.asarray(self.colour, dtype=np.float32) / 255.0
        values[:, 3] = self.opacity
        return values


@dataclass(frozen=True, slots=True)
class Links:
    """Separate segments (n, 2, 3) float32, px."""

    segments: NDArray[np.float32]
    colour: Colour
    width: float
    layer: str


@dataclass(frozen=True, slots=True)
class Arrows:
    """Arrows (n, 2, 3) float32, px, each from its first position to its head at the second."""

    segments: NDArray[np.float32]
    colour: Colour
    width: float
    layer: str


@dataclass(frozen=True, slots=True)
class Ellipsoids:
    """Gaussian beliefs about positions, as ellipsoids.

    Attributes:
        centres: (n, 3) px.
        covariances: (n, 3, 3) px^2; a flat one is shown as a disc.
        colours: (n, 3) RGB.
        opacity: Opacity of the inside, 0..1; outlines are opaque.
        layer: Layer of the ellipsoids.
        sigmas: Their radius in standard deviations.

    Raises:
        ValueError: The number of covariances or colours differs from that of the centres.
    """

    centres: NDArray[np.float32]
    covariances: NDArray[np.float32]
    colours: NDArray[np.uint8]
    opacity: float
    layer: str
    sigmas: float = 2.0

    def __post_init__(self) -> None:
        """Refuse covariances and colours of the wrong shape."""
        count = len(self.centres)
        for what, values, shape in (("covariances", self.covariances, (3, 3)), ("colours", self.colours, (3,))):
            if values.shape != (count, *shape):
                raise ValueError(f"expected {what} of shape {(count, *shape)}, got {values.shape}")


@dataclass(frozen=True, slots=True)
class Text:
    """A short label.

    Attributes:
        position: (3,) position, px.
        text: The text.
        colour: Colour of the text.
        layer: Layer of the text.
        anchor: Part of the line that is at the position.
        title: Full form of the text, shown instead of it in pictures at least `TITLES_FROM_PX` wide, and on hover;
            empty if the text is not abbreviated.
        point: (3,) position of the named object, px; None if it is that of the text.
    """

    position: NDArray[np.float32]
    text: str
    colour: Colour
    layer: str
    anchor: Literal["start", "middle", "end"] = "start"
    title: str = ""
    point: NDArray[np.float32] | None = None


@dataclass(frozen=True, slots=True)
class Frustum:
    """The pinhole camera of the picture: its centre, and the rays from there through the corners of the picture.

    It is visible only from the side, so renderers without depth leave it out.

    Attributes:
        apex: (3,) camera centre, px; x and y are the principal point, z is the focal length.
        corners: (4, 3) corners of the picture in order, px.
        colour: Colour of its edges.
        width: Width of its edges, px.
        layer: Layer of the camera.
    """

    apex: NDArray[np.float32]
    corners: NDArray[np.float32]
    colour: Colour
    width: float
    layer: str


Primitive: TypeAlias = (
    Picture | Points | Polyline | Ellipse | Ellipsoids | Axes | Mesh | Links | Arrows | Text | Frustum
)


@dataclass(frozen=True, slots=True)
class WorldDrawing:
    """The drawing of one frame in a world.

    Attributes:
        world: Name of a declared world.
        primitives: Primitives in the world's coordinates and unit, in painting order, by constant names.

    Raises:
        TypeError: A primitive is valid only in a picture.
    """

    world: World
    primitives: dict[str, Primitive] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Refuse primitives that are valid only in a picture."""
        for name, item in self.primitives.items():
            if isinstance(item, Picture | Frustum | Ellipse):
                raise TypeError(f"a {type(item).__name__} belongs to a picture, not to the world of {name!r}")


@dataclass(frozen=True, slots=True)
class Drawing:
    """The drawing of one frame.

    Attributes:
        width: Width of the picture, px.
        height: Height of the picture, px.
        primitives: Primitives in painting order, by constant names, so that a viewer can update them.
        caption: One line of text about the frame.
        worlds: Drawings in worlds, in the order of the declared worlds.
        legend: Pairs of a visible layer and a key; the viewer of a run fills them in.
        grip: (3,) px, position of the estimate if people may move it and the particles on stems; else None.
    """

    width: int
    height: int
    primitives: dict[str, Primitive] = field(default_factory=dict)
    caption: str = ""
    worlds: tuple[WorldDrawing, ...] = ()
    legend: tuple[tuple[str, Key], ...] = ()
    grip: NDArray[np.float32] | None = None

    @property
    def apex(self) -> NDArray[np.float32] | None:
        """Position of the camera, (3,) px; None if it is not drawn and counts as infinitely far away."""
        return next((item.apex for item in self.primitives.values() if isinstance(item, Frustum)), None)


MOST_DRAWN = 5000
"""Most points in a drawing, which a browser moves at 30 Hz; of more points an even selection is drawn."""


def drawn_particles(count: int) -> NDArray[np.int64]:
    """Return the indices (n,) of the drawn particles among `count` particles, n <= `MOST_DRAWN`."""
    return np.linspace(0, count - 1, min(count, MOST_DRAWN)).astype(np.int64)


def from_front(drawing: Drawing, layers: Iterable[Layer]) -> Drawing:
    """Return a drawing without layers that are visible only from the side."""
    deep = {layer.name for layer in layers if layer.role == "through time"}
    seen = {name: item for name, item in drawing.primitives.items() if item.layer not in deep}
    flat = {name: replace(it, relief=None) if isinstance(it, Picture) else it for name, it in seen.items()}
    return replace(drawing, primitives=flat)


# An experiment declares legend keys for everything that any of its trackers draws. A Kalman filter draws no particles,
# and a filter without observation proposals has none of that colour; so only keys of drawn colours are used.

EXTENTS = ("positions", "segments", "centres", "vertices")
"""Fields of primitives with the positions to draw."""


def drawn_keys(drawing: Drawing, layers: Iterable[Layer]) -> tuple[tuple[str, Key], ...]:
    """Return the legend keys of a drawing, each with the name of its layer.

    Args:
        drawing: The drawing.
        layers: Layers of its experiment. A visible layer without any of its keys' colours, for example with shades of
            them, needs all its keys.
    """
    items = [*drawing.primitives.values(), *(item for world in drawing.worlds for item in world.primitives.values())]
    return tuple((layer.name, key) for layer in layers if layer.legend for key in _keys(layer, items))


def _keys(layer: Layer, items: Iterable[Primitive]) -> tuple[Key, ...]:
    drawn = [colours for item in items if item.layer == layer.name for colours in _colours(item)]
    found = tuple(key for key in layer.legend if any(_has(colours, COLOURS[key.colour]) for colours in drawn))
    return found or (layer.legend if drawn else ())


def _colours(item: Primitive) -> Iterator[NDArray[np.uint8]]:
    """Yield the colours (n, 3) RGB of a primitive, if it is visible."""
    if any(len(getattr(item, name, "?")) == 0 for name in EXTENTS):
        return
    colours = getattr(item, "colours", getattr(item, "colour", None))
    if colours is not None:
        yield np.atleast_2d(np.asarray(colours, dtype=np.uint8))


def _has(colours: NDArray[np.uint8], colour: tuple[int, int, int]) -> bool:
    return bool((colours == np.array(colour, dtype=np.uint8)).all(axis=1).any())
