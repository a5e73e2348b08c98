"""What trackers of a solid's points report beside the pose: of their particles, and of each feature."""

from collections.abc import Callable, Mapping

import numpy as np

from pftrack.core.model.series import Reduction, Series, SeriesValue
from pftrack.experiments.shared.pose.methods import Method
from pftrack.experiments.shared.pose.state import PoseState

__all__ = ["measurement", "report"]


def report(method: Method, features: tuple[str, ...]) -> tuple[Series, ...]:
    """Return the series of a method that tracks a solid whose features have these names."""
    common = (
        Series("ess", "ESS", role="ess"),
        Series("particles", "particles", role="particles"),
        Series("feature_recognised", "recognised", shape="vector", role="flag", components=features),
        Series("feature_x_px", "position, x", "px", "vector", components=features),
        Series("feature_y_px", "position, y", "px", "vector", components=features),
        Series("feature_sd_px", "standard deviation", "px", "vector", components=features),
        Series(
            "switched",
            "switched",
            role="flag",
            reductions=(Reduction("switches", "frames in which a feature changed its prediction", "count"),),
        ),
    )
    if method == "rb-pf":
        return common
    return (
        *common,
        Series("alpha", "alpha", shape="vector", components=features),
        Series(
            "samples",
            "proposals",
            shape="vector",
            role="share",
            components=("own past", "solid"),
            colours=("prediction", "observation"),
            reductions=(Reduction("solid_share", "share of particles from the solid's pose", "share", "solid"),),
        ),
        Series("unique_ancestors", "survivors"),
    )


def measurement(series: tuple[Series, ...]) -> Callable[[PoseState], Mapping[str, SeriesValue]]:
    """Return a function that measures these series of a state.

    ESS and number of particles are sums over the features, where each has particles of its own. Alpha is the share of
    the solid's prediction as learned up to this frame; the samples are those of this frame. While a lost object is
    looked for, its belief may still be that of the method before, and have more or less than is declared.
    """
    names = {one.name for one in series}

    def measure(state: PoseState) -> Mapping[str, SeriesValue]:
        weights = np.exp(state.belief.log_weights)
        own = {name: value for name, value in state.belief.own_series().items() if name in names}
        return own | {
            "ess": float((1.0 / np.square(weights).sum(axis=-1)).sum()),
            "particles": float(weights.size),
            "feature_recognised": tuple(state.recognised.astype(np.float64).tolist()),
            "feature_x_px": tuple(state.feature_means[:, 0].tolist()),
            "feature_y_px": tuple(state.feature_means[:, 1].tolist()),
            "feature_sd_px": tuple(np.sqrt(np.trace(state.feature_covariances, axis1=1, axis2=2) / 2.0).tolist()),
            "switched": float(state.switched),
        }

    return measure
