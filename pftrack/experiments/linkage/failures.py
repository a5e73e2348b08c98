"""Two ways in which a single Gaussian goes wrong about a chain of links, and what helps."""

from collections.abc import Sequence

from pftrack.experiments.linkage.presets import CROSS, STATIC
from pftrack.geometry.linkage import LINKS
from pftrack.model.diagnostics import Diagnostics
from pftrack.model.failure import Cure, Failure, Finding

__all__ = ["FAILURES"]


def _mirror(rows: Sequence[Diagnostics]) -> Finding:
    """Compare the direction of the last link with the true one, and with that one's mirror image in depth."""
    last = rows[-1]
    true = sum((last.truth or ())[:LINKS]) % 360
    believed, mirror = last.number("direction_3") % 360, 360 - true
    return Finding(
        abs(believed - mirror) < abs(believed - true) and abs(believed - true) > 60,
        "In the last frame link 3 is believed to point to {believed:.0f}°; it points to {true:.0f}°, which the camera "
        "cannot tell from {mirror:.0f}°.",
        {"believed": believed, "true": true, "mirror": mirror},
    )


def _sure(rows: Sequence[Diagnostics]) -> Finding:
    """Ask whether the last link's length lies within what is believed of it, and how wide that was and is."""
    last = rows[-1]
    low, high = last.vector("length_3") or (0.0, 0.0)
    first_low, first_high = rows[1].vector("length_3") or (0.0, 0.0)
    true = (last.truth or (0.0,))[-1]
    return Finding(
        not low <= true <= high and high - low < 2,
        "Link 3 is believed to be {first_low:.1f} to {first_high:.1f} px long in frame 1, and {low:.1f} to {high:.1f} "
        "px in the last frame; it is {true:.1f} px long.",
        {"first_low": first_low, "first_high": first_high, "low": low, "high": high, "true": true},
    )


FAILURES = (
    Failure(
        "mirror-pose",
        "Mirror pose",
        "collapse",
        "The third link passes the pose parallel to the image. From there on leaning away and leaning towards look the "
        "same; one Gaussian has to be on one side, and stays on the wrong one while the picture fits all the time.",
        "ekf-truncated",
        18,
        _mirror,
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
        _sure,
        Cure(
            "Regions of all that is possible: a frame that repeats the one before excludes nothing more, and the true "
            "length stays inside.",
            {"tracker": "ellipsoids"},
        ),
        STATIC,
        frames=100,
    ),
)
