"""What is drawn of a window: boxes, particles and other alike places in the picture, and two histograms in a world.

The world shows what the target looked like beside what the window at the estimate looks like now. Each bin of colour is
a place on a floor, those of brightness stand in a row before it. Heights are square roots of shares: as vectors of such
roots both histograms have length 1, and the likeness rho is their scalar product.
"""

from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pftrack.core.arrays import Floats, Ints
from pftrack.core.model.drawing import (
    COLOURS,
    Drawing,
    Links,
    Mesh,
    Picture,
    Primitive,
    Text,
    WorldDrawing,
)
from pftrack.core.model.tracker import Diagnostics, Step
from pftrack.experiments.declared import read_worlds
from pftrack.experiments.histogram.model import HistogramState
from pftrack.experiments.shared.sketch import (
    at_height,
    box,
    caption,
    error_words,
    grid_faces,
    particle_clouds,
    paths,
    success_region,
    uncertainty,
)
from pftrack.vision import rendering
from pftrack.vision.likelihoods.counting import BINS, STEPS, Space, bin_table
from pftrack.vision.likelihoods.histogram import rho_map, shares

HEIGHT = 6.0
"""Of a bin that has all pixels, in bins."""
HALF_WIDTH, MODEL_HALF_WIDTH = 0.3, 0.42
LEAST_SHARE = 0.002
"""What has less is not drawn."""
ROW_OF_BRIGHTNESS = -1.2
AXES: dict[Space, tuple[str, str]] = {
    "hsv": ("saturation", "hue"),
    "lab": ("b", "a"),
    "chromaticity": ("share of green", "share of red"),
}

(HISTOGRAM_WORLD,) = read_worlds(Path(__file__).parent)

LID = np.array([(4, 5), (5, 7), (7, 6), (6, 4)])
SIDES = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))
FACES = np.array([(a, *pair) for a, *rest in SIDES for pair in (rest[:2], rest[1:])])
"""Of a box whose corners are numbered by height, depth and width."""


def histogram_world(state: HistogramState, image_rgb: NDArray[np.uint8]) -> WorldDrawing:
    """Draw the model as outlined lids, and the window at the estimate as columns in the colours that they count."""
    now = shares(image_rgb, state.estimate, replace(state.window, parts=(1, 1)), state.space)
    drawn: dict[str, Primitive] = {"floor": Links(_floor(), COLOURS["hidden"], 0.5, "histograms")}
    for name, place in zip(AXES[state.space], ((4.5, 0.0, -1.4), (10.2, 0.0, 4.5)), strict=True):
        drawn[name] = Text(np.array(place, np.float32), name, COLOURS["camera"], "histograms", anchor="middle")
    brightness = np.array((4.5, 0.0, STEPS - ROW_OF_BRIGHTNESS), np.float32)
    drawn["brightness"] = Text(brightness, "brightness", COLOURS["camera"], "histograms", anchor="middle")
    seen = np.flatnonzero(now > LEAST_SHARE)
    corners = _boxes(seen, np.sqrt(now[seen]), HALF_WIDTH)
    faces = (FACES[None] + 8 * np.arange(len(seen))[:, None, None]).reshape(-1, 3).astype(np.int32)
    colours = np.repeat(_colours(state.space)[seen], 8, axis=0)
    drawn["now"] = Mesh(corners.reshape(-1, 3), faces, colours, 0.9, "histograms")
    known = np.flatnonzero(state.whole_model > LEAST_SHARE)
    outlines = _boxes(known, np.sqrt(state.whole_model[known]), MODEL_HALF_WIDTH)
    drawn["model"] = Links(outlines[:, LID].reshape(-1, 2, 3), COLOURS["truth"], 1.5, "histograms")
    return WorldDrawing(HISTOGRAM_WORLD, drawn)


def _places(bins: Ints) -> Floats:
    """Return where bins (n,) stand on the floor, (n, 2) to the right and to the front."""
    coloured = bins < STEPS * STEPS
    right = np.where(coloured, bins % STEPS, bins - STEPS * STEPS)
    back = np.where(coloured, bins // STEPS, ROW_OF_BRIGHTNESS)
    return np.column_stack([right, STEPS - 1 - back]).astype(np.float64)


def _boxes(bins: Ints, roots: Floats, half_width: float) -> NDArray[np.float32]:
    """Return the corners (n, 8, 3) of columns."""
    places = _places(bins)
    corners = np.zeros((len(bins), 2, 2, 2, 3), np.float32)
    corners[..., 0] = places[:, 0, None, None, None] + half_width * np.array((-1.0, 1.0))
    corners[..., 1] = HEIGHT * roots[:, None, None, None] * np.array((0.0, 1.0))[:, None, None]
    corners[..., 2] = places[:, 1, None, None, None] + half_width * np.array((-1.0, 1.0))[:, None]
    return corners.reshape(len(bins), 8, 3)


def _floor() -> NDArray[np.float32]:
    """Return the lines (n, 2, 3) around the bins of colour."""
    low, high = -0.5, STEPS - 0.5
    ring = np.array([(low, 0, low), (high, 0, low), (high, 0, high), (low, 0, high)], np.float32)
    return np.stack([ring, np.roll(ring, -1, axis=0)], axis=1)


@lru_cache(maxsize=3)
def _colours(space: Space) -> NDArray[np.uint8]:
    """Return the mean colour (110, 3) of each bin; grey for one that no colour is in."""
    levels = np.arange(4, 256, 8)
    colours = np.stack(np.meshgrid(levels, levels, levels, indexing="ij"), axis=-1).reshape(-1, 3)
    bins = bin_table(space)[colours @ np.array((65536, 256, 1))]
    count = np.bincount(bins, minlength=BINS)
    sums = np.stack([np.bincount(bins, colours[:, channel], minlength=BINS) for channel in range(3)], axis=1)
    means = np.where(count[:, None] > 0, sums / np.maximum(count, 1)[:, None], 128.0)
    return np.asarray(means.astype(np.uint8))


TRAIL_FRAMES = 60
MAP_CELLS = 32
"""Windows along the longer side of the picture whose likeness is mapped."""
MAP_OPACITY = 0.55


def draw(step: Step, past: Sequence[Diagnostics], other: Diagnostics | None = None) -> Drawing:
    """Draw a frame: picture, map of the likeness, particles, boxes, uncertainty, histograms and the path so far."""
    image, state, row = step.frame.picture, step.state, step.diagnostics
    height, width, _ = image.shape
    target = step.frame.target
    path = past[max(row.frame - TRAIL_FRAMES, 0) : row.frame + 1]
    primitives: dict[str, Primitive] = {"picture": Picture(image), "likeness": _likeness(image, state)}
    if state.particles is not None:
        positions = state.particles.states[:, :2]
        primitives |= particle_clouds(positions, state.particles, state.observation_count, max(width, height) / 160)
    if target is not None and target.extent is not None:
        primitives["truth"] = box(target.position, target.extent, COLOURS["truth"], "truth", 1.0)
        primitives["gate"] = success_region(target, step.parameters)
    primitives["covariance"] = uncertainty(
        state.estimate, state.posterior.covariance[:2, :2], COLOURS["estimate"], "uncertainty"
    )
    if other is not None:
        width_px, height_px = other.vector("box") or state.box_px
        primitives["second"] = box(
            np.array(other.estimate), (width_px, height_px), COLOURS["second"], "second run", 1.5
        )
    colour = COLOURS["lost" if step.diagnostics.searching else "estimate"]
    primitives["estimate"] = box(state.estimate, state.box_px, colour, "estimate", 2.0)
    primitives |= paths(path, np.array([past_row.estimate for past_row in path]))
    return Drawing(width, height, primitives, _caption(step), (histogram_world(state, image),))


def _caption(step: Step) -> str:
    row = step.diagnostics
    searching = "searching" if row.searching else ""
    return caption(row, f"likeness {row.number('likeness'):.2f}", searching, error_words(row, " px"))


def _likeness(image_rgb: NDArray[np.uint8], state: HistogramState) -> Mesh:
    """Draw rho of windows all over the picture, from purple for 0 to yellow for 1."""
    height, width, _ = image_rgb.shape
    step = -(-max(height, width) // MAP_CELLS)
    found = rho_map(image_rgb, state.window, state.space, state.model, step, state.background)
    rows, columns = found.shape
    across, down = np.meshgrid(np.linspace(0.0, width - 1.0, columns), np.linspace(0.0, height - 1.0, rows))
    vertices = at_height(np.column_stack([across.ravel(), down.ravel()]), 0.5)
    return Mesh(vertices, grid_faces(rows, columns), rendering.viridis(found.ravel()), MAP_OPACITY, "likeness")
