"""Two ways in which a single Gaussian goes wrong about a chain of links, and what helps."""

from pftrack.core.model.failure import Cure, Failure
from pftrack.experiments.linkage.presets import CROSS, STATIC

__all__ = ["FAILURES"]

FAILURES = (
    Failure(
        "mirror-pose",
        "Mirror pose",
        "collapse",
        "The third link passes the pose parallel to the image. From there on leaning away and leaning towards look the "
        "same; one Gaussian has to be on one side, and stays on the wrong one while the picture fits all the time.",
        "ekf-truncated",
        18,
        "mirror-pose",
        Cure(
            "Several filters: where the link is nearly parallel both sides are followed, until a joint's limit refutes "
            "the wrong one in frame 36.",
            {"tracker": "ekf-mirrors"},
        ),
        CROSS,
    ),
    Failure(
        "shrinking-covariance",
        "Shrinking covariance",
        "collapse",
        "Nothing moves, and each frame is the same one again. The filter linearises about its own estimate and counts "
        "each for news: the interval shrinks about a length that is wrong, and direction and length can no longer be "
        "put right.",
        "ekf",
        17,
        "shrinking-covariance",
        Cure(
            "Regions of all that is possible: a frame that repeats the one before excludes nothing more, and the true "
            "length stays inside.",
            {"tracker": "ellipsoids"},
        ),
        STATIC,
        frames=100,
    ),
)
