"""What is said of the error of a fish's pose, and how probable it is that the fish is lost.

`docs/explanation/calibration.md` has the bands. `python -m tools.loss_probability fit fish` fits the probability of a
loss and writes `loss_probability.json`.
"""

import math
from pathlib import Path

from pftrack.core.model.band import Calibration, DeviationBand, EstimateBand, Miscalibration
from pftrack.experiments.fish.trackers import TRACKERS
from pftrack.experiments.shared.loss_probability import Scenes, read_declaration

GOLDFISH = {"tank": ("goldfish",)}
RUDDER = {"tank": ("strong rudder",)}

FAULTS = (
    Miscalibration(("guided",), GOLDFISH, bands=("place", "heading"), direction="underconfident"),
    Miscalibration(("guided",), GOLDFISH, {"sample_count": (500, math.inf)}, ("bend",), direction="underconfident"),
    Miscalibration(("guided",), GOLDFISH, {"sample_count": (0, 200)}, ("bend",)),
    Miscalibration(("guided",), RUDDER),
    Miscalibration(("ordinary",)),
    Miscalibration(("constant-velocity",), GOLDFISH, bands=("place",), direction="underconfident"),
    Miscalibration(("constant-velocity",), bands=("heading", "bend")),
    Miscalibration(("constant-velocity",), RUDDER, bands=("place",)),
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
