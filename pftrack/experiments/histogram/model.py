"""The belief in a window: its state, the target's look, and the similarity of colours at a place.

A renewed model gradually forgets the first look; when another colour space is chosen, it begins with it again.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from typing_extensions import override

from pftrack.core.arrays import Floats
from pftrack.core.model.likelihood import Amount, Component, Histograms, Part, Patches
from pftrack.core.model.model import State, Values
from pftrack.core.model.series import Series, SeriesValue
from pftrack.core.model.source import Frame, Target
from pftrack.core.numerics.compiled import compiled
from pftrack.core.numerics.elementary import exponential, exponentials, logarithm
from pftrack.core.numerics.matrices import product
from pftrack.core.numerics.random import Gaussian, Generator, Stream
from pftrack.experiments.declared import read_reported
from pftrack.experiments.histogram.look import (
    Look,
    counted,
    counting,
    first_cells,
    first_look,
    half_sides,
    model_of,
    use_of_surroundings,
)
from pftrack.experiments.histogram.parameters import HistogramTrackerParameters
from pftrack.experiments.shared import reports
from pftrack.experiments.shared.filtered import Update
from pftrack.experiments.shared.reports import PointState
from pftrack.experiments.shared.sampling import LoopModel, Motion, crop
from pftrack.filters.particles import ParticleSet, normalise
from pftrack.filters.resampling import systematic
from pftrack.vision.likelihoods import cells, histogram
from pftrack.vision.likelihoods.counting import BINS, Space, bin_colours, bin_table
from pftrack.vision.matching import camera_shift, small_grey

DIMENSION = 5
"""Components of the state: position (u, v) in px, velocity in px/frame, logarithm of the size relative to the first."""
VELOCITY = slice(2, 4)
SIZE = 4
"""Indices of velocity and size."""


@dataclass(frozen=True, slots=True, kw_only=True)
class HistogramState(PointState):
    """The posterior of one frame, immutable: that of the point, and what is known of its window.

    Attributes:
        look: The target's first look.
        space: Colour space of the model.
        kernel: Whether it counts the middle more.
        parts: Numbers of parts of the window, across and down.
        model: q (110 in each part).
        background: The target's surroundings, as far as they count.
        background_use: Whether bins are weighed by the surroundings, and the weight of contrast.
        view: The last picture, small and grey, if the camera is followed.
        learned: The description of the window in cells; None while they do not count.
        likeness: rho of the window at the estimate.
        missed: Number of consecutive frames in which its score, rho and that of the cells, was too low.
        usual: Usual score; 1 without cells.
        sure_size: Logarithm of the window's size in the last frame that did not miss.
        searching: Whether the target is lost, and searched; None while that is never done.
    """

    look: Look
    space: Space
    kernel: bool
    parts: tuple[int, int]
    model: Floats
    background: histogram.Background
    background_use: tuple[bool, float]
    view: NDArray[np.uint8] | None
    learned: cells.Cells | None = None
    likeness: float = 1.0
    missed: int = 0
    usual: float = 1.0
    sure_size: float = 0.0
    searching: bool | None = None

    @property
    def scale(self) -> float:
        """Size of the window relative to the first one."""
        return float(exponential(self.posterior.mean[SIZE]))

    @property
    def window(self) -> histogram.Window:
        """The window at the estimate."""
        first = self.first_window
        half_width, half_height = (
            int(np.floor(self.scale * half + 0.5)) for half in (first.reach_across_px, first.reach_down_px)
        )
        return histogram.Window(half_width, half_height, self.kernel, self.parts)

    @property
    def first_window(self) -> histogram.Window:
        """The window that was marked."""
        first = self.look.window
        return histogram.Window(first.reach_across_px, first.reach_down_px, self.kernel, self.parts)

    @property
    def whole_model(self) -> Floats:
        """The model of all parts together, (110,)."""
        return np.asarray(self.model.reshape(-1, BINS).sum(axis=0))

    @property
    def box_px(self) -> tuple[float, float]:
        """Width and height of what was marked, at the size of the estimate, px."""
        width, height = self.look.size_px
        return self.scale * width, self.scale * height


def with_model(state: HistogramState, parameters: HistogramTrackerParameters) -> HistogramState:
    """Return the state with a model that counts by the parameters.

    Raises:
        ValueError: Too little of the target's window lay within the picture.
    """
    same = (state.space, state.kernel, state.parts) == counting(parameters)
    if same and state.background_use == use_of_surroundings(parameters):
        return state
    wanted = counted(state.look, parameters)
    return replace(state, **({**wanted, "model": state.model} if same else wanted))


LEAST_SCORE, LEARNING_RATE, USUAL_RATE = 0.3, 0.05, 0.05
"""Score of the cells at the estimate from which on they are learned, how fast, and how fast the usual score changes."""


def judge(
    state: HistogramState, image_rgb: NDArray[np.uint8], parameters: HistogramTrackerParameters
) -> HistogramState:
    """Compare the window at the estimate with the model: is the target lost, and may the model be renewed?

    A wrong renewal would be followed from then on, so only a window similar to the model counts, and only while the
    particles agree on its place.
    """
    likeness = histogram.similarity(image_rgb, state.estimate, state.window, state.space, state.model, state.background)
    by_cells, half, learned = 1.0, half_sides(state.look, state.scale), state.learned
    score = likeness
    if learned is not None:
        (by_cells,) = cells.score(learned, image_rgb, state.estimate, half, cells.HERE).tolist()
        score += parameters.cells_share * (by_cells - likeness)
    enough = parameters.found_likeness if state.searching else parameters.lost_likeness
    missed = 0 if score >= enough * state.usual else state.missed + 1
    searching = missed >= parameters.lost_after_frames if parameters.search_share > 0.0 else None
    state = replace(state, likeness=likeness, missed=missed, searching=searching)
    if missed == 0:
        state = replace(state, sure_size=float(state.posterior.mean[SIZE]))
        if learned is not None:
            state = replace(state, usual=state.usual + USUAL_RATE * (score - state.usual))
            if by_cells >= LEAST_SCORE:
                learned = cells.learn(learned, image_rgb, state.estimate, half, LEARNING_RATE)
                state = replace(state, learned=learned)
    rate = parameters.renewal_rate
    within = parameters.renewal_spread * min(state.box_px) / 2.0
    if rate == 0.0 or likeness < parameters.renewal_likeness or state.sigma.max() > within:
        return state
    seen = histogram.shares(image_rgb, state.estimate, state.window, state.space)
    return replace(state, model=(1.0 - rate) * state.model + rate * seen)


LARGEST = 1.4
"""Largest change of a size's logarithm, up or down: a window of a quarter of the first one's sides, or four times
them."""


class Packed(NamedTuple):
    """The target's colours, for compiled code."""

    table: NDArray[np.uint8]
    root_model: Floats
    half_width: float
    half_height: float
    sharpness: float
    kernel: bool
    parts: tuple[int, int]
    background: histogram.Background
    learned: cells.Cells


@compiled
def _log_likelihood(image_rgb: NDArray[np.uint8], states: Floats, target: Packed) -> Floats:
    count = states.shape[0]
    columns, rows, sizes = np.empty(count), np.empty(count), np.empty(count)
    for n in range(count):
        columns[n], rows[n], sizes[n] = states[n, 0], states[n, 1], states[n, SIZE]
        if not abs(sizes[n]) <= LARGEST:
            # Such a window is invalid: it is moved outside the picture.
            columns[n], sizes[n] = np.nan, 0.0
    factors = exponentials(sizes)
    half_widths, half_heights = np.empty(count), np.empty(count)
    for n in range(count):
        half_widths[n], half_heights[n] = target.half_width * factors[n], target.half_height * factors[n]
    scores = histogram.similarities(
        image_rgb,
        columns,
        rows,
        half_widths,
        half_heights,
        target.table,
        target.root_model,
        target.kernel,
        target.parts,
        target.background,
    )
    if target.learned.share > 0.0:
        windows = columns, rows, half_widths + 0.5 * factors, half_heights + 0.5 * factors
        seen = cells.scores(image_rgb, windows, target.learned)
        for n in range(count):
            scores[n] += target.learned.share * (seen[n] - scores[n])
    for n in range(count):
        scores[n] = -target.sharpness * (1.0 - scores[n])
    return scores


REPORTED = tuple(read_reported(Path(__file__).parent).values())
"""The first is for particles: without noise on a velocity, resampling can only lose some of them."""


def first_view(image_rgb: NDArray[np.uint8], parameters: HistogramTrackerParameters) -> NDArray[np.uint8] | None:
    """Return what the next picture is compared with, (h, w); None if the camera is not followed."""
    return small_grey(image_rgb) if parameters.follow_camera else None


def follow_camera(
    state: HistogramState, image_rgb: NDArray[np.uint8], parameters: HistogramTrackerParameters
) -> HistogramState:
    """Return the state with all places moved as the picture has moved; velocities are those within the scene."""
    view = first_view(image_rgb, parameters)
    if view is None or state.view is None:
        return state if state.view is view else replace(state, view=view)
    shift = camera_shift(state.view, image_rgb, view)
    mean = state.posterior.mean.copy()
    mean[:2] += shift
    moved = replace(state, view=view, posterior=replace(state.posterior, mean=mean))
    if state.particles is None:
        return moved
    states = state.particles.states.copy(order="F")
    states[:, :2] += shift
    return replace(moved, particles=replace(state.particles, states=states))


COMPONENTS = (
    Component("u", "px"),
    Component("v", "px"),
    Component("velocity u", "px/frame"),
    Component("velocity v", "px/frame"),
    Component("log size"),
)


@lru_cache(maxsize=64)
def _motion(parameters: HistogramTrackerParameters) -> Motion:
    """Return x' = x + r v + s_p n, v' = r v + s_v n, and a random walk of the logarithm of the size."""
    transition = np.eye(DIMENSION)
    for axis in range(2):
        transition[axis, 2 + axis] = transition[2 + axis, 2 + axis] = parameters.velocity_retention

    def noise(of_position: float) -> Floats:
        """Return B, without a column for a size that stays as it is."""
        of_velocity = parameters.velocity_noise_px
        deviations = np.array([of_position, of_position, of_velocity, of_velocity, parameters.size_noise])
        return np.ascontiguousarray(np.diag(deviations)[:, : DIMENSION if parameters.follow_size else SIZE])

    small, large = noise(parameters.process_noise_px), noise(parameters.large_process_noise_px)
    return Motion(transition, np.zeros(DIMENSION), small, large)


STEPS_A_WINDOW, COARSE_STEPS, MOST_PLACES = 6, 3, 1000
"""Number of places that a search examines along the shorter side of a window; the same, and in a picture at most, where
cells count as well."""


def mark(target: Target, frame: Frame, parameters: HistogramTrackerParameters, posterior: Gaussian) -> HistogramState:
    """Return the state of a target that is marked, before it is compared with the picture."""
    look = first_look(frame.picture, target.position, parameters)
    view = first_view(frame.picture, parameters)
    known = first_cells(look) if parameters.cells_share > 0.0 else None
    return HistogramState(posterior, 2, look=look, view=view, learned=known, **counted(look, parameters))


class ColouredWindow(LoopModel):
    """A window with the colours of the first one, which keeps its velocity (Kagami 2012).

    Its likelihood is exp(-lambda (1 - rho)) of the window around a particle (Pérez et al. 2002).
    """

    title = "colours of the window"
    evidence = "relative"
    observed = "frame.image_rgb is the picture, (height, width, 3), 0 to 255; u counts its columns, v its rows"
    example = "pftrack.experiments.histogram.example_filter"
    reads = "condensation"

    @override
    def components(self, parameters: Values) -> tuple[Component, ...]:
        return COMPONENTS

    @override
    def prepare(self, state: HistogramState, frame: Frame, parameters: HistogramTrackerParameters) -> HistogramState:
        state = with_model(state, parameters)
        if (state.learned is None) is (parameters.cells_share > 0.0):
            state = replace(state, learned=first_cells(state.look) if parameters.cells_share > 0.0 else None)
        return self._look_elsewhere(follow_camera(state, frame.picture, parameters), frame, parameters)

    def _look_elsewhere(
        self, state: HistogramState, frame: Frame, parameters: HistogramTrackerParameters
    ) -> HistogramState:
        """Return the state of a lost target with a share of the particles at the likeliest places of the whole picture.

        The prior is then a mixture: with that share the target may have come from anywhere.
        """
        particles = state.particles
        if particles is None or not state.searching or state.missed % parameters.lost_after_frames:
            return state
        places, found, _ = self._places(state, frame, parameters)
        best = np.argsort(-found, kind="stable")
        steps = np.floor(parameters.search_share * np.arange(len(particles) + 1))
        chosen = np.flatnonzero(np.diff(steps))[: len(best)]
        states, log_weights = particles.states.copy(order="F"), particles.log_weights.copy()
        states[chosen] = places[best[: len(chosen)]]
        log_weights[chosen] = -np.inf
        log_weights = normalise(log_weights)[0] + float(logarithm(1.0 - len(chosen) / len(particles)))
        log_weights[chosen] = -float(logarithm(len(particles)))
        return replace(state, particles=replace(particles, states=states, log_weights=log_weights))

    def _places(
        self, known: HistogramState, frame: Frame, parameters: HistogramTrackerParameters
    ) -> tuple[Floats, Floats, int]:
        """Return windows at rest all over a picture (K, 5), log p(z | x) (K,), and the distance of neighbours, px."""
        height, width = frame.picture.shape[:2]
        steps = STEPS_A_WINDOW if known.learned is None else COARSE_STEPS
        step = max(int(min(known.first_window.size_px) * float(exponential(known.sure_size))) // steps, 1)
        if known.learned is not None:
            step = max(step, round(float(np.sqrt(width * height / MOST_PLACES))))
        columns, rows = np.arange(step // 2, width, step), np.arange(step // 2, height, step)
        places = np.zeros((len(columns) * len(rows), DIMENSION))
        places[:, :2] = np.stack(np.meshgrid(columns, rows), axis=-1).reshape(-1, 2)
        places[:, SIZE] = known.sure_size
        return places, self.log_likelihood(places, frame, parameters, known), step

    @override
    def propagate(
        self, states: Floats, frame: Frame, parameters: HistogramTrackerParameters, rng: Generator, known: State
    ) -> Floats:
        moves = _motion(parameters)
        noise = rng.standard_normal((len(states), moves.noise.shape[1]))
        moved: Floats = product(states, moves.transition.T) + moves.offset + product(noise, moves.noise.T)
        return moved

    @override
    def motion(self, known: HistogramState, parameters: HistogramTrackerParameters, size: tuple[int, int]) -> Motion:
        return _motion(parameters)

    @override
    def wide(self, parameters: HistogramTrackerParameters) -> tuple[int, float]:
        every = round(1.0 / parameters.wide_share) if parameters.wide_share > 0.0 else 0
        return every, parameters.wide_noise_px / parameters.process_noise_px

    @override
    def pauses(self, parameters: HistogramTrackerParameters) -> bool:
        renewed = parameters.renewal_rate > 0.0 or parameters.cells_share > 0.0
        return parameters.follow_size or parameters.follow_camera or parameters.search_share > 0.0 or renewed

    @override
    def pack(self, known: HistogramState, parameters: HistogramTrackerParameters) -> Packed:
        window = known.first_window
        return Packed(
            bin_table(known.space),
            histogram.roots_of(known.model, known.background),
            float(window.reach_across_px),
            float(window.reach_down_px),
            float(parameters.sharpness),
            known.kernel,
            known.parts,
            known.background,
            (known.learned or cells.NO_CELLS)._replace(share=float(parameters.cells_share if known.learned else 0.0)),
        )

    @override
    def parts(
        self, one: Floats, frame: Frame, parameters: HistogramTrackerParameters, known: HistogramState
    ) -> tuple[Part, ...]:
        """Return the colours of the window and of the model, and the window and the first look."""
        image, first, look = frame.picture, known.first_window, known.look
        factor = float(exponential(np.clip(one[SIZE], -LARGEST, LARGEST)))
        across, down = (int(np.floor(factor * reach + 0.5)) for reach in (first.reach_across_px, first.reach_down_px))
        window = histogram.Window(across, down, known.kernel, known.parts)
        place = one[:2] if np.isfinite(one[:2]).all() else np.full(2, -1e6)
        rho = histogram.similarity(image, place, window, known.space, known.model, known.background)
        found = histogram.shares(image, place, window, known.space)
        colours = tuple(map(tuple, bin_colours(known.space).tolist())) * (len(known.model) // BINS)
        half, learned = half_sides(look, factor), known.learned
        score = () if learned is None else cells.score(learned, image, place, half, cells.HERE)
        return (
            Amount("likeness rho", rho),
            *(Amount("score of the cells", float(one)) for one in score),
            Amount("sharpness lambda", float(parameters.sharpness)),
            Histograms("colours of the model, and of the window", tuple(known.model), tuple(found), colours),
            Patches(
                "first look, and window",
                crop(look.patch_rgb, look.middle, (first.reach_across_px, first.reach_down_px)),
                crop(image, place, (across, down)),
            ),
        )

    @override
    def start(
        self, target: Target, frame: Frame, parameters: HistogramTrackerParameters, rng: Stream
    ) -> HistogramState:
        """Begin at a known place: particles around it, weighed by the first picture."""
        normals = rng.standard_normal((4, parameters.sample_count))
        states = np.zeros((DIMENSION, parameters.sample_count)).T
        states[:, :2] = target.position + parameters.process_noise_px * normals[:2].T
        states[:, VELOCITY] = parameters.initial_velocity_px * normals[2:].T
        state = mark(target, frame, parameters, Gaussian(np.zeros(DIMENSION), np.eye(DIMENSION)))
        log_weights, log_sum = normalise(self.log_likelihood(states, frame, parameters, state))
        particles = ParticleSet(states, log_weights, np.arange(parameters.sample_count))
        log_evidence = log_sum - normalise(np.zeros(len(log_weights)))[1]
        return self.believe(state, Update(particles, log_evidence, False), frame, parameters)

    @override
    def believe(
        self, known: HistogramState, update: Update, frame: Frame, parameters: HistogramTrackerParameters
    ) -> HistogramState:
        believed = replace(
            known,
            posterior=update.posterior,
            particles=update.particles,
            log_evidence=update.log_evidence,
            resampled=update.resampled,
            repeatable=update.repeatable,
            samplers=update.samplers,
            observation_count=update.observation_count,
            switched=update.switched,
            alert=known.alert if update.alert is None else update.alert,
        )
        return judge(believed, frame.picture, parameters)

    @override
    def search(
        self, known: HistogramState, frame: Frame, parameters: HistogramTrackerParameters, rng: Stream
    ) -> HistogramState | None:
        """Look for a lost target all over a picture with all particles, and begin again where it is found.

        Until then only the picture gives its place: the particles are spread over all places in proportion to their
        likelihood. Once the best of them is similar enough, the tracker restarts there.
        """
        if not (known.searching and parameters.search_share == 1.0):
            return None
        places, found, step = self._places(known, frame, parameters)
        count, best = parameters.sample_count, int(found.argmax())
        counted = known.first_window, known.space, known.model, known.background
        likeness = histogram.similarity(frame.picture, places[best, :2], *counted)
        is_found = likeness >= parameters.found_likeness
        if is_found:
            chosen = np.full(count, best)
            log_evidence = 0.0
        else:
            log_weights, log_sum = normalise(found)
            log_evidence = float(log_sum - logarithm(np.array([found.size], np.float64))[0])
            chosen = systematic(rng, log_weights, count)
        states = places[chosen]
        states[:, :2] += step * (rng.random((2, count)).T - 0.5)
        states[:, VELOCITY] = parameters.initial_velocity_px * rng.standard_normal((2, count)).T
        particles = ParticleSet(states, normalise(np.zeros(count))[0], np.arange(count))
        begun = replace(
            known,
            posterior=Gaussian(*particles.moments),
            particles=particles,
            observation_count=count,
            log_evidence=log_evidence,
            resampled=True,
            switched=False,
            alert=None,
        )
        if is_found:
            return judge(replace(begun, missed=0, searching=False), frame.picture, parameters)
        return replace(begun, likeness=likeness)

    @property
    @override
    def series(self) -> tuple[Series, ...]:
        return (*reports.CLOUD, *REPORTED)

    @override
    def measure(self, state: HistogramState) -> Mapping[str, SeriesValue]:
        """Report the particles if there are some, rho of the window, what became of the model, and the box."""
        values = {**super().measure(state)}
        if state.particles is not None:
            x, y = state.particles.states[:, VELOCITY].T
            values["velocities"] = float(len(np.unique(x + 1j * y)))
        first = np.sqrt(model_of(state.look, state.space, state.kernel, state.parts))
        first_likeness = min(float((np.sqrt(state.model) * first).sum()), 1.0)
        return {**values, "likeness": state.likeness, "first_likeness": first_likeness, "box": state.box_px}

    @override
    def fold_series(self, last: HistogramState, count: int) -> Mapping[str, Floats]:
        return {"box": np.tile(last.box_px, (count, 1))}


MODEL = ColouredWindow(_log_likelihood)
"""The model of a window by its colours."""
