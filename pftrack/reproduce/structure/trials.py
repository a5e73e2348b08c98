"""One set of tracks, reconstructed by every method, and what is measured of it."""

from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from pftrack.core.geometry.rotation import angles
from pftrack.core.numerics.angles import wrap
from pftrack.reproduce.structure.scenes import SimulatedTracks, head_tracks, prism_tracks
from pftrack.vision.geometry.face_model import mean_model
from pftrack.vision.structure import growing, online_variational, recursive, variational
from pftrack.vision.structure.alignment import align, residuals, shape_error
from pftrack.vision.structure.cameras import fit_camera, frontal
from pftrack.vision.structure.factorization import factorize
from pftrack.vision.structure.first_window import from_window
from pftrack.vision.structure.online_variational import Forgetting
from pftrack.vision.structure.tracks import Tracks, check_view

__all__ = ["GrowthResult", "OnlineResult", "Trial", "TrialResult", "grow", "online", "run_trial"]

Body: TypeAlias = Literal["prism", 99, 101, 102]
"""The prism, or the face of a driver."""

WINDOW = 90
PRIOR_SD_MM = 3.0
"""Of each coordinate of a face about the mean of others, the size of what people differ by."""

POSE_ROUNDS = 30


@dataclass(frozen=True, slots=True)
class Trial:
    """What is reconstructed.

    Attributes:
        body: What was tracked.
        seed: Of the noise.
        hidden_sd_px: Of a hidden point of the prism.
    """

    body: Body
    seed: int
    hidden_sd_px: float = 50.0


@dataclass(frozen=True, slots=True)
class TrialResult:
    """Errors by Bando 2007, eq. 4.19, after affine alignment.

    Attributes:
        svd: Of the factorization by singular values.
        batch: Of the variational factorization after ten passes, from singular values.
        shapes: What each of these, and Bando's online method as published, reconstructed; aligned, mm.
        energies: (10,) free energy after each pass.
        recursive: (steps,) of the project's own method without a prior, from the first full window on.
    """

    svd: float
    batch: float
    shapes: dict[str, NDArray[np.float64]]
    energies: NDArray[np.float64]
    recursive: NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class OnlineResult:
    """Errors of the online method.

    Attributes:
        steps: (steps,) of the shape after each step with a full window.
        published: Of the shape that was published in the end: that of the greatest free energy.
        residuals_mm: (n,) of its points.
        shape_mm: (n, 3) that shape, aligned.
    """

    steps: NDArray[np.float64]
    published: float
    residuals_mm: NDArray[np.float64]
    shape_mm: NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class GrowthResult:
    """What a model that grows from the mean face does.

    Attributes:
        mean_mm: Distance of the mean face from the driver's, root mean square after a similarity.
        own_mm: The same of the own shape in the end.
        pose_deg: (3,) mean absolute error of the angles, mean of the axes, by the mean face, by what is published and
            by the driver's true face.
        weight: (frames,) of the own shape.
    """

    mean_mm: float
    own_mm: float
    pose_deg: NDArray[np.float64]
    weight: NDArray[np.float64]


def tracks_of(trial: Trial) -> SimulatedTracks:
    """Return the tracks of a trial."""
    if trial.body == "prism":
        return prism_tracks(trial.seed, hidden_sd_px=trial.hidden_sd_px)
    return head_tracks(trial.body, trial.seed)


def run_trial(trial: Trial) -> TrialResult:
    """Reconstruct by all frames at once, and by the recursion."""
    body = tracks_of(trial)
    truth = body.shape_mm
    equal, weighed = factorize(body.tracks).shape, variational.fit(body.tracks)
    positions, variances = body.tracks.positions, body.tracks.variances
    state = from_window(Tracks(positions[:WINDOW], variances[:WINDOW]), recursive.Settings(body.focal_px))
    errors = [shape_error(state.shape, truth)]
    for index in range(WINDOW, len(positions)):
        state = recursive.step(state, positions[index], variances[index])
        errors.append(shape_error(state.shape, truth))
    return TrialResult(
        shape_error(equal, truth),
        shape_error(weighed.shape, truth),
        {"svd": align(equal, truth), "batch": align(weighed.shape, truth), "true": truth},
        weighed.free_energies,
        np.array(errors),
    )


def online(trial: Trial, memory: float, forgetting: Forgetting) -> OnlineResult:
    """Reconstruct by Bando's online method."""
    body = tracks_of(trial)
    settings = online_variational.Settings(window=WINDOW, memory=memory, forgetting=forgetting)
    states = [state for state in online_variational.run(body.tracks, settings) if state.full]
    published = states[-1].published
    if published is None:
        raise RuntimeError("a full window publishes a shape")
    return OnlineResult(
        np.array([shape_error(state.shape, body.shape_mm) for state in states]),
        shape_error(published, body.shape_mm),
        residuals(published, body.shape_mm),
        align(published, body.shape_mm),
    )


def grow(trial: Trial) -> GrowthResult:
    """Let a model grow from the mean face, and find each frame's pose by what was published before it."""
    body, mean = tracks_of(trial), mean_model().points_mm
    covariance = np.tile(PRIOR_SD_MM**2 * np.eye(3), (len(mean), 1, 1))
    state = growing.begin(mean, covariance, growing.Settings(body.focal_px))
    cameras: list[NDArray[np.float64]] = []
    errors, weights = [], []
    for index, theta in enumerate(body.theta_rad):
        positions, variances = body.tracks.positions[index], body.tracks.variances[index]
        rows, precisions = check_view(positions, variances, len(mean))
        cameras = cameras or [frontal(body.focal_px, mean, rows, precisions)] * 3
        shapes = mean, state.shape, np.array(body.shape_mm)
        cameras = [
            fit_camera(body.focal_px, camera, shape, rows, precisions, camera, 0.0, POSE_ROUNDS)
            for camera, shape in zip(cameras, shapes, strict=True)
        ]
        found = [angles(np.ascontiguousarray(camera[:, :3])) for camera in cameras]
        errors.append([np.abs(wrap(one - theta)).mean() for one in found])
        state = growing.step(state, positions, variances)
        weights.append(state.weight)
    return GrowthResult(
        _distance(mean, body.shape_mm),
        _distance(state.own.shape, body.shape_mm),
        np.rad2deg(np.mean(errors, axis=0)),
        np.array(weights),
    )


def _distance(shape: NDArray[np.float64], truth: NDArray[np.float64]) -> float:
    return float(np.sqrt(np.square(residuals(shape, truth, "similarity")).mean()))
