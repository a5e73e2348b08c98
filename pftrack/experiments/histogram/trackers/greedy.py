"""Greedy search: the best place near the last one, frame by frame.

It carries one place instead of a cloud and predicts nothing, which is what the lecture sets out from: an object that is
hidden for a moment, or passes a look-alike, is lost for good.
"""

from dataclasses import replace

import numpy as np

from pftrack.core.model.frame import Frame, Target
from pftrack.core.model.tracker import Tracker
from pftrack.core.numerics.compiled import read_only
from pftrack.core.numerics.gaussian import Gaussian
from pftrack.core.numerics.random import Stream
from pftrack.experiments.histogram.trackers.camera import first_view, follow_camera
from pftrack.experiments.histogram.trackers.inspection import LIKELIHOOD
from pftrack.experiments.histogram.trackers.model import counted, first_look, judge, with_model
from pftrack.experiments.histogram.trackers.parameters import HistogramTrackerParameters
from pftrack.experiments.histogram.trackers.reports import SERIES, measure
from pftrack.experiments.histogram.trackers.state import SIZE, HistogramState
from pftrack.experiments.shared.sampling.common import picture_of
from pftrack.vision.likelihoods.colour_bins import bin_table
from pftrack.vision.likelihoods.histogram import roots_of, similarities

__all__ = ["GREEDY"]

ROUNDING = 1.0 / 12.0
"""Variance of a place that is known to a pixel, px^2."""


def start(target: Target, frame: Frame, parameters: HistogramTrackerParameters, rng: Stream) -> HistogramState:
    """Begin at a known place."""
    del rng
    image = picture_of(frame)
    look = first_look(image, target.position, parameters)
    state = HistogramState(
        _belief_at_rest(target.position[0], target.position[1], 0.0),
        2,
        look=look,
        view=first_view(image, parameters),
        **counted(look, parameters),
    )
    return judge(state, image, parameters)


def step(state: HistogramState, frame: Frame, parameters: HistogramTrackerParameters, rng: Stream) -> HistogramState:
    """Go to the place within reach whose window is most like the model; the nearest among equals."""
    del rng
    image = picture_of(frame)
    state = follow_camera(with_model(state, parameters), image, parameters)
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
    "Greedy search",
    "Goes to the best place near the last one, and predicts nothing.",
    start,
    step,
    series=SERIES,
    measure=measure,
    likelihood=LIKELIHOOD,
)
