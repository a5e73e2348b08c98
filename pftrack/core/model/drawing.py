"""Drawings: what a tracker's state looks like, in a dozen primitives that know no viewer; layers, worlds and legends.

An experiment turns a step of a run into a `Drawing`; the library renders drawings to pictures and video
(`pftrack.vision.rendering`), the server renders the same drawings into a 3-D scene. Coordinates are the picture's: x =
column, y = row, in px with the origin at the centre of the top left pixel; z is the height above the picture plane, in
px, towards the viewer; what lies behind the picture, such as the past, has a negative one. A renderer without depth
ignores z. Where a drawing shows the camera itself (`Frustum`), what stands at a height stands on the way from its pixel
to the camera, so that looked at from aside all has its true proportions.

Each primitive names its layer; a viewer lets people switch layers on and off. An experiment lists its layers in the
order in which they are shown. A viewer or a film needs to know their roles and nothing of the experiment. Colours are
the palette's.
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

# The palette: every colour that carries a meaning, once, for scenes, films, figures, maps and pages.
#
# All are, or are mixed from, the eight colours of Okabe and Ito (Color Universal Design, 2008), which can be
# distinguished without red and green. A colour is sRGB, (red, green, blue) of 0 to 255; `hexadecimal` writes it as CSS,
# matplotlib reads it. Where a page has a dark form of a colour, a `Themed` pair holds both. The colours stand in
# `palette.yaml` beside this file.

Level: TypeAlias = Annotated[int, Field(ge=0, le=255)]
Colour: TypeAlias = tuple[Level, Level, Level]


class Themed(NamedTuple):
    """A colour on a light ground, and what stands for it on a dark one."""

    light: Colour
    dark: Colour


class Palette(BaseModel):
    """What `palette.yaml` declares.

    Attributes:
        okabe_ito: The eight colours by their authors' names.
        viridis: Map of amounts in equal steps.
        colours: One colour a meaning, the same in scene, plots, video and maps.
        curves: Of the curves of one figure, in order.
        branches: Of a session's branches, the active one first.
        verdicts: Outcome of a test between two methods.
        diverging: Map of differences in equal steps: second method ahead, neither, first method ahead.
        neutrals: Greys of a figure's furniture, by use.
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
        meaning: What it stands for, a few words.

    Raises:
        ValueError: There is no such colour.
    """

    colour: str
    meaning: str

    def __post_init__(self) -> None:
        """Refuse a colour that has no meaning."""
        if self.colour not in COLOURS:
            raise ValueError(f"there is no colour {self.colour!r}; there are {', '.join(COLOURS)}")


@dataclass(frozen=True, slots=True)
class Layer:
    """What can be switched on and off in a drawing.

    A layer "through time" has the frames of the run, a density or space as its third direction, which is worth seeing
    from aside only; there it takes the place of layers that are "flat only". A viewer without depth shows the latter.

    Attributes:
        name: What primitives call it.
        title: What it is called on the screen; its name with a capital letter by default.
        shown: Whether it is at first.
        legend: What colours mean on it, where that is not plain.
        role: What a viewer with depth may do with it.
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
    """Return what the colours of some layers mean, each meaning once, in the palette's order."""
    return sort_keys(key for layer in layers for key in layer.legend)


def sort_keys(keys: Iterable[Key]) -> tuple[Key, ...]:
    """Return keys, each once, in the palette's order."""
    return tuple(sorted(dict.fromkeys(keys), key=lambda key: list(COLOURS).index(key.colour)))


# A drawing lives in the picture's space. What has a shape of its own, such as the model of a head, is better seen in a
# world as well: in its own coordinates and unit, at rest while the picture moves, from all sides. An experiment
# declares its worlds, as it declares its layers; each drawing then says what there is in them. Only widths of lines
# stay px of the screen.
#
# A world is right-handed. It is seen without perspective, so that equal lengths look equal and a ruler holds
# everywhere: what lies within `radius` of its middle is seen from each side and at one scale.

Vector: TypeAlias = tuple[float, float, float]

RULERS = (5.0, 2.0, 1.0)
"""A ruler's length is one of these times a power of ten."""
RULER_SHARE = 0.5
"""The longest ruler, as a share of the world's radius."""
SQUARE = 1e-6
"""How far from a right angle `front` and `up` may be, as a cosine."""


@dataclass(frozen=True, slots=True)
class Viewpoint:
    """A side from which to look at a world.

    Attributes:
        name: Name in commands and addresses.
        title: On its button.
        azimuth_deg: How far to the right of the front the viewer stands, going round the upright axis.
        elevation_deg: How far above the middle, -90 to 90.

    Raises:
        ValueError: An angle is not finite, or the elevation is beyond the poles.
    """

    name: str
    title: str
    azimuth_deg: float
    elevation_deg: float

    def __post_init__(self) -> None:
        """Refuse a viewpoint that is nowhere."""
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
"""Three viewpoints that suit most objects."""


@dataclass(frozen=True)
class World:
    """A space with a unit, an extent, an upright axis and sides from which to look at it.

    Attributes:
        name: Name in drawings.
        title: What it is called on the screen.
        unit: Of its coordinates, such as "mm".
        middle: (x, y, z) around which it turns.
        radius: How far from there it extends.
        up: Direction that is shown upwards.
        front: Direction from the middle towards somebody who looks from the front, at right angles to `up`.
        viewpoints: Where to look from; the first is the one to begin with.

    Raises:
        ValueError: A number is not finite, the radius is not positive, `up` and `front` are not at right angles, or
            there is no viewpoint or two of one name.
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
        """Refuse a world that cannot be shown."""
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
        """Length of the ruler that is drawn beside it, a round number in its unit."""
        longest = RULER_SHARE * self.radius
        power = 10.0 ** np.floor(np.log10(longest))
        return float(next(length for length in RULERS if length * power <= longest * (1.0 + 1e-9)) * power)

    def turn(self, azimuth_deg: float, elevation_deg: float) -> Floats:
        """Return the directions (3, 3) that a viewer sees to the right, downwards and towards himself, as rows."""
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
"""Width of a picture, where letters are 12 px high, from which on there is room for names that are written out."""


LIFT = 1.0 / 6.0
"""Height above the picture of the heaviest particle, and of the top of a relief, as a share of the longer side."""


@dataclass(frozen=True, slots=True)
class Picture:
    """The frame itself, lying in the plane z = 0.

    Attributes:
        image_rgb: (height, width, 3) uint8.
        layer: That it is on.
        relief: (rows, columns) 0..1, the first in the middle of the first of equal cells: how high what is mapped over
            the picture stands there, which only a viewer with depth shows; None without.
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
        size: Of a point, px.
        layer: That it is on.
        stems: Whether each stands on a thin line from the picture, which only a viewer with depth shows.
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
        faces: (m, 3) numbers of vertices, clockwise as they are seen from outside.
        colour: Of all of it, or (n, 3) RGB of the vertices, between which it changes gradually.
        opacity: Of all of it, 0..1, or (n,) of the vertices.
        layer: That it is on.

    Raises:
        ValueError: There is not one colour or opacity for each vertex.
    """

    vertices: NDArray[np.float32]
    faces: NDArray[np.int32]
    colour: Colour | NDArray[np.uint8]
    opacity: float | NDArray[np.float32]
    layer: str

    def __post_init__(self) -> None:
        """Refuse colours and opacities that do not belong to the vertices."""
        count = len(self.vertices)
        for what, values, shape in (("colour", self.colour, (count, 3)), ("opacity", self.opacity, (count,))):
            if isinstance(values, np.ndarray) and values.shape != shape:
                raise ValueError(f"expected one {what} or an array of shape {shape}, got one of {values.shape}")

    @property
    def is_uniform(self) -> bool:
        """Whether all of it has the same colour and opacity."""
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
    """Arrows (n, 2, 3) float32, px, each from its first position to its second, where its head is."""

    segments: NDArray[np.float32]
    colour: Colour
    width: float
    layer: str


@dataclass(frozen=True, slots=True)
class Ellipsoids:
    """Gaussian beliefs in places, as ellipsoids.

    Attributes:
        centres: (n, 3) px.
        covariances: (n, 3, 3) px^2; one that is flat is shown as a disc.
        colours: (n, 3) RGB.
        opacity: Of their inside, 0..1; their outline is opaque.
        layer: That they are on.
        sigmas: How many standard deviations they extend.

    Raises:
        ValueError: There is not one covariance and one colour for each centre.
    """

    centres: NDArray[np.float32]
    covariances: NDArray[np.float32]
    colours: NDArray[np.uint8]
    opacity: float
    layer: str
    sigmas: float = 2.0

    def __post_init__(self) -> None:
        """Refuse covariances and colours that do not belong to the centres."""
        count = len(self.centres)
        for what, values, shape in (("covariances", self.covariances, (3, 3)), ("colours", self.colours, (3,))):
            if values.shape != (count, *shape):
                raise ValueError(f"expected {what} of shape {(count, *shape)}, got {values.shape}")


@dataclass(frozen=True, slots=True)
class Text:
    """A short label.

    Attributes:
        position: (3,) where it is, px.
        text: What it says.
        colour: Of its letters.
        layer: That it is on.
        anchor: Which part of the line is at the position.
        title: What the text is short for, written instead of it where the picture is at least `TITLES_FROM_PX` wide,
            and said under a pointer; empty where the text says it all.
        point: (3,) what it is the name of, px; None if nothing but what is at its position.
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
    """The pinhole camera that took the picture: its centre, and the rays from there through the picture's corners.

    It sees the picture as it is, so a renderer without depth leaves it out: to be seen, it has to be seen from aside.

    Attributes:
        apex: (3,) the centre; x and y are the principal point, z is the focal length, px.
        corners: (4, 3) of the picture, in order around it, px.
        colour: Of its edges.
        width: Of its edges, px.
        layer: That it is on.
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
    """What is to be seen of one frame in a world of its own.

    Attributes:
        world: One that the experiment declares.
        primitives: In the world's coordinates and unit, in painting order, by a name that stays the same.

    Raises:
        TypeError: A primitive belongs to a picture only.
    """

    world: World
    primitives: dict[str, Primitive] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Refuse what cannot be turned about in space."""
        for name, item in self.primitives.items():
            if isinstance(item, Picture | Frustum | Ellipse):
                raise TypeError(f"a {type(item).__name__} belongs to a picture, not to the world of {name!r}")


@dataclass(frozen=True, slots=True)
class Drawing:
    """All that is to be seen of one frame.

    Attributes:
        width: Extent of the picture along x, px.
        height: Extent along y, px.
        primitives: In painting order, by a name that stays the same from frame to frame, so that a viewer can update
            what it already shows.
        caption: One line of text about the frame.
        worlds: What is to be seen beside the picture, in the order in which the experiment declares its worlds.
        legend: Layers that show something, each with a key of what is drawn on it; filled in by whoever shows a run.
        grip: Where the estimate is, (3,) px, of a drawing in which it and the particles on stems can be moved.
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
        """Where the camera stands, (3,) px; None if it is not drawn, and as good as infinitely far away."""
        return next((item.apex for item in self.primitives.values() if isinstance(item, Frustum)), None)


MOST_DRAWN = 5000
"""A browser moves this many points at thirty frames a second; of more, an even selection is drawn."""


def drawn_particles(count: int) -> NDArray[np.int64]:
    """Return the numbers (n,) of the particles that a drawing of `count` particles shows, n <= `MOST_DRAWN`."""
    return np.linspace(0, count - 1, min(count, MOST_DRAWN)).astype(np.int64)


def from_front(drawing: Drawing, layers: Iterable[Layer]) -> Drawing:
    """Return a drawing without what is worth seeing from aside only, on layers as its experiment declares them."""
    deep = {layer.name for layer in layers if layer.role == "through time"}
    seen = {name: item for name, item in drawing.primitives.items() if item.layer not in deep}
    flat = {name: replace(it, relief=None) if isinstance(it, Picture) else it for name, it in seen.items()}
    return replace(drawing, primitives=flat)


# An experiment declares keys of the legend for all that any of its trackers may draw. A Kalman filter draws no
# particles, and a filter without observation proposals none in that colour; so keys are looked up among what was drawn.

EXTENTS = ("positions", "segments", "centres", "vertices")
"""Fields of primitives that hold as many places as there are to draw."""


def drawn_keys(drawing: Drawing, layers: Iterable[Layer]) -> tuple[tuple[str, Key], ...]:
    """Return the keys of a legend that a drawing needs, each with the name of its layer.

    Args:
        drawing: What is to be seen.
        layers: As its experiment declares them. A layer that shows something, but in none of its keys' colours, as with
            shades of them, needs all its keys.
    """
    items = [*drawing.primitives.values(), *(item for world in drawing.worlds for item in world.primitives.values())]
    return tuple((layer.name, key) for layer in layers if layer.legend for key in _keys(layer, items))


def _keys(layer: Layer, items: Iterable[Primitive]) -> tuple[Key, ...]:
    drawn = [colours for item in items if item.layer == layer.name for colours in _colours(item)]
    found = tuple(key for key in layer.legend if any(_has(colours, COLOURS[key.colour]) for colours in drawn))
    return found or (layer.legend if drawn else ())


def _colours(item: Primitive) -> Iterator[NDArray[np.uint8]]:
    """Yield the colours (n, 3) RGB of a primitive, if anything of it is seen."""
    if any(len(getattr(item, name, "?")) == 0 for name in EXTENTS):
        return
    colours = getattr(item, "colours", getattr(item, "colour", None))
    if colours is not None:
        yield np.atleast_2d(np.asarray(colours, dtype=np.uint8))


def _has(colours: NDArray[np.uint8], colour: tuple[int, int, int]) -> bool:
    return bool((colours == np.array(colour, dtype=np.uint8)).all(axis=1).any())
