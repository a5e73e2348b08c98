"""Trackers of a window by the histogram of its colours (Kagami 2012, after Pérez et al. 2002).

All carry position and velocity, and the size of the window beside the first one, which stays as it is unless it is to
be followed. Condensation is the lecture's filter (SIR): a time update with constant velocity, weights by the
likelihood, systematic resampling in every frame. The other samplers are those of Bando 2007: they draw parents with
regard to the new picture, always or when they are unsure, by the same likelihood.
"""

from dataclasses import replace
from operator import attrgetter

import numpy as np

from pftrack.core.model.source import Frame, Target
from pftrack.core.model.tracker import Tracker
from pftrack.core.numerics.compiled import read_only
from pftrack.core.numerics.random import Gaussian, Stream
from pftrack.experiments.histogram.model import MODEL, REPORTED, SIZE, HistogramState, judge, mark
from pftrack.experiments.histogram.parameters import HistogramTrackerParameters
from pftrack.experiments.shared.filtered import filtered
from pftrack.experiments.shared.sampling import AUXILIARY, CONDENSATION, HARD, NOISE_CONTROL, SOFT
from pftrack.vision.likelihoods.counting import bin_table
from pftrack.vision.likelihoods.histogram import roots_of, similarities

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


GREEDY = Tracker(
    "greedy",
    "",
    "",
    start,
    step,
    series=REPORTED[1:],
    measure=MODEL.measure,
    model=MODEL,
)


TRACKERS: dict[str, Tracker] = {
    name: replace(tracker, searching=attrgetter("searching"))
    for name, tracker in filtered(MODEL, CONDENSATION, AUXILIARY, HARD, SOFT, NOISE_CONTROL).items()
} | {GREEDY.id: GREEDY}
"""The trackers by name, in the order in which they are shown."""
