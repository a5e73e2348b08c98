"""Conditions: runs in which one thing is wrong, because it was put there (`Condition`); those of poses as well.

A condition is a run that holds, and one change to it by which it fails, the *flaw*. What is lost with the flaw and held
without it, on the same seed, was lost because of it: so the cause is known without anybody's opinion. Parameters of the
flaw, trackers and seeds are drawn, by a number each, so that there are as many different runs of a condition as one
wants.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TypeAlias

from pftrack.core.model.parameters import Value
from pftrack.core.model.preset import CauseId
from pftrack.core.model.recipe import Change, Recipe
from pftrack.core.numerics.random import Purpose, Stream
from pftrack.experiments.head.parameters import AS_PUBLISHED

Range: TypeAlias = tuple[float, float]
"""Bounds between which a number is drawn; a list is of values of which one is drawn."""

KEPT_FROM = 2000
"""Draws that are kept aside have numbers from here on: odd ones below had been counted before."""

Drawn: TypeAlias = Mapping[str, "Value | Range | list[Value]"]


@dataclass(frozen=True)
class Condition:
    """A run that holds, and what makes it fail.

    Attributes:
        name: Of the condition.
        cause: What the flaw is a case of.
        experiment: Id of the experiment.
        trackers: Of which one is drawn.
        base: Values of the run that holds: given, or drawn.
        flaw: Values that differ in the one that fails, given or drawn.
        at: Frame at which the flaw comes; 0 for a whole run with it.
        cured_by: Another tracker than the drawn one for the run that holds.
        frames: Length of both.
        draws: How many there are of it in the study, half of them kept aside (`numbers`).
    """

    name: str
    cause: CauseId
    experiment: str
    trackers: tuple[str, ...]
    base: Drawn = field(default_factory=dict)
    flaw: Drawn = field(default_factory=dict)
    at: int = 0
    cured_by: str = ""
    frames: int | None = 60
    draws: int = 24

    @property
    def numbers(self) -> tuple[int, ...]:
        """The draws of the study: even numbers are of those on which rules are made, odd ones of those kept aside."""
        return (*range(0, self.draws, 2), *range(KEPT_FROM + 1, KEPT_FROM + self.draws, 2))

    def draw(self, number: int) -> tuple[Recipe, Recipe]:
        """Return a run with the flaw and the same without it.

        Args:
            number: From which all that is drawn follows, the seed included.
        """
        chances = Stream(number, 0, Purpose.SCENE)
        tracker = self.trackers[int(chances.random() * len(self.trackers))]
        base, flaw = (
            {name: _draw(said, chances.random()) for name, said in it.items()} for it in (self.base, self.flaw)
        )
        begin = (Change(0, base),) if base else ()
        wrong = (Change(0, {**base, **flaw}),) if self.at == 0 else (*begin, Change(self.at, flaw))
        return (
            self._recipe(tracker, number, wrong),
            self._recipe(self.cured_by or tracker, number, begin),
        )

    def _recipe(self, tracker: str, seed: int, timeline: Sequence[Change]) -> Recipe:
        return Recipe(
            experiment=self.experiment, tracker=tracker, seed=seed, frames=self.frames, timeline=tuple(timeline)
        )


def _draw(said: "Value | Range | list[Value]", chance: float) -> Value:
    if isinstance(said, list):
        return said[int(chance * len(said))]
    if isinstance(said, tuple):
        low, high = said
        value = low + (high - low) * chance
        return round(value) if isinstance(low, int) and isinstance(high, int) else value
    return said


# Runs of the pose of a head and of a hand are slow: few of each are drawn.

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

CALM: Drawn = {"occlusion_width_px": 0, "distracter_radius_px": 0}
WIDE: Drawn = {**CALM, "process_noise_px": 6}
SLOW: Drawn = {**WIDE, "period_s": 2.0}
SAMPLED = ("condensation", "h-spf", "s-spf", "apf", "pc-pf")
BY_PREDICTION = ("condensation", "pc-pf")
LAWN: Drawn = {"scene_number": (0, 400)}
OPEN_LAWN: Drawn = {**LAWN, "occlusion_width_px": 0}
CROSSING: Drawn = {
    "chain_path": "cross",
    "true_length_1_px": (57.0, 63.0),
    "true_length_2_px": (45.0, 51.0),
    "true_length_3_px": (39.0, 45.0),
    "start_angle_rad": (0.1, 0.25),
    "start_length_1_px": 5,
    "start_length_2_px": 6,
    "start_length_3_px": 9,
    "first_joint_low_deg": 0,
    "first_joint_high_deg": 135,
    "joint_difference_12_deg": 45,
    "length_1_low_px": 30,
    "length_1_high_px": 90,
    "length_2_low_px": 25,
    "length_2_high_px": 70,
    "length_3_low_px": 25,
    "length_3_high_px": 70,
    "length_difference_12_px": 40,
    "length_difference_23_px": 10,
}
STILL: Drawn = {
    "chain_path": "static",
    "start_angle_rad": (0.04, 0.08),
    "start_length_1_px": (3.0, 5.0),
    "start_length_2_px": (3.0, 5.0),
    "start_length_3_px": (7.0, 9.0),
    "start_angle_variance_rad2": 0.01,
    "start_length_variance_px2": 100,
    "start_rate_variance_rad2": 1e-4,
    "acceleration_rad": 0.01,
    "observation_variance_px2": 1,
}

CONDITIONS = (
    Condition("few particles", "sample-impoverishment", "ball", (*SAMPLED, "guided"), WIDE, {"sample_count": (4, 24)}),
    Condition(
        "few particles a feature",
        "sample-impoverishment",
        "prism",
        ("pf-asd", "alpha-1", "alpha-0"),
        {"speed": (2.0, 5.0)},
        {"sample_count": 2},
    ),
    Condition(
        "velocities without noise",
        "sample-impoverishment",
        "histogram",
        ("condensation", "apf", "h-spf"),
        OPEN_LAWN,
        {"velocity_noise_px": 0, "process_noise_px": (0.3, 0.7)},
        frames=80,
    ),
    Condition(
        "sharp weights",
        "overconfident-weights",
        "histogram",
        ("condensation", "pc-pf"),
        LAWN,
        {"sharpness": (150.0, 500.0)},
        frames=110,
    ),
    Condition(
        "look-alikes beside the path",
        "look-alike-capture",
        "ball",
        SAMPLED,
        SLOW,
        {"distracter_radius_px": (14.0, 24.0), "layout": (0, 19)},
    ),
    Condition("things of its colour", "look-alike-capture", "ball", SAMPLED, SLOW, {"clutter_count": (15, 50)}),
    Condition(
        "one that comes the other way",
        "look-alike-capture",
        "histogram",
        ("condensation", "apf", "h-spf"),
        {**OPEN_LAWN, "velocity_retention": 0, "look_alike_red": 0.0},
        {"look_alike_red": (0.6, 0.72)},
        frames=80,
    ),
    Condition(
        "faster than expected",
        "wrong-dynamics",
        "ball",
        (*SAMPLED, "guided"),
        {**CALM, "process_noise_px": 4},
        {"period_s": (0.25, 0.5)},
    ),
    Condition(
        "a law that stands still",
        "wrong-dynamics",
        "ball",
        SAMPLED,
        {**CALM, "process_noise_px": 4},
        {"velocity_retention": (0.0, 0.3), "process_noise_px": (1.0, 3.0)},
    ),
    Condition("too little noise", "wrong-dynamics", "ball", SAMPLED, WIDE, {"process_noise_px": (0.2, 1.0)}),
    Condition(
        "guided by other motion",
        "wrong-dynamics",
        "ball",
        ("guided",),
        {**CALM, "period_s": 3.0},
        {"ball_path": "bounces"},
    ),
    Condition(
        "velocity given up",
        "wrong-dynamics",
        "histogram",
        ("condensation", "apf", "h-spf"),
        {**OPEN_LAWN, "look_alike_red": 0.0},
        {"velocity_retention": (0.0, 0.4), "process_noise_px": (0.3, 0.6)},
        frames=80,
    ),
    Condition(
        "stiff features",
        "wrong-dynamics",
        "prism",
        ("alpha-0",),
        {"speed": (2.0, 5.0)},
        {"feature_noise_px": (0.1, 0.3)},
    ),
    Condition(
        "narrow diffusion",
        "wrong-dynamics",
        "fish",
        ("guided", "ordinary", "constant-velocity"),
        {"tank_number": (200, 240)},
        {"diffusion_scale": (0.05, 0.2)},
    ),
    Condition(
        "wide pillar",
        "occlusion-longer-than-memory",
        "ball",
        (*SAMPLED, "guided"),
        WIDE,
        {"occlusion_width_px": (80.0, 150.0)},
    ),
    Condition(
        "wide column",
        "occlusion-longer-than-memory",
        "histogram",
        ("condensation", "apf", "h-spf", "s-spf"),
        {**OPEN_LAWN, "look_alike_red": 0.0},
        {"occlusion_width_px": (60.0, 110.0), "velocity_retention": (0.7, 0.9)},
        frames=120,
    ),
    Condition("never resampled", "degenerate-resampling", "ball", BY_PREDICTION, SLOW, {"resampling_threshold": 0}),
    Condition(
        "never resampled",
        "degenerate-resampling",
        "histogram",
        BY_PREDICTION,
        OPEN_LAWN,
        {"resampling_threshold": 0},
        frames=80,
    ),
    Condition(
        "one side only",
        "mirror-pose",
        "linkage",
        ("ekf-truncated", "ekf", "ukf"),
        CROSSING,
        {},
        cured_by="ekf-mirrors",
        frames=None,
    ),
    Condition(
        "the same picture again",
        "shrinking-covariance",
        "linkage",
        ("ekf", "ukf"),
        STILL,
        {},
        cured_by="ellipsoids",
        frames=100,
    ),
    Condition(
        "no noise in the law",
        "shrinking-covariance",
        "ball",
        ("kalman",),
        SLOW,
        {"process_noise_px": (0.01, 0.2)},
    ),
    Condition(
        "renewed without a guard",
        "template-drift",
        "histogram",
        ("condensation", "apf", "h-spf"),
        LAWN,
        {"renewal_rate": (0.12, 0.4), "renewal_likeness": 0, "renewal_spread": 10},
        frames=110,
    ),
    Condition(
        "found too easily",
        "detector-seized-by-background",
        "histogram",
        ("condensation",),
        {**LAWN, "find_again": True, "look_alike_red": 0.9, "found_likeness": 0.92},
        {"found_likeness": (0.5, 0.7)},
        frames=114,
    ),
    Condition(
        "a background of its colour",
        "detector-seized-by-background",
        "ball",
        SAMPLED,
        SLOW,
        {"background_colour": ["#a03c3c", "#aa3838", "#9b4040", "#b43737"]},
    ),
    Condition(
        "beyond the edge",
        "target-not-in-the-picture",
        "ball",
        (*SAMPLED, "guided", "kalman"),
        SLOW,
        {"amplitude_px": (190.0, 260.0), "period_s": 4.0},
        at=15,
    ),
    *POSE_CONDITIONS,
)
"""All of them."""
