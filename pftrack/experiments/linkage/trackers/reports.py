"""What all trackers of a chain report of their states."""

from collections.abc import Mapping

import numpy as np

from pftrack.core.model.series import Hypotheses, Interval, Reduction, Series, SeriesValue
from pftrack.core.numerics.angles import wrap
from pftrack.experiments.linkage.shape import LINKS
from pftrack.experiments.linkage.trackers.state import LinkageState
from pftrack.experiments.shared import reports
from pftrack.experiments.shared.innovation import NIS, measure_innovation
from pftrack.filters.particles import ParticleSet

__all__ = ["GAUSSIAN_SERIES", "PARTICLE_SERIES", "SERIES", "measure"]

COMPONENTS = ("direction 1", "direction 2", "direction 3", "length 1", "length 2", "length 3")

SERIES = (
    *(Series(f"length_{i}", f"length of link {i}", "px", "interval") for i in range(1, LINKS + 1)),
    *(Series(f"direction_{i}", f"direction of link {i}", "°") for i in range(1, LINKS + 1)),
    *(Series(f"direction_{i}_sd", f"deviation of direction {i}", "°") for i in range(1, LINKS + 1)),
    Series("mirror_gap", "from the nearest mirror image, in deviations", role="mirror_gap"),
    Series("hypothesis_count", "hypotheses", reductions=(Reduction("mean_hypotheses", "mean hypotheses", "mean"),)),
    Series("hypotheses", "hypotheses", shape="hypotheses", components=COMPONENTS),
    Series(
        "split",
        "split",
        role="event",
        colours=("prediction",),
        reductions=(Reduction("splits", "frames with a split", "count"),),
    ),
    Series("merged", "merged", role="event", colours=("hidden",)),
    Series(
        "refuted",
        "refuted",
        role="event",
        colours=("lost",),
        reductions=(Reduction("refutations", "frames that refuted", "count"),),
    ),
    Series("cut", "bounds that cut"),
    Series(
        "outlier",
        "left out",
        role="event",
        colours=("observation",),
        reductions=(Reduction("outliers", "observations left out", "count"),),
    ),
)
"""Of every tracker: the range of each length, directions, hypotheses, and what happened. The range is two standard
deviations to either side, the middle 95 % of particles, or all that is not excluded; of hypotheses, of all together."""

GAUSSIAN_SERIES = (*SERIES, *NIS, Series("seen_px", "what was measured", "px", "vector", role="measured"))

PARTICLE_SERIES = (*SERIES, *reports.CLOUD)


def measure(state: LinkageState) -> Mapping[str, SeriesValue]:
    """Return the values of the series."""
    belief, events = state.belief, state.events
    lengths = {
        f"length_{i + 1}": Interval(float(state.low[i - LINKS]), float(state.high[i - LINKS])) for i in range(LINKS)
    }
    angles = {f"direction_{i + 1}": float(np.rad2deg(state.directions[i])) for i in range(LINKS)}
    deviations = {f"direction_{i + 1}_sd": float(np.rad2deg(state.directions_sd[i])) for i in range(LINKS)}
    happened = {
        "split": float(events.splits > 0),
        "merged": float(events.merges > 0),
        "refuted": float(events.refuted > 0),
        "cut": float(events.truncated),
        "outlier": float(events.outlier),
    }
    innovation = measure_innovation(state.innovation)
    values: dict[str, SeriesValue] = {**lengths, **angles, **deviations, **happened, **innovation}
    if not state.in_space:
        values["mirror_gap"] = _mirror_gap(state)
    if state.seen_px:
        values["seen_px"] = state.seen_px
    if isinstance(belief, ParticleSet):
        return {**values, **reports.cloud(belief, resampled=bool((belief.ancestors != np.arange(len(belief))).any()))}
    poses = tuple(
        (*np.rad2deg(member.pose[:LINKS]).tolist(), *member.pose[LINKS:].tolist()) for member in belief.members
    )
    weights = tuple(belief.weights.tolist())
    return {
        **values,
        "hypothesis_count": float(len(belief)),
        "hypotheses": Hypotheses(poses, weights, parents=tuple(belief.parents.tolist())),
    }


def _mirror_gap(state: LinkageState) -> float:
    """Return how many deviations it is to the nearest pose with one link mirrored in depth, from theta* to -theta*.

    In the plane it is seen just the same, so nothing that is measured tells which of both is the true one; where they
    are near each other, a filter may come out on the other side.
    """
    ways = np.abs(wrap(2.0 * state.directions))
    with np.errstate(divide="ignore", invalid="ignore"):
        return float((ways / state.directions_sd).min())
