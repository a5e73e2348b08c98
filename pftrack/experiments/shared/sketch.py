"""Pieces of drawings that experiments share, and remarks on a target and its surroundings."""

from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pftrack.core.arrays import Floats
from pftrack.core.model.drawing import (
    COLOURS,
    LIFT,
    Colour,
    Drawing,
    Ellipse,
    Frustum,
    Key,
    Layer,
    Links,
    Mesh,
    Picture,
    Points,
    Polyline,
    Primitive,
    Text,
    Viewpoint,
    World,
    WorldDrawing,
    drawn_particles,
    from_front,
)
from pftrack.core.model.setup import Grade
from pftrack.core.model.source import FrameSequence, Target
from pftrack.core.model.tracker import Diagnostics, Step
from pftrack.filters.particles import ParticleSet
from pftrack.vision.likelihoods.separation import Separation
from pftrack.vision.rendering import Projection, viridis

DOT = 1.0 / 160.0
"""Size of a particle, as a share of the picture's longer side."""

BY_SAMPLER = (Key("prediction", "particles from the prediction"), Key("observation", "particles from the observation"))
"""Meaning of the colours of `particle_clouds`."""

SECOND_RUN = Layer("second run", legend=(Key("second", "second run, where it differs"),))
"""Layer of the run with which this one is compared."""

REGION = "region of success"
"""Layer of the edge of where the target counts as held."""

LIGHT, DARK = np.array([198.0, 219.0, 239.0]), np.array([8.0, 48.0, 107.0])


def at_height(positions: Floats, heights: Floats | float = 0.0) -> NDArray[np.float32]:
    """Return positions (..., 2) in px as (..., 3) at the given heights (...) above the picture, px."""
    raised = np.empty((*positions.shape[:-1], 3), dtype=np.float32)
    raised[..., :2] = positions
    raised[..., 2] = heights
    return raised


def distance(estimates: Floats, truths: Floats) -> Any:  # noqa: ANN401 - one or many
    """Return the distances of positions (..., 2) from others, (...)."""
    off = estimates - truths
    return np.hypot(off[..., 0], off[..., 1])


def error_words(row: Diagnostics, unit: str, missed: str = "lost") -> str:
    """Return the error of a frame for its caption, and the verdict of the truth on it; nothing where it is unknown.

    Args:
        row: The frame.
        unit: Unit as written after the number, including a space if needed.
        missed: Word for a target that counts as lost.
    """
    if row.error is None:
        return ""
    return f"error {row.error:.1f}{unit}" + (f", {missed} (by truth)" if row.lost else "")


def caption(row: Diagnostics, *words: str) -> str:
    """Return the caption of a frame: its number and further remarks; empty ones are left out."""
    return " · ".join(filter(None, [f"frame {row.frame}", *words]))


@lru_cache(maxsize=4)
def paper(width: int, height: int) -> NDArray[np.uint8]:
    """Return a white picture."""
    white = np.full((height, width, 3), 255, dtype=np.uint8)
    white.flags.writeable = False
    return white


def colours(count: int, colour: Colour) -> NDArray[np.uint8]:
    """Return one colour for each of so many places, (n, 3) RGB."""
    return np.tile(np.array(colour, np.uint8), (count, 1))


def dots(places: NDArray[Any], colour: Colour, size: float, layer: str, *, height: float = 2.0) -> Points:
    """Draw points at places (n, 2), px, or (n, 3)."""
    placed = at_height(places, height) if places.shape[1] == 2 else places.astype(np.float32)
    return Points(placed, colours(len(placed), colour), size, layer)


def lines(ends: Floats, colour: Colour, width: float, layer: str, *, height: Floats | float = 1.5) -> Links:
    """Draw segments (n, 2, 2), px, or (n, 2, 3)."""
    placed = at_height(ends, height) if ends.shape[-1] == 2 else ends.astype(np.float32)
    return Links(placed, colour, width, layer)


def rectangle(corner: Floats, size: Floats, colour: Colour, layer: str, height: float) -> Polyline:
    """Draw a rectangle whose left top corner (2,) and size (2,) are given, px."""
    ring = np.array(((0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0), (0.0, 0.0)))
    return Polyline(at_height(corner + ring * size, height), colour, 2.0, layer)


def grid_faces(rows: int, columns: int) -> NDArray[np.int32]:
    """Return the triangles (m, 3) between the corners of a grid, which are numbered row by row."""
    first = (columns * np.arange(rows - 1)[:, None] + np.arange(columns - 1)).ravel()
    corners = [first, first + 1, first + columns + 1, first, first + columns + 1, first + columns]
    return np.stack(corners, axis=1).reshape(-1, 3).astype(np.int32)


PAST_FRAMES, PAST = 60, 1.25
"""Number of past frames behind the picture, and their depth, as a share of the picture's longer side."""
TICKS = (20, 40, 60)
"""Frames ago whose outline is drawn."""
THROUGH_TIME = "path through time"


def behind(ages: NDArray[Any], longest: float) -> Floats:
    """Return the heights of what was so many frames ago, (n,) px, behind a picture with a longer side."""
    depths: Floats = -PAST * longest / PAST_FRAMES * ages
    return depths


def paths(
    rows: Sequence[Diagnostics], places: Floats, size: tuple[int, int], flat: str = "trail"
) -> dict[str, Primitive]:
    """Draw where the estimate was in some frames, in the picture and in frames that recede behind it.

    Args:
        rows: Rows of the frames; the last one is now.
        places: (n, 2) in these frames, px.
        size: Size of the picture, width and height.
        flat: Layer of what is drawn in the picture.
    """
    ages = rows[-1].frame - np.array([row.frame for row in rows])
    colour = COLOURS["estimate"]
    return {
        flat: Polyline(at_height(places, 1.0), colour, 2.0, flat),
        "space-time": Polyline(at_height(places, behind(ages, max(size))), colour, 3.0, THROUGH_TIME),
        **past_frames(size, THROUGH_TIME),
    }


def past_frames(size: tuple[int, int], layer: str) -> dict[str, Primitive]:
    """Draw the outlines of past frames behind a picture of a size, and an axis that explains depth and height."""
    width, height = size
    colour, grey = COLOURS["camera"], COLOURS["hidden"]
    corners = np.array([[0, 0], [width, 0], [width, height], [0, height]]) - 0.5
    sides = np.stack([corners, np.roll(corners, -1, axis=0)], axis=1)
    depths = behind(np.array(TICKS), max(size))
    outlines = np.concatenate([at_height(sides, depth) for depth in depths])
    lift = LIFT * max(size)
    axis = at_height(np.tile(corners[3], (2, 1)), np.array([depths[-1], lift]))
    drawn: dict[str, Primitive] = {
        "past frames": Links(outlines, grey, 1.0, layer),
        "axis": Links(axis[None], colour, 1.5, layer),
        "axis weight": Text(axis[1], "weight", colour, layer),
    }
    for age, depth in zip(TICKS, depths, strict=True):
        drawn[f"axis {age}"] = Text(at_height(corners[3], depth), f"{age}", colour, layer, "end")
    # Within the outlines, so a narrow window does not cut it off.
    drawn[f"axis {TICKS[-1]}"] = Text(axis[0], f"{TICKS[-1]} frames ago", colour, layer)
    return drawn


def particle_clouds(
    positions: Floats, particles: ParticleSet, observation_count: int, size: float
) -> dict[str, Points]:
    """Draw particles twice, coloured by the sampler they came from and by weight, each as high as its weight.

    Args:
        positions: (N, 2) where to draw them, px.
        particles: For their weights.
        observation_count: Number of them from the observation sampler; they are the last ones.
        size: Size of a point, px.
    """
    count = len(particles)
    chosen = drawn_particles(count)
    relative = np.exp(particles.log_weights[chosen] - particles.log_weights.max())
    raised = at_height(positions[chosen], 1.0 + LIFT / DOT * size * relative)
    by_sampler = np.empty((len(chosen), 3), dtype=np.uint8)
    by_sampler[:] = COLOURS["prediction"]
    by_sampler[chosen >= count - observation_count] = COLOURS["observation"]
    by_weight = (LIGHT + relative[:, None] * (DARK - LIGHT)).astype(np.uint8)
    return {
        "particles": Points(raised, by_sampler, size, "particles by sampler", stems=True),
        "weights": Points(raised, by_weight, size, "particles by weight", stems=True),
    }


CLEAR_RADII = 1.5
"""Distance of the picture behind a solid's origin, in radii of its points: a head is larger than its features."""

MOST_RAISED = 0.9
"""Nothing is drawn nearer to the camera than a tenth of its focal length, nor behind it."""


def before_camera(depths: Floats, focal_px: float, middle: float, radius: float) -> Floats:
    """Return how high above the picture a drawing shows what is before a pinhole camera, (n,) px.

    Args:
        depths: (n,) in the camera's frame, in any unit.
        focal_px: Focal length of the camera.
        middle: Depth of the solid's origin.
        radius: Radius of its points.
    """
    plane = middle + CLEAR_RADII * radius
    return np.minimum(focal_px * (1.0 - depths / plane), MOST_RAISED * focal_px)


def frustum(principal_px: Floats, focal_px: float, size: tuple[int, int]) -> Frustum:
    """Draw a pinhole camera, a focal length before its picture of a width and a height, px."""
    apex = np.append(principal_px, focal_px).astype(np.float32)
    width, height = size
    border = np.array([[0, 0], [width, 0], [width, height], [0, height]]) - 0.5
    return Frustum(apex, at_height(border), COLOURS["camera"], 1.0, "camera")


FURTHEST = 1e6
"""Distance from the picture's corner, in its sizes, beyond which points are not distinguished."""
STEM_SHARE = 0.02
"""A particle that is less high than this share of the highest one stands on the picture itself."""
GROUND = np.array((1.0, 1.0, 0.0), dtype=np.float32)
RELIEF_OPACITY = 0.8


def raised(item: Primitive, width: float, height: float) -> Links | Mesh | None:
    """Return a primitive's additions in depth: a cloud's stems, a picture's relief.

    Args:
        item: Primitive of a drawing.
        width: Width of the drawing, px.
        height: Height of the drawing, px.
    """
    match item:
        case Points(stems=True) if len(item.positions):
            high = _unhidden(item.positions[item.positions[:, 2] > STEM_SHARE * item.positions[:, 2].max()], item.size)
            return Links(np.stack([high * GROUND, high], axis=1), COLOURS["hidden"], 0.5, item.layer)
        case Picture(relief=levels) if levels is not None:
            rows, columns = levels.shape
            across, down = np.meshgrid(np.arange(columns) + 0.5, np.arange(rows) + 0.5)
            places = np.stack([across.ravel() * width / columns, down.ravel() * height / rows], axis=1) - 0.5
            shares = levels.ravel().astype(np.float64)
            vertices = at_height(places, LIFT * max(width, height) * shares)
            return Mesh(vertices, grid_faces(rows, columns), viridis(shares), RELIEF_OPACITY, item.layer)
        case _:
            return None


def _unhidden(positions: NDArray[np.float32], size: float) -> NDArray[np.float32]:
    """Return the highest of points (n, 3) in each square of a size; its stem hides those of lower ones."""
    falling = np.argsort(-positions[:, 2], kind="stable")
    cells = np.floor(np.nan_to_num(positions[falling, :2] / size).clip(-FURTHEST, FURTHEST)).astype(np.int64)
    _, highest = np.unique(cells[:, 0] + (cells[:, 1] << 32), return_index=True)
    return positions[np.sort(falling[highest])]


IN_DEPTH = "in depth"
"""Name of the world of `with_depth`, and the layer of what is drawn there alone."""
DEPTH_SIDES = (
    Viewpoint("oblique", "Oblique", -43.0, 25.0),
    Viewpoint("side", "Side", -63.0, 17.0),
    Viewpoint("time", "Along time", 0.0, 71.0),
)
"""As in the scene; the picture next to it shows the front."""
LABELS = 1.15
"""Factor of room for the labels of its axis."""


def with_depth(drawing: Drawing, layers: Sequence[Layer]) -> Drawing:
    """Return a drawing from the front, with what is before and behind its picture as a world, for a page without scene.

    Args:
        drawing: The drawing.
        layers: Layers declared by its experiment; the axis on one through time gives the depth of the world.
    """
    flat = from_front(drawing, layers)
    items = {name: item for name, item in drawing.primitives.items() if name not in flat.primitives}
    axis = items.get("axis")
    if not isinstance(axis, Links):
        return flat
    width, height = drawing.width, drawing.height
    clouds = [item for item in drawing.primitives.values() if isinstance(item, Points) and item.stems]
    stems = raised(clouds[0], width, height) if clouds else None
    if stems is not None:
        items["stems"] = stems
    items["frame"] = rectangle(np.zeros(2), np.array([width, height]), COLOURS["camera"], IN_DEPTH, 0.0)
    low, high = axis.segments[..., 2].min(), axis.segments[..., 2].max()
    radius = LABELS * float(np.linalg.norm([width, height, high - low])) / 2.0
    place, up, front = (width / 2.0, height / 2.0, -float(low + high) / 2.0), (0.0, -1.0, 0.0), (0.0, 0.0, -1.0)
    world = World(IN_DEPTH, "In depth", "px", radius, place, up, front, DEPTH_SIDES)
    away = Projection(np.diag([1.0, 1.0, -1.0]), np.zeros(3), 1.0, np.zeros(3))
    shown = {name: replace(away.primitive(item), layer=IN_DEPTH) for name, item in items.items()}
    return replace(flat, worlds=(*flat.worlds, WorldDrawing(world, shown)))


def circle(
    centre: Floats, radius: float, colour: Colour, layer: str, *, height: float = 1.0, dashed: bool = False
) -> Ellipse:
    """Draw a circle around a position (2,), px."""
    return Ellipse(
        at_height(centre, height),
        np.eye(2, dtype=np.float32) * np.float32(radius),
        colour,
        2.0,
        layer,
        dashed,
    )


def cross(position: Floats, radius: float, colour: Colour, layer: str) -> Links:
    """Draw a cross at a position (2,), px."""
    arm = max(radius, 4.0)
    offsets = np.array([[[-arm, 0.0], [arm, 0.0]], [[0.0, -arm], [0.0, arm]]])
    return lines(position + offsets, colour, 3.0, layer, height=2.0)


def draw_point(step: Step, other: Diagnostics | None = None, radius_px: float = 5.0) -> dict[str, Primitive]:
    """Draw a point that is followed: picture, particles, truth, uncertainty, estimate, and a second run's.

    Args:
        step: Step of a tracker whose states are `PointState`, in a picture.
        other: The same frame of a run with which this one is compared.
        radius_px: Radius of the target if its size is unknown.
    """
    state, image, target = step.state, step.frame.picture, step.frame.target
    radius = target.size / 2 if target else radius_px
    primitives: dict[str, Primitive] = {"picture": Picture(image)}
    if state.particles is not None:
        positions = state.particles.states[:, :2]
        primitives |= particle_clouds(positions, state.particles, state.observation_count, DOT * max(image.shape))
    if target is not None:
        primitives["truth"] = circle(target.position, radius, COLOURS["truth"], "truth")
    spread = state.posterior.covariance[:2, :2]
    primitives["covariance"] = uncertainty(state.estimate, spread, COLOURS["estimate"], "uncertainty")
    if other is not None:
        # Longer, so it is visible behind the estimate of this run.
        primitives["second"] = cross(np.array(other.estimate), 1.6 * radius, COLOURS["second"], "second run")
    primitives["estimate"] = cross(state.estimate, radius, COLOURS["estimate"], "estimate")
    return primitives


def draw_point_frame(step: Step, past: Sequence[Diagnostics], other: Diagnostics | None = None) -> Drawing:
    """Draw what `draw_point` draws, with a caption: a whole drawing for an experiment with one point."""
    del past
    height, width, _ = step.frame.picture.shape
    words = caption(step.diagnostics, step.tracker_title, error_words(step.diagnostics, " px"))
    return Drawing(width, height, draw_point(step, other), words)


POINT_LAYERS = (
    Layer("picture"),
    Layer("particles by sampler", legend=BY_SAMPLER),
    Layer("particles by weight", shown=False),
    Layer("estimate", legend=(Key("estimate", "estimate"),)),
    Layer("truth", legend=(Key("truth", "truth"),)),
    Layer("uncertainty"),
    SECOND_RUN,
)
"""Layers of `draw_point`."""


def box(centre: Floats, extent: tuple[float, float], colour: Colour, layer: str, height: float = 1.0) -> Polyline:
    """Draw the outline of a box around a position (2,), of a width and a height, px."""
    corners = np.array(((-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5), (-0.5, -0.5))) * extent
    return Polyline(at_height(centre + corners, height), colour, 2.0, layer)


def success_region(target: Target, parameters: Any) -> Ellipse | Polyline:  # noqa: ANN401 - the experiment's own model
    """Draw the edge of where the target counts as held: its true box, or a circle of some of its radii."""
    if getattr(parameters, "judged_by_box", False) and target.extent is not None:
        return box(target.position, target.extent, COLOURS["lost"], REGION)
    return circle(target.position, parameters.lost_radii * target.size / 2, COLOURS["lost"], REGION, dashed=True)


def uncertainty(mean: Floats, covariance: Floats, colour: Colour, layer: str, width: float = 2.0) -> Ellipse:
    """Draw the ellipse at two standard deviations of a Gaussian over a position (2,), px."""
    values, vectors = np.linalg.eigh(covariance)
    half_axes = 2.0 * np.sqrt(np.clip(values, 0.0, None))[:, None] * vectors.T
    return Ellipse(at_height(mean, 1.0), half_axes.astype(np.float32), colour, width, layer)


LOOKS = 9
"""Number of examined pictures, including the first, evenly over a second."""

BETTER_BY = 0.15
"""Least improvement for which advice is given."""

LEAST, MOST = 1.0, 1000.0
"""Value where nothing is likely, and where only the target is unlikely."""

MUCH = 0.1
"""Share of the rest of a picture that is worth a word if it looks like the target."""


def frames_of_a_second(sequence: FrameSequence, start: int) -> list[int]:
    """Return the numbers of the examined pictures: the one with the mark, and later ones."""
    last = min(start + round(sequence.frame_rate_hz), sequence.frame_count - 1)
    return sorted({int(number) for number in np.linspace(start, last, LOOKS)} | {start})


def looked_at(sequence: FrameSequence, start: int) -> str:
    """Return a clause on the examined pictures."""
    later = frames_of_a_second(sequence, start)[1:]
    if not later:
        return f"looked at picture {start}"
    return f"looked at picture {start}, and around the same place in {len(later)} pictures up to {later[-1]}"


def beside(found: Separation) -> float:
    """Return the likelihood of a target's surroundings relative to the target, as in `model.suitability.BESIDE`."""
    return found.around / found.on if found.on > 0.0 else LEAST if found.around == 0.0 else MOST


def remark(grade: Grade, found: Separation, why: str) -> str:
    """Describe the relative likelihood of the surroundings, and whether the rest of the picture looks like the target.

    Args:
        grade: Verdict on the target.
        found: Separation of the target from its surroundings.
        why: Reason for "no verdict", a clause.
    """
    share = f"{100 * found.around / found.on:.0f} % as likely as" if found.contrast > 0.0 else "at least as likely as"
    verdict = grade if grade == "no verdict" else f"separates {grade}"
    said = f"{verdict}: what is around the target is {share} the target itself"
    said += {"no verdict": f", {why}", "not at all": ", so nothing keeps the tracker on it"}.get(grade, "")
    if found.alike >= MUCH:
        said += f"; {100 * found.alike:.0f} % of the rest of the picture looks like it"
    return said
