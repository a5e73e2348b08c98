"""The trackers of a chain by name."""

from functools import partial

from pftrack.core.model.tracker import Tracker
from pftrack.experiments.linkage.trackers import gaussians, particles, sets
from pftrack.experiments.linkage.trackers.inspection import hypotheses_of, particles_of, range_parts
from pftrack.experiments.linkage.trackers.reports import GAUSSIAN_SERIES, PARTICLE_SERIES, measure

__all__ = ["TRACKERS"]


def _filter(name: str, title: str, description: str) -> Tracker:
    step = partial(gaussians.filter_step, name)
    return Tracker(
        name,
        title,
        description,
        gaussians.start,
        step,
        series=GAUSSIAN_SERIES,
        measure=measure,
        cloud=hypotheses_of,
        update_parts=range_parts,
    )


TRACKERS = {
    tracker.id: tracker
    for tracker in (
        _filter(
            "ekf-mirrors",
            "EKF with mirror hypotheses",
            "Follows both sides of a link that passes the parallel to the image, until bounds refute one.",
        ),
        _filter(
            "ekf-truncated",
            "EKF with bounds",
            "One extended Kalman filter, its Gaussian cut by the bounds of joints and lengths in each frame.",
        ),
        _filter("ekf", "EKF", "One extended Kalman filter that knows no bounds."),
        Tracker(
            "ukf",
            "UKF with bounds",
            "One unscented Kalman filter, its Gaussian cut by the bounds of joints and lengths in each frame.",
            gaussians.start,
            gaussians.unscented_step,
            series=GAUSSIAN_SERIES,
            measure=measure,
            cloud=hypotheses_of,
            update_parts=range_parts,
        ),
        Tracker(
            "particles",
            "Particle filter with bounds",
            "Particles are lengths and noises, each with a Kalman filter of the pose; a Markov kernel draws new ones.",
            gaussians.start,
            particles.step,
            series=PARTICLE_SERIES,
            measure=measure,
            cloud=particles_of,
            update_parts=range_parts,
        ),
    )
} | sets.TRACKERS
"""All trackers by name, in the order in which they are shown."""
