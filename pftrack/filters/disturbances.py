"""Smoothing disturbances: how large the noises of a linear Gaussian model were, given all frames.

The forward filter keeps its predictions and their errors. In the backward pass r_t gathers the information of all later
measurements on the state of frame t, and N_t its precision. From these follow the noises themselves:

    E[u_t | Z] = B_t^T r_t,    var[u_t | Z] = I - B_t^T N_t B_t.

Unlike the recursion of Rauch, Tung and Striebel (1965), which gives the same moments, this does not invert a predicted
covariance, which is singular where a state holds its own past.

Source: Koopman 1993; Durbin and Koopman 2012, sections 4.4 and 4.5.
"""

from dataclasses import dataclass

import numpy as np

from pftrack.core.arrays import Bools, Floats, check
from pftrack.core.model.model import LinearChain
from pftrack.core.numerics.compiled import compiled
from pftrack.core.numerics.matrices import contiguous_copy, multiply, solve
from pftrack.core.numerics.random import log_densities


@dataclass(frozen=True, slots=True, eq=False)
class Disturbances:
    """How large the noises were.

    Attributes:
        log_evidence: (T,) log p(z_t | z_{1:t-1}), 0 where nothing was measured.
        process: Mean of E[u^2 | Z] over all frames and components: 1 if the noise was as large as assumed.
        observation: Mean of E[v^T R^-1 v | Z] / m over the frames with a measurement, likewise.
        process_count: Count of numbers in the first mean.
        observation_count: Count of numbers in the second mean.
    """

    log_evidence: Floats
    process: float
    observation: float
    process_count: int
    observation_count: int


def smooth_disturbances(
    chain: LinearChain, process_factor: float = 1.0, observation_factor: float = 1.0
) -> Disturbances:
    """Return how large the noises of a chain were.

    Args:
        chain: The model and its measurements.
        process_factor: Factor of the covariance of the process noise.
        observation_factor: Factor of the covariance of the observation noise.

    Raises:
        TypeError: An argument is not an array of real numbers.
        ValueError: An array has another shape, or is not finite.
        numpy.linalg.LinAlgError: An innovation covariance is singular.
    """
    check(
        mean=(chain.mean, "d"),
        covariance=(chain.covariance, "d d"),
        transitions=(chain.transitions, "T d d"),
        offsets=(chain.offsets, "T d"),
        noises=(chain.noises, "T d k"),
        observations=(chain.observations, "T m d"),
        covariances=(chain.covariances, "T m m"),
    )
    check(missing=True, covariances=(chain.covariances, "T m m"), measurements=(chain.measurements, "T m"))
    measured = np.asarray(np.isfinite(chain.measurements).all(axis=1))
    noises, covariances = chain.noises * np.sqrt(process_factor), chain.covariances * observation_factor
    # Compiling takes seconds for each order in memory, and chains are made of views and transposes.
    model = LinearChain(*map(contiguous_copy, chain._replace(noises=noises, covariances=covariances)))
    forward, regular = _go_forward(model, measured)
    if not regular:
        raise np.linalg.LinAlgError("Singular matrix")
    evidence, innovations, precisions, gains = forward
    process, observation = _go_back(innovations, precisions, gains, model, measured)
    process_count = noises.shape[0] * noises.shape[2]
    observation_count = int(measured.sum()) * chain.measurements.shape[1]
    return Disturbances(
        evidence,
        process / max(process_count, 1),
        observation / max(observation_count, 1),
        process_count,
        observation_count,
    )


@compiled
def _go_forward(chain: LinearChain, measured: Bools) -> tuple[tuple[Floats, Floats, Floats, Floats], bool]:
    """Return the filter's values of each frame, and whether all innovation covariances are regular.

    That is the log evidence (T,), the innovation (T, m, 1), its precision (T, m, m) and the gain (T, d, m).
    """
    mean, covariance, transitions, offsets, noises, measurements, observations, covariances = chain
    frames, size = offsets.shape
    count = measurements.shape[1]
    innovations, precisions = np.zeros((frames, count, 1)), np.zeros((frames, count, count))
    gains, evidence = np.zeros((frames, size, count)), np.zeros(frames)
    kept = (evidence, innovations, precisions, gains)
    known, spread = mean.reshape(size, 1).copy(), covariance.copy()
    for t in range(frames):
        known = multiply(transitions[t], known) + offsets[t].copy().reshape(size, 1)
        spread = multiply(multiply(transitions[t], spread), transitions[t].T.copy())
        spread += multiply(noises[t], noises[t].T.copy())
        if measured[t]:
            cross = multiply(observations[t], spread)
            around = multiply(cross, observations[t].T.copy()) + covariances[t]
            precisions[t], regular = solve(around, np.eye(count))
            innovations[t] = measurements[t].copy().reshape(count, 1) - multiply(observations[t], known)
            densities, positive = log_densities(
                innovations[t].copy().reshape(1, count), around.reshape(1, count, count)
            )
            if not (regular and positive):
                return kept, False
            evidence[t] = densities[0]
            gains[t] = multiply(cross.T.copy(), precisions[t])
            known = known + multiply(gains[t], innovations[t])
            left = np.eye(size) - multiply(gains[t], observations[t])
            added = multiply(multiply(gains[t], covariances[t]), gains[t].T.copy())
            spread = multiply(multiply(left, spread), left.T.copy()) + added
            spread = 0.5 * (spread + spread.T)
    return kept, True


@compiled
def _go_back(
    innovations: Floats, precisions: Floats, gains: Floats, chain: LinearChain, measured: Bools
) -> tuple[float, float]:
    """Return the sums of E[u^T u | Z] over all frames, and of E[v^T R^-1 v | Z] over those with a measurement."""
    frames, size = chain.offsets.shape
    # r and N of the state of a frame: after its measurement, before it, and then of the frame before.
    said, sure = np.zeros((size, 1)), np.zeros((size, size))
    process, observation = 0.0, 0.0
    for t in range(frames - 1, -1, -1):
        if measured[t]:
            gain = gains[t].T.copy()
            heard = multiply(precisions[t], innovations[t])
            error = heard - multiply(gain, said)
            doubt = precisions[t] + multiply(multiply(gain, sure), gains[t])
            observation += len(error) + np.sum(chain.covariances[t] * (multiply(error, error.T.copy()) - doubt))
            left = np.eye(size) - multiply(gains[t], chain.observations[t])
            there = chain.observations[t].T.copy()
            said = multiply(there, heard) + multiply(left.T.copy(), said)
            sure = multiply(multiply(left.T.copy(), sure), left)
            sure += multiply(multiply(there, precisions[t]), chain.observations[t])
        drive = chain.noises[t].T.copy()
        moved, doubts = multiply(drive, said), multiply(multiply(drive, sure), chain.noises[t])
        process += len(moved) + np.sum(moved * moved) - np.trace(doubts)
        said = multiply(chain.transitions[t].T.copy(), said)
        sure = multiply(multiply(chain.transitions[t].T.copy(), sure), chain.transitions[t])
    return process, observation
