"""A window followed by the histogram of its colours (Kagami 2012, after Perez et al. 2002).

The question of the lecture: an object is hidden for a moment, or passes a look-alike; does a cloud of weighted
hypotheses with a velocity find the target again? The scene is simulated, or any recording with a box that the user has
drawn around the target.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import lru_cache
from operator import attrgetter
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pftrack.core.arrays import Floats, Ints
from pftrack.core.model.drawing import COLOURS, LIFT, Drawing, Links, Mesh, Picture, Primitive, Text, WorldDrawing
from pftrack.core.model.marks import Box
from pftrack.core.model.measures import MEAN_IOU, PICTURE_MEASURES, held_at_end
from pftrack.core.model.parameters import Value, revise
from pftrack.core.model.recipe import Footage
from pftrack.core.model.setup import NOT_AT_ALL, Setup, Suitability
from pftrack.core.model.source import Frame, FrameSequence, Target, Truth
from pftrack.core.model.tracker import Diagnostics, Step, Tracker
from pftrack.core.numerics.compiled import read_only
from pftrack.core.numerics.elementary import exponential
from pftrack.core.numerics.random import Gaussian, Stream
from pftrack.experiments.declared import read_words, read_worlds
from pftrack.experiments.experiment import Experiment, Judge, Measured, Video
from pftrack.experiments.histogram.look import separating_share
from pftrack.experiments.histogram.model import MODEL, REPORTED, SIZE, HistogramState, judge, mark
from pftrack.experiments.histogram.parameters import HistogramTrackerParameters, ScoringParameters
from pftrack.experiments.histogram.scene import LawnSceneParameters, LawnSource
from pftrack.experiments.shared.filtered import filtered
from pftrack.experiments.shared.recording import RecordingParameters, RecordingSource
from pftrack.experiments.shared.reports import JudgedByBox
from pftrack.experiments.shared.sampling import AUXILIARY, CONDENSATION, HARD, NOISE_CONTROL, SOFT
from pftrack.experiments.shared.sketch import (
    BETTER_BY,
    DOT,
    PAST_FRAMES,
    at_height,
    beside,
    box,
    caption,
    distance,
    error_words,
    frames_of_a_second,
    grid_faces,
    looked_at,
    particle_clouds,
    paths,
    remark,
    success_region,
    uncertainty,
)
from pftrack.vision import rendering
from pftrack.vision.likelihoods import chromaticity
from pftrack.vision.likelihoods.counting import BINS, SPACES, STEPS, Space, bin_table
from pftrack.vision.likelihoods.histogram import Window, fit, rho_map, roots_of, shares, similarities
from pftrack.vision.likelihoods.separation import Separation, separation, surroundings

# Drawings of a window: boxes, particles and similar places in the picture, and two histograms in a world.
#
# The world shows the target's first look and the present look of the window at the estimate. Each bin of colour is a
# place on a floor, those of brightness stand in a row before it. Heights are square roots of shares: as vectors of such
# roots both histograms have length 1, and the likeness rho is their scalar product.

HEIGHT = 6.0
"""Height of a bin with all pixels, in bins."""
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
"""Faces of a box whose corners are numbered by height, depth and width."""


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


MAP_CELLS = 32
"""Windows along the longer side of the picture whose likeness is mapped."""
MAP_OPACITY = 0.55


def draw(step: Step, past: Sequence[Diagnostics], other: Diagnostics | None = None) -> Drawing:
    """Draw a frame: picture, map of the likeness, particles, boxes, uncertainty, histograms and the path so far."""
    image, state, row = step.frame.picture, step.state, step.diagnostics
    height, width, _ = image.shape
    target = step.frame.target
    path = past[max(row.frame - PAST_FRAMES, 0) : row.frame + 1]
    primitives: dict[str, Primitive] = {"picture": Picture(image), "likeness": _likeness(image, state)}
    if state.particles is not None:
        positions = state.particles.states[:, :2]
        primitives |= particle_clouds(positions, state.particles, state.observation_count, DOT * max(width, height))
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
    primitives |= paths(path, np.array([past_row.estimate for past_row in path]), (width, height))
    world, grip = histogram_world(state, image), at_height(state.estimate, 2.0)
    return Drawing(width, height, primitives, _caption(step), (world,), grip=grip)


def _caption(step: Step) -> str:
    row = step.diagnostics
    searching = "searching" if row.searching else ""
    return caption(row, f"likeness {row.number('likeness'):.2f}", searching, error_words(row, " px"))


def _likeness(image_rgb: NDArray[np.uint8], state: HistogramState) -> Mesh:
    """Draw rho of windows all over the picture, from purple and flat for 0 to yellow and as high as a relief for 1."""
    height, width, _ = image_rgb.shape
    step = -(-max(height, width) // MAP_CELLS)
    found = rho_map(image_rgb, state.window, state.space, state.model, step, state.background)
    rows, columns = found.shape
    across, down = np.meshgrid(np.linspace(0.0, width - 1.0, columns), np.linspace(0.0, height - 1.0, rows))
    heights = 0.5 + LIFT * max(width, height) * found.ravel()
    vertices = at_height(np.column_stack([across.ravel(), down.ravel()]), heights)
    return Mesh(vertices, grid_faces(rows, columns), rendering.viridis(found.ravel()), MAP_OPACITY, "likeness")


# Trackers of a window by the histogram of its colours (Kagami 2012, after Pérez et al. 2002).
#
# All carry position and velocity, and the size of the window relative to the first one, which is constant unless it is
# followed. Condensation is the lecture's filter (SIR): a time update with constant velocity, weights by the likelihood,
# systematic resampling in every frame. The other samplers are those of Bando 2007: they draw parents with regard to the
# new picture, always or when they are unsure, by the same likelihood.

# Greedy search carries one place instead of a cloud and predicts nothing, which is what the lecture sets out from: an
# object that is hidden for a moment, or passes a look-alike, is lost for good.

ROUNDING = 1.0 / 12.0
"""Variance of a place that is known to a pixel, px^2."""


def start(target: Target, frame: Frame, parameters: HistogramTrackerParameters, rng: Stream) -> HistogramState:
    """Begin at a known place."""
    del rng
    belief = _belief_at_rest(target.position[0], target.position[1], 0.0)
    return judge(mark(target, frame, parameters, belief), frame.picture, parameters)


def step(state: HistogramState, frame: Frame, parameters: HistogramTrackerParameters, rng: Stream) -> HistogramState:
    """Go to the place within reach whose window is most like the model; the nearest among equals."""
    del rng
    image = frame.picture
    state = MODEL.prepare(state, frame, parameters)
    reach = np.arange(-parameters.search_reach_px, parameters.search_reach_px + 1.0)
    across, down = (axis.ravel() for axis in np.meshgrid(reach, reach))
    nearest_first = np.argsort(across * across + down * down, kind="stable")
    columns, rows = state.estimate[0] + across[nearest_first], state.estimate[1] + down[nearest_first]
    window = state.window
    found = similarities(
        read_only(image),
        columns,
        rows,
        np.full(len(columns), float(window.reach_across_px)),
        np.full(len(columns), float(window.reach_down_px)),
        bin_table(state.space),
        roots_of(state.model, state.background),
        window.kernel,
        window.parts,
        state.background,
    )
    best = int(found.argmax())
    moved = replace(
        state,
        posterior=_belief_at_rest(columns[best], rows[best], float(state.posterior.mean[SIZE])),
        particles=None,
        observation_count=0,
        log_evidence=0.0,
        resampled=False,
        switched=False,
        alert=None,
    )
    return judge(moved, image, parameters)


def _belief_at_rest(column: float, row: float, size: float) -> Gaussian:
    """Return the belief in a place, at rest."""
    mean = np.array([column, row, 0.0, 0.0, size])
    return Gaussian(mean, np.diag([ROUNDING, ROUNDING, 1.0, 1.0, 0.0]))


GREEDY = Tracker("greedy", start, step, series=REPORTED[1:], measure=MODEL.measure, model=MODEL)

TRACKERS: dict[str, Tracker] = {
    name: replace(tracker, searching=attrgetter("searching"))
    for name, tracker in filtered(MODEL, CONDENSATION, AUXILIARY, HARD, SOFT, NOISE_CONTROL).items()
} | {GREEDY.id: GREEDY}
"""The trackers by name, in the order in which they are shown."""

# A recording for the window: whether its target can be followed by its colours, and the values to begin with.
#
# The lawn keeps the values of the lecture: it is the lecture's scene, and what it shows (a sharp likelihood that
# clings, a velocity that carries) would be hidden by what helps on real pictures. Recordings use the best known values.

SHARPNESS = 50.0
"""Lambda for which the grades were set, of a window without parts; trackers may have another."""
UNTOLD = "which is not informative for this tracker: 18 of 94 starts on real clips with 15 % or less were lost"
"""Reason for "no verdict", as `benchmarks/suitability.py` counts."""
STEPS_A_WINDOW = 6
"""Number of places examined along the shorter side of a window."""
COARSE_STEPS = 4
"""The same of each frame of a run."""


def suits(sequence: FrameSequence, footage: Footage, parameters: Any) -> Suitability:  # noqa: ANN401 - on either model
    """Compare the target with its surroundings over a second, as the likelihood weighs windows around both.

    Args:
        sequence: The pictures.
        footage: Start, and a box around the target there.
        parameters: Parameters of frame 0.
    """
    view = _View(sequence, footage, parameters)
    chosen = parameters.colour_space, parameters.spatial_kernel
    likelihood, found = view.separation(*chosen)
    value = found.contrast
    advice = _advice(view, chosen, value) if value < NOT_AT_ALL else ()
    judged = Suitability(value, "", advice, None, likelihood, tells=value < NOT_AT_ALL)
    return replace(judged, remark=f"{remark(judged.grade, found, UNTOLD)}; {looked_at(sequence, footage.start)}")


def look_beside(frame: Frame, state: HistogramState, parameters: Any) -> float:  # noqa: ANN401 - on either model
    """Return the likelihood of the estimate's surroundings relative to the estimate, by the colours as counted.

    Args:
        frame: The picture.
        state: State of the tracker.
        parameters: In force.
    """
    del parameters  # the state holds their relevant part
    picture, window = frame.picture, state.window
    width, height = state.box_px
    x, y = state.estimate[:2] - np.array([width, height]) / 2
    box = float(x), float(y), width, height
    rows, columns = surroundings(picture.shape, box)
    # Windows at the edge of the examined region reach beyond it.
    top, left = max(rows.start - window.reach_down_px, 0), max(columns.start - window.reach_across_px, 0)
    seen = picture[top : rows.stop + window.reach_down_px, left : columns.stop + window.reach_across_px]
    step = max(min(window.size_px) // COARSE_STEPS, 1)
    if picture[rows, columns].size == 0 or min(seen.shape[:2]) <= step // 2:
        return float("nan")  # the estimate has left the picture
    rho = rho_map(np.ascontiguousarray(seen), window, state.space, state.model, step, state.background)
    likelihood = exponential(SHARPNESS * (rho - 1.0))
    return beside(separation(likelihood, (), ((x - left) / step, (y - top) / step, width / step, height / step)))


class _View:
    """A target in the picture in which it is marked, and its place in the second after that."""

    def __init__(self, sequence: FrameSequence, footage: Footage, parameters: Any) -> None:  # noqa: ANN401 - see above
        self._pictures = [sequence.picture(number) for number in frames_of_a_second(sequence, footage.start)]
        self._box = Box.model_validate(footage.mark).corner_and_size
        self._reach = int(parameters.window_width_px) // 2, int(parameters.window_height_px) // 2

    def separation(self, space: Space, kernel: bool) -> tuple[Floats, Separation]:
        """Return the likelihood over the first picture, and how it separates the target, for a way of counting."""
        window = Window(*self._reach, kernel)
        x, y, w, h = self._box
        first, *later = self._pictures
        model = fit(first, np.array([x + (w - 1) / 2, y + (h - 1) / 2]), window, space)
        step = max(min(window.size_px) // STEPS_A_WINDOW, 1)

        def likelihood(picture: NDArray[np.uint8]) -> Floats:
            return exponential(SHARPNESS * (rho_map(picture, window, space, model, step) - 1.0))

        begun = likelihood(first)
        scaled = x / step, y / step, w / step, h / step
        return begun, separation(begun, (likelihood(picture) for picture in later), scaled)


def _advice(view: _View, chosen: tuple[Space, bool], value: float) -> tuple[str, ...]:
    """Return another way of counting that separates better."""
    advice = []
    for space in SPACES:
        for kernel in (False, True):
            if (space, kernel) == chosen:
                continue
            other = view.separation(space, kernel)[1].contrast
            if other >= value + BETTER_BY:
                weighed = "weighing the middle" if kernel else "counting all alike"
                advice.append(f"the colour space {space!r}, {weighed}, separates better ({other:.2f})")
    if not advice:
        advice.append(
            "no other way of counting separates better; the trackers here follow colours alone, so mark something that "
            "differs in its colours from what is around it"
        )
    return tuple(advice)


PICTURES: Mapping[str, Value] = MappingProxyType(
    {
        "sharpness": 70,
        "spatial_kernel": True,
        "parts_across": 2,
        "parts_down": 3,
        "weigh_background": True,
        "surround_contrast": 0.4,
        "follow_size": True,
        "size_noise": 0.012,
        "follow_camera": True,
        "wide_share": 0.1,
    }
)
"""Parts, colours relative to the background, contrast, size and camera; each helped on the clips of the choice."""
SEARCH: Mapping[str, Value] = MappingProxyType({"search_share": 0.1, "lost_likeness": 0.5, "lost_after_frames": 2})


FOLDER = Path(__file__).parent

HELD_AT_END = held_at_end()
"""Frame rate for success: between two decisions the window may wait, or search for its target."""


class SimulatedHistogramParameters(ScoringParameters, HistogramTrackerParameters, LawnSceneParameters):
    """The simulated lawn and its trackers."""


class RecordedHistogramParameters(JudgedByBox, RecordingParameters, HistogramTrackerParameters):
    """A recording with an overlay, and its trackers."""


def simulate() -> Setup:
    """Wire the simulated lawn with its default values."""
    return Setup(LawnSource, SimulatedHistogramParameters(), success=HELD_AT_END.name)


def wire(sequence: FrameSequence, mark: Box, start: int, truth: Truth | None) -> Setup:
    """Wire a recording: the window is the box, and lengths are scaled to it.

    A box holds background in its corners, which differs from place to place, so the middle of the window is weighed
    more, and colours less that are around the target as well; what has an upper and a lower end is counted in parts;
    edges count beside colours as far as they separate the target in the first picture; what is gone may come back
    elsewhere; and real targets and cameras move and turn faster than simulated ones. These are starting values: every
    parameter but the window's is live.

    Args:
        sequence: The pictures.
        mark: A box around the target in the picture `start`.
        start: Number of the picture to start at.
        truth: True boxes by number of the picture, where they are known.
    """
    box = mark.corner_and_size
    side, picture = min(box[2:]), sequence.picture(start)
    parameters = revise(
        RecordedHistogramParameters(),
        {
            "window_width_px": min(box[2], 1025.0),
            "window_height_px": min(box[3], 1025.0),
            "process_noise_px": min(max(0.06 * side, 0.5), 200.0),
            "large_process_noise_px": min(max(0.2 * side, 1.0), 200.0),
            "velocity_noise_px": min(max(0.03 * side, 0.1), 100.0),
            "initial_velocity_px": min(max(0.15 * side, 1.0), 100.0),
            "gamma_px": min(0.2 * side, 1000.0),
            "gamma_min_px": min(0.15 * side, 1000.0),
            "gamma_max_px": min(0.5 * side, 1000.0),
            **PICTURES,
            "wide_noise_px": min(max(0.35 * side, 1.0), 500.0),
            "distracter_colour": chromaticity.median_colour(picture, box),
        },
    )
    middle = np.array([box[0] + (box[2] - 1.0) / 2.0, box[1] + (box[3] - 1.0) / 2.0])
    share = round(20.0 * separating_share(picture, middle, parameters)) / 20.0
    parameters = revise(parameters, {"cells_share": share, **SEARCH})
    source = RecordingSource(sequence, box, start, truth.at if truth else None)
    return Setup(lambda _seed, _parameters: source, parameters, success="inside_share", beside=look_beside)


EXPERIMENT = Experiment(
    **read_words(FOLDER, TRACKERS, measured=Measured(measures=(HELD_AT_END, *PICTURE_MEASURES, MEAN_IOU))),
    id="histogram",
    model=MODEL,
    simulate=simulate,
    video=Video(
        wire,
        recorded=lambda _kind: RecordedHistogramParameters(),
        marks=(Box,),
        wanted="a box around the target, which is tracked by its colours and edges",
        suits=suits,
        clip_title="Colours of a window",
        clip_about=("sample_count", "sharpness", "cells_share", "follow_size", "process_noise_px", "search_share"),
    ),
    draw=draw,
    judge=Judge(distance, "px", lambda errors, sizes, parameters: errors >= parameters.lost_radii * sizes / 2),
)
