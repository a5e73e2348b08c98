"""Conditions of the pose of a head and of a hand, whose runs are slow: few of each are drawn."""

from pftrack.experiments.head.trackers.parameters import AS_PUBLISHED
from pftrack.reproduce.diagnosis.condition import Condition, Drawn

__all__ = ["POSE_CONDITIONS"]

PEOPLE: Drawn = {"person": (0, 2000)}
QUICK: Drawn = {**PEOPLE, "speed": (2.0, 3.0)}
FEW = 20
"""Draws of a condition."""
RARE = 80
"""Draws of one whose flaw loses one hand in ten."""

POSE_CONDITIONS = (
    Condition(
        "few particles a feature",
        "sample-impoverishment",
        "head",
        ("pf-asd", "alpha-1"),
        QUICK,
        {"sample_count": (2, 3)},
        frames=70,
        draws=FEW,
    ),
    Condition(
        "a pillar before the face",
        "occlusion-longer-than-memory",
        "head",
        ("pf-asd", "alpha-1"),
        QUICK,
        {"pillar_width_px": (440.0, 600.0)},
        at=15,
        frames=70,
        draws=FEW,
    ),
    Condition(
        "a hand before the face",
        "occlusion-longer-than-memory",
        "head",
        ("pf-asd",),
        QUICK,
        {"hand_cover": (0.9, 1.0)},
        at=15,
        frames=70,
        draws=FEW,
    ),
    Condition(
        "a head that hardly changes its turn",
        "wrong-dynamics",
        "head",
        ("pf-asd", "alpha-1"),
        {**PEOPLE, "speed": (3.0, 4.0)},
        {"pose_change_noise": 0.05, "initial_speed_px": 0.0},
        frames=70,
        draws=FEW,
    ),
    Condition(
        "faster than features are looked for",
        "wrong-dynamics",
        "head",
        ("alpha-1", "alpha-0"),
        {**AS_PUBLISHED, **PEOPLE, "speed": (0.3, 0.6)},
        {"speed": (3.0, 4.0)},
        frames=70,
        draws=FEW,
    ),
    Condition(
        "templates that follow",
        "template-drift",
        "head",
        ("pf-asd", "alpha-0"),
        {**AS_PUBLISHED, **PEOPLE, "speed": (1.0, 2.0)},
        {"template_renewal": (0.1, 0.2)},
        frames=90,
        draws=FEW,
    ),
    Condition(
        "few hands drawn",
        "sample-impoverishment",
        "hand",
        ("particles",),
        {"motion": ["wrist", "bend"], "sample_count": 100},
        {"sample_count": 1},
        frames=30,
        draws=FEW,
    ),
    Condition(
        "one hand kept of another build",
        "mirror-pose",
        "hand",
        ("beam",),
        {"motion": "wrist", "proportions": (0.09, 0.2)},
        {"beam_width": 1},
        frames=30,
        draws=RARE,
    ),
    Condition(
        "stiff fingers",
        "wrong-dynamics",
        "hand",
        ("beam",),
        {"motion": ["bend", "occlusion"]},
        {"flexion_sd_rad": (0.01, 0.03)},
        frames=None,
        draws=FEW,
    ),
)
"""All of them."""
