"""How the ball is lost by a wrong law of motion, and what helps."""

from collections.abc import Sequence

from pftrack.model.diagnostics import Diagnostics
from pftrack.model.failure import Cure, Failure, Finding

__all__ = ["FAILURES"]

BEGINNING = 10


def _other_way(rows: Sequence[Diagnostics]) -> Finding:
    """Compare how far the ball goes down in the first frames with how far the estimate does."""
    first, later = rows[0], rows[BEGINNING]
    true = later.truth[1] - first.truth[1] if later.truth and first.truth else 0.0
    believed = later.estimate[1] - first.estimate[1]
    return Finding(
        believed < 0.5 * true and rows[-1].is_lost,
        "In the first {frames:.0f} frames the ball goes {true:.1f} px down, and the estimate {believed:.1f} px, with a "
        "standard deviation of {sigma:.1f} px; in the last frame it is {error:.1f} px off.",
        {
            "frames": BEGINNING,
            "true": true,
            "believed": believed,
            "sigma": later.sigma[1],
            "error": rows[-1].error or 0.0,
        },
    )


FAILURES = (
    Failure(
        "wrong-dynamics",
        "Wrong dynamics",
        "dynamics",
        "The motion was learned from a ball that swings from side to side, and this one bounces. What was learned "
        "hardly ever goes up or down, so no particle goes where the ball does.",
        "guided",
        6,
        _other_way,
        Cure(
            "A law that expects the same of both directions: constant velocity with a noise of 3 px.",
            {"tracker": "condensation"},
        ),
        {"ball_path": "bounces", "period_s": 3, "sample_count": 100, "occlusion_width_px": 0},
        frames=60,
    ),
)
