"""What is drawn of a window in the picture: boxes, particles, where else the picture is alike, and the path so far."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from pftrack.core.model.diagnostics import Diagnostics
from pftrack.core.model.drawing import COLOURS, Colour, Drawing, Mesh, Picture, Polyline, Primitive
from pftrack.core.model.layer import Key, Layer
from pftrack.experiments.experiment import Step
from pftrack.experiments.histogram.trackers.state import HistogramState
from pftrack.experiments.histogram.world import histogram_world
from pftrack.experiments.shared.sketch import (
    BY_SAMPLER,
    SECOND_RUN,
    at_height,
    circle,
    error_words,
    particle_clouds,
    uncertainty,
)
from pftrack.vision.likelihoods.histogram import rho_map
from pftrack.vision.rendering import heat

__all__ = ["LAYERS", "draw"]

TRAIL_FRAMES = 60
FRAME_HEIGHT_PX = 3.0
"""How far one frame of the past is lifted in the space-time view."""
MAP_CELLS = 32
"""Windows along the longer side of the picture whose likeness is mapped."""
MAP_OPACITY = 0.55

LAYERS = (
    Layer("picture"),
    Layer("likeness", "Likeness over the picture", shown=False),
    Layer("particles by sampler", legend=BY_SAMPLER),
    Layer("particles by weight", shown=False),
    Layer("estimate", legend=(Key("estimate", "estimate"),)),
    Layer("truth", legend=(Key("truth", "truth"),)),
    Layer("uncertainty"),
    Layer("region of success", shown=False, legend=(Key("lost", "limit of success"),)),
    Layer("trail", role="flat only"),
    Layer("path through time", shown=False, role="through time"),
    Layer("histograms", "Histograms (model outlined)"),
    SECOND_RUN,
)


def draw(step: Step, past: Sequence[Diagnostics], other: Diagnostics | None = None) -> Drawing:
    """Draw a frame: picture, map of the likeness, particles, boxes, uncertainty, histograms and the path so far."""
    image, state, row = step.frame.image_rgb, step.state, step.diagnostics
    if image is None:
        raise ValueError("a window is drawn on a picture, got a signal")
    height, width, _ = image.shape
    target = step.frame.target
    path = past[max(row.frame - TRAIL_FRAMES, 0) : row.frame + 1]
    primitives: dict[str, Primitive] = {"picture": Picture(image), "likeness": _likeness(image, state)}
    if state.particles is not None:
        positions = state.particles.states[:, :2]
        primitives |= particle_clouds(positions, state.particles, state.observation_count, max(width, height) / 160)
    if target is not None and target.extent is not None:
        primitives["truth"] = _box(target.position, target.extent, COLOURS["truth"], "truth", 1.0)
        gate = step.parameters.lost_radii * target.size / 2
        primitives["gate"] = circle(target.position, gate, COLOURS["lost"], "region of success", dashed=True)
    primitives["covariance"] = uncertainty(
        state.estimate, state.posterior.covariance[:2, :2], COLOURS["estimate"], "uncertainty"
    )
    if other is not None:
        width_px, height_px = other.vector("box") or state.box_px
        primitives["second"] = _box(
            np.array(other.estimate), (width_px, height_px), COLOURS["second"], "second run", 1.5
        )
    colour = COLOURS["lost" if state.searching else "estimate"]
    primitives["estimate"] = _box(state.estimate, state.box_px, colour, "estimate", 2.0)
    places = np.array([past_row.estimate for past_row in path])
    primitives["trail"] = Polyline(at_height(places, 1.0), COLOURS["estimate"], 2.0, "trail")
    heights = FRAME_HEIGHT_PX * (row.frame - np.array([past_row.frame for past_row in path]))
    primitives["space-time"] = Polyline(at_height(places, 1.0 + heights), COLOURS["estimate"], 3.0, "path through time")
    return Drawing(width, height, primitives, _caption(step), (histogram_world(state, image),))


def _caption(step: Step) -> str:
    row = step.diagnostics
    parts = [f"frame {row.frame}", f"likeness {row.number('likeness'):.2f}"]
    if step.state.searching:
        parts.append("searching")
    return " · ".join(filter(None, [*parts, error_words(row, " px")]))


def _box(centre: NDArray[np.float64], size: tuple[float, float], colour: Colour, layer: str, height: float) -> Polyline:
    corners = np.array(((-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5), (-0.5, -0.5))) * size
    return Polyline(at_height(centre + corners, height), colour, 2.0, layer)


def _likeness(image_rgb: NDArray[np.uint8], state: HistogramState) -> Mesh:
    """Draw rho of windows all over the picture, from purple for 0 to yellow for 1."""
    height, width, _ = image_rgb.shape
    step = -(-max(height, width) // MAP_CELLS)
    found = rho_map(image_rgb, state.window, state.space, state.model, step, state.background)
    rows, columns = found.shape
    across, down = np.meshgrid(np.linspace(0.0, width - 1.0, columns), np.linspace(0.0, height - 1.0, rows))
    vertices = at_height(np.column_stack([across.ravel(), down.ravel()]), 0.5)
    corner = (columns * np.arange(rows - 1)[:, None] + np.arange(columns - 1)).ravel()
    quads = np.stack([corner, corner + 1, corner + columns + 1, corner, corner + columns + 1, corner + columns], axis=1)
    faces = quads.reshape(-1, 3).astype(np.int32)
    return Mesh(vertices, faces, heat.viridis(found.ravel()), MAP_OPACITY, "likeness")
