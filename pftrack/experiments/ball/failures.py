"""How the ball is lost by a wrong law of motion, and what helps."""

from pftrack.core.model.failure import Cure, Failure

__all__ = ["FAILURES"]

FAILURES = (
    Failure(
        "wrong-dynamics",
        "Wrong dynamics",
        "dynamics",
        "The motion was learned from a ball that swings from side to side, and this one bounces. What was learned "
        "hardly ever goes up or down, so no particle goes where the ball does.",
        "guided",
        6,
        "wrong-dynamics",
        Cure(
            "A law that expects the same of both directions: constant velocity with a noise of 3 px.",
            {"tracker": "condensation"},
        ),
        {"ball_path": "bounces", "period_s": 3, "sample_count": 100, "occlusion_width_px": 0},
        frames=60,
    ),
)
