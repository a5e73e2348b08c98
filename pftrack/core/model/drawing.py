"""Drawings: what a tracker's state looks like, in a dozen primitives that know no viewer.

An experiment turns a step of a run into a `Drawing`; the library renders drawings to pictures and video
(`pftrack.vision.rendering`), the server renders the same drawings into a 3-D scene. Coordinates are the picture's: x =
column, y = row, in px with the origin at the centre of the top left pixel; z is the height above the picture plane, in
px, towards the viewer. A renderer without depth ignores z. Where a drawing shows the camera itself (`Frustum`), what
stands at a height stands on the way from its pixel to the camera, so that looked at from aside all has its true
proportions.

Beside the picture there may be worlds of their own (`pftrack.core.model.world`), in which a drawing shows the same
primitives in the world's coordinates: lengths are in its unit, right-handed; only widths of lines stay px of the
screen.

Each primitive names its layer; a viewer lets people switch layers on and off. Colours are the palette's.
"""

from dataclasses import dataclass, field
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from pftrack.core.model.layer import Key
from pftrack.core.model.palette import COLOURS, Colour
from pftrack.core.model.world import World

__all__ = [
    "COLOURS",
    "TITLES_FROM_PX",
    "Arrows",
    "Axes",
    "Colour",
    "Drawing",
    "Ellipse",
    "Ellipsoids",
    "Frustum",
    "Links",
    "Mesh",
    "Picture",
    "Points",
    "Polyline",
    "Primitive",
    "Text",
    "WorldDrawing",
]

TITLES_FROM_PX = 520.0
"""Width of a picture, where letters are 12 px high, from which on there is room for names that are written out."""


@dataclass(frozen=True, slots=True)
class Picture:
    """The frame itself, (height, width, 3) uint8 RGB, lying in the plane z = 0."""

    image_rgb: NDArray[np.uint8]
    layer: str = "picture"


@dataclass(frozen=True, slots=True)
class Points:
    """A cloud of points: positions (n, 3) float32 in px, colours (n, 3) uint8 RGB, one size in px."""

    positions: NDArray[np.float32]
    colours: NDArray[np.uint8]
    size: float
    layer: str = "particles"


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
    """

    width: int
    height: int
    primitives: dict[str, Primitive] = field(default_factory=dict)
    caption: str = ""
    worlds: tuple[WorldDrawing, ...] = ()
    legend: tuple[tuple[str, Key], ...] = ()

    @property
    def apex(self) -> NDArray[np.float32] | None:
        """Where the camera stands, (3,) px; None if it is not drawn, and as good as infinitely far away."""
        return next((item.apex for item in self.primitives.values() if isinstance(item, Frustum)), None)
