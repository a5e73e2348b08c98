"""How probable a hand is before it is compared with the picture: Gaussians around the predictions of the kept hands.

Every kept hand predicts where a hand may be, with the probability that it has itself. A hand may have come from any of
them, so its prior is the sum over all predictions (Shimada 1997, eq. 2.13), each a Gaussian (eqs. 2.4 and 2.12):

    P_b(q) = sum_i P_f(q_i) N(q; q_i, Lambda).

Two predictions that agree so count for more than one that stands alone. The other way is to give each hand the share of
the prediction near which it was looked for, and no more.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pftrack.core.numerics.compiled import compiled
from pftrack.experiments.hand.shape import ANGLES
from pftrack.experiments.hand.trackers.settings import Settings
from pftrack.filters.particles import normalise

__all__ = ["Predictions", "log_prior", "log_shares", "palm_log_shares"]


class Predictions(NamedTuple):
    """Where hands are expected.

    Attributes:
        poses: (I, 25).
        log_weights: (I,) logarithms of P_f, up to a constant.
    """

    poses: NDArray[np.float64]
    log_weights: NDArray[np.float64]


@compiled
def palm_log_shares(pose: NDArray[np.float64], predictions: Predictions, settings: Settings) -> NDArray[np.float64]:
    """Return what each prediction gives to the prior of a palm (I,), as logarithms: three angles of a pose (25,)."""
    shares = np.empty(predictions.poses.shape[0])
    for i in range(shares.shape[0]):
        shares[i] = predictions.log_weights[i] - 0.5 * _palm_square(pose, predictions.poses[i], settings)
    return shares


@compiled
def log_shares(pose: NDArray[np.float64], predictions: Predictions, settings: Settings) -> NDArray[np.float64]:
    """Return what each prediction gives to the prior of a whole hand (I,), as logarithms up to a constant.

    A finger's flexion is the mean of its three joints, which bend alike.

    Args:
        pose: (25,).
        predictions: I of them.
        settings: Standard deviations.
    """
    shares = np.empty(predictions.poses.shape[0])
    for i in range(shares.shape[0]):
        predicted = predictions.poses[i]
        square = _palm_square(pose, predicted, settings)
        for j in range(2):
            off = (pose[j] - predicted[j]) / settings.wrist_sd
            square += off * off
        for at in range(5, ANGLES, 4):
            turn, bent = (pose[at] - predicted[at]) / settings.spread_sd, 0.0
            for j in range(at + 1, at + 4):
                bent += (pose[j] - predicted[j]) / (3.0 * settings.flexion_sd)
            square += turn * turn + bent * bent
        shares[i] = predictions.log_weights[i] - 0.5 * square
    return shares


@compiled
def log_prior(shares: NDArray[np.float64], origin: int, mixture: bool) -> float:
    """Return the log prior of a hand of shares (I,): of all predictions (eq. 2.13), or of the one it was found near."""
    return float(normalise(shares)[1] if mixture else shares[origin])


@compiled
def _palm_square(pose: NDArray[np.float64], predicted: NDArray[np.float64], settings: Settings) -> float:
    square = 0.0
    for j in range(2, 5):
        off = (pose[j] - predicted[j]) / (settings.tilt_sd if j == 3 else settings.turn_sd)
        square += off * off
    return square
