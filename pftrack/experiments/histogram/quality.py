"""What is said of the error of a window's place, and how probable its loss is.

`docs/explanation/calibration.md` has the bands. `python -m tools.loss_probability fit histogram` fits the probability
of a loss and writes `loss_probability.json`.
"""

from pathlib import Path

from pftrack.core.model.band import Calibration, Miscalibration
from pftrack.experiments.histogram.trackers import TRACKERS
from pftrack.experiments.shared.loss_probability import Scenes, read_declaration

SAMPLERS = ("condensation", "apf", "h-spf", "s-spf", "pc-pf")

FAULTS = (
    Miscalibration(SAMPLERS, ranges={"sharpness": (0, 100)}, direction="underconfident"),
    Miscalibration(SAMPLERS, ranges={"sharpness": (150, 1000)}),
    Miscalibration(("greedy",)),
)

CALIBRATION = Calibration(faults=FAULTS, presets=("pictures", "look-alike"), scene="scene_number")

SCENES = Scenes(
    {
        "scene_number": (0, 9999),
        "look_alike_red": (0.0, 1.0),
        "occlusion_width_px": (0.0, 90.0),
        "lighting_amplitude": (0.0, 0.4),
    },
    {
        "sample_count": (50, 100, 300, 600),
        "sharpness": (5.0, 10.0, 20.0, 50.0, 100.0),
        "column_colours": ("lawn", "grey"),
        "image_noise_sd": (0.0, 0.0, 4.0),
        "process_noise_px": (1.5, 1.5, 3.0),
    },
    fitted=100,
    judged=60,
)
"""Lawns of all kinds, look-alikes of all shades, columns of all widths, and likelihoods from blunt to sharp."""

LOSS_DECLARATION = read_declaration(Path(__file__).with_name("loss_probability.json"), TRACKERS, SCENES)
