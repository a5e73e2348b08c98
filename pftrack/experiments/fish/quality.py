"""What is said of the error of a fish's pose, and how probable it is that the fish is lost.

`docs/explanation/calibration.md` has the bands. `python -m tools.loss_probability fit fish` fits the probability of a
loss and writes `loss_probability.json`.
"""

import math
from pathlib import Path

from pftrack.core.model.band import Calibration, DeviationBand, EstimateBand, Miscalibration
from pftrack.experiments.fish.step import TRACKERS
from pftrack.experiments.shared.loss_probability import Scenes, read_declaration

BLUNT = (
    "A pose is weighed by the one point of its outline that is farthest from an edge: many poses are alike by that, "
    "which widens the band. The one of 50 % holds the {} in {} of the reports."
)
GOLDFISH = {"tank": ("goldfish",)}
RUDDER = {"tank": ("strong rudder",)}

FAULTS = (
    Miscalibration(
        ("guided",),
        BLUNT.format("place in 80 to 89 % and the heading", "61 to 68 %"),
        GOLDFISH,
        bands=("place", "heading"),
        direction="underconfident",
    ),
    Miscalibration(
        ("guided",),
        BLUNT.format("bend", "61 %"),
        GOLDFISH,
        {"sample_count": (500, math.inf)},
        ("bend",),
        direction="underconfident",
    ),
    Miscalibration(
        ("guided",),
        "A fish that turns in one beat of its tail leaves 200 particles behind: the band of 95 % holds the bend in 83 "
        "% of the reports.",
        GOLDFISH,
        {"sample_count": (0, 200)},
        ("bend",),
    ),
    Miscalibration(
        ("guided",),
        "What it has learned is how goldfish move. In water with a strong rudder it expects another motion and loses "
        "fish that turn: bands of 95 % hold the truth in 59 to 74 % of the reports.",
        RUDDER,
    ),
    Miscalibration(
        ("ordinary",),
        "Each number of the pose takes random steps of its own, so that few particles come to where a fish turns to; "
        "it loses some fish and is sure of a wrong pose. Bands of 95 % hold the truth in 32 to 81 % of the reports.",
    ),
    Miscalibration(
        ("constant-velocity",),
        BLUNT.format("place", "84 to 90 %"),
        GOLDFISH,
        bands=("place",),
        direction="underconfident",
    ),
    Miscalibration(
        ("constant-velocity",),
        "Turns and bends are random steps, which few particles make when a fish turns fast: bands of 95 % hold heading "
        "and bend in 78 to 91 % of the reports.",
        bands=("heading", "bend"),
    ),
    Miscalibration(
        ("constant-velocity",),
        "In water with a strong rudder fish turn faster than it expects, and some are lost: the band of 95 % holds the "
        "place in 87 % of the reports.",
        RUDDER,
        bands=("place",),
    ),
)

CALIBRATION = Calibration(
    bands=(
        EstimateBand("place"),
        DeviationBand("heading", ("heading",), ("heading_sd",), ("true_heading",)),
        DeviationBand("bend", ("bend",), ("bend_sd",), ("true_bend",)),
    ),
    faults=FAULTS,
    presets=("ordinary", "rudder"),
    scene="tank_number",
)

SCENES = Scenes(
    {
        "tank_number": (0, 9999),
        "occlusion_width_px": (0.0, 120.0),
        "occlusion_offset_px": (-150.0, 150.0),
        "image_noise": (0, 30),
        "half_length_px": (34.0, 46.0),
    },
    {
        "sample_count": (10, 20, 50, 100, 200),
        "tank": ("goldfish", "goldfish", "strong rudder"),
        "diffusion_scale": (0.5, 1.0, 1.0, 2.0),
        "sigma_d_px2": (10.0, 25.0, 60.0),
    },
    frames=60,
    fitted=80,
    judged=50,
)
"""All tanks, columns of all widths, fish of a size that is known well or badly, few particles and more."""

SIGNALS = ("d_max",)
"""How far the worst point of the outline is from an edge."""

LOSS_DECLARATION = read_declaration(Path(__file__).with_name("loss_probability.json"), TRACKERS, SCENES, SIGNALS)
