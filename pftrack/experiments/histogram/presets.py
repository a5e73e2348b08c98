"""Starting points on the lawn; what each says to watch holds for its own seed."""

from pftrack.experiments.experiment import Preset
from pftrack.experiments.histogram.settings import LECTURE, PICTURES

__all__ = ["PRESETS"]

ABOUT = ("sharpness", "parts_down", "weigh_background", "surround_contrast", "follow_size")
"""Of the lecture's settings and those of recordings, what is worth turning."""

PRESETS = (
    Preset(
        "works",
        "works",
        "condensation",
        about=("sample_count", "sharpness", "velocity_retention", "look_alike_red", "occlusion_width_px"),
        watch=(
            "Watch frames 87 to 96: nothing of the target is seen, and the cloud drifts on behind the column, wider "
            "and wider, until it meets the target on the other side."
        ),
    ),
    Preset(
        "lecture",
        "works: the lecture's settings",
        "condensation",
        LECTURE,
        about=ABOUT,
        scene=tuple(name for name in LECTURE if name not in ABOUT),
        watch=(
            "Watch the same as before: the lawn has these values by itself. A recording begins with others, and with "
            "this preset it is followed as the lecture would."
        ),
    ),
    Preset(
        "pictures",
        "works: the settings of recordings",
        "condensation",
        PICTURES,
        about=ABOUT,
        scene=tuple(name for name in PICTURES if name not in ABOUT),
        watch=(
            "Watch the box: it has a size of its own and is counted in two by three parts, and colours that the lawn "
            "has as well count less."
        ),
    ),
    Preset(
        "look-alike",
        "works: passes a twin",
        "condensation",
        {"look_alike_red": 0.5},
        about=("velocity_retention", "sharpness"),
        watch=(
            "Watch frames 40 to 56: the look-alike has the very same colours, and the likeness never drops, but the "
            "cloud has a velocity and stays with the target."
        ),
    ),
    Preset(
        "velocity-off",
        "breaks: velocity off",
        "condensation",
        {"velocity_retention": 0},
        about=("process_noise_px", "look_alike_red"),
        watch=(
            "Watch frames 46 to 58: the cloud lags behind the target, and when the look-alike comes by it turns round "
            "and goes away with it."
        ),
    ),
    Preset(
        "lambda-200",
        "breaks: lambda 200",
        "condensation",
        {"sharpness": 200},
        about=("sample_count", "velocity_noise_px"),
        watch=(
            "Watch frames 90 to 110: behind the column the cloud stops at patches that look a little more like the "
            "target than others, and never comes out."
        ),
    ),
    Preset(
        "lambda-2",
        "worse: lambda 2",
        "condensation",
        {"sharpness": 2},
        about=("sample_count", "velocity_noise_px"),
        watch=(
            "Watch sigma and the particles from the start: they are scattered twice as far as in the first preset, and "
            "the estimate wanders about the target without being lost for good."
        ),
    ),
    Preset(
        "grey-column",
        "breaks: grey column",
        "condensation",
        {"column_colours": "grey"},
        about=("sharpness", "sample_count", "occlusion_width_px"),
        watch=(
            "Watch frames 78 to 94: lawn looks a little like the window, grey not at all, so the cloud shies away from "
            "the column and is left on the lawn before it."
        ),
    ),
    Preset(
        "hard-lawn",
        "breaks: a hard lawn, few particles",
        "condensation",
        {"scene_number": 17, "sample_count": 50},
        about=("sharpness", "velocity_retention"),
        watch=(
            "Watch frames 84 to 100: on this lawn, the fifth of the reproduced table, what is left of the cloud turns "
            "back at the column; with 300 particles most runs come through."
        ),
    ),
    Preset(
        "finds-again",
        "works: h-SPF finds again",
        "h-spf",
        {"velocity_retention": 0, "process_noise_px": 3, "gamma_px": 5},
        about=("large_process_noise_px", "apf_weights"),
        watch=(
            "Watch frames 86 to 110: without a velocity the cloud stays behind, all of it is drawn by observation, and "
            "from frame 104 on the few particles that reach the target draw all others to it."
        ),
    ),
    Preset(
        "searches",
        "works: lost, searched and found",
        "condensation",
        {"column_colours": "grey", "find_again": True, "found_likeness": 0.92, "look_alike_red": 0.9},
        about=("lost_likeness",),
        watch=(
            "Watch frames 93 to 104: the target is given up for lost and looked for all over the picture, mostly on "
            "the redder look-alike, until it comes out from behind the column."
        ),
    ),
)
