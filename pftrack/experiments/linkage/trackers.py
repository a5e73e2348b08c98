"""Trackers of a chain of three links before one camera, by name: lengths and pose at once, from its joints.

Depth is not seen, so that image positions alone determine neither; what is known beforehand of joints, motion and
lengths has to. Two families use it in two ways (Shimada 1997):

- Gaussians, which it cuts: `gaussians` steps a beam of extended Kalman filters, one for each side on which a link may
  lie (`linearised`), or one unscented filter; `particles` draws instead (`sampled`);
- sets, which it bounds: `set_trackers` steps ellipsoids and guides that the truth never leaves.

All believe in one `state`, so that they take over from one another, and read one set of `parameters`.
"""

from functools import partial

from pftrack.core.model.tracker import Tracker
from pftrack.experiments.linkage import gaussians, particles, set_trackers
from pftrack.experiments.linkage.set_trackers import Chain, ChainParticles
from pftrack.experiments.linkage.state import GAUSSIAN_SERIES, PARTICLE_SERIES, SERIES, measure


def _filter(name: str, title: str, description: str) -> Tracker:
    step = gaussians.unscented_step if name == "ukf" else partial(gaussians.filter_step, name)
    started = name, title, description, gaussians.start, step
    return Tracker(*started, series=GAUSSIAN_SERIES, measure=measure, model=Chain())


def _sets(name: str, title: str, description: str) -> Tracker:
    started = name, title, description, partial(set_trackers.start, name), partial(set_trackers.step, name)
    return Tracker(*started, series=SERIES, measure=measure, model=Chain())


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
        _filter(
            "ukf",
            "UKF with bounds",
            "One unscented Kalman filter, its Gaussian cut by the bounds of joints and lengths in each frame.",
        ),
        Tracker(
            "particles",
            "Particle filter with bounds",
            "Particles are lengths and noises, each with a Kalman filter of the pose; a Markov kernel draws new ones.",
            gaussians.start,
            particles.step,
            series=PARTICLE_SERIES,
            measure=measure,
            model=ChainParticles(),
        ),
        _sets(
            "ellipsoids",
            "Guided ellipsoids",
            "Keeps every pose and length that is possible, in ellipsoids and boxes that bound each other.",
        ),
        _sets(
            "ellipsoids-literal",
            "Ellipsoids as in the source",
            "Keeps what is possible in ellipsoids, whose extent alone bounds the lengths.",
        ),
        _sets(
            "box-guides",
            "Guides alone",
            "Keeps what is possible in boxes, shrunk by interval arithmetic, without any ellipsoid.",
        ),
    )
}
"""All trackers by name, in the order in which they are shown."""
