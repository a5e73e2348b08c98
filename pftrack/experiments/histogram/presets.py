"""Starting points on the lawn; what each says to watch holds for its own seed."""

from pftrack.core.model.preset import Cure, Failure, Preset
from pftrack.experiments.histogram.recording import LECTURE, PICTURES

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

# Seven ways to lose the window on the lawn, each with its cure.

BEFORE_COLUMN = 80
"""So many frames are over before the target goes behind the column."""

FAILURES = (
    Failure(
        "sample-impoverishment",
        "Sample impoverishment",
        "weights",
        "Nothing is ever added to a velocity, so each resampling can only lose some of the 300 that there were at the "
        "start. Two are left in frame 30 and one in frame 44, and when the target turns, nobody goes "
        "its way.",
        "condensation",
        44,
        "sample-impoverishment",
        Cure(
            "Noise on the velocity, 0.3 px/frame: each copy gets a velocity of its own, so that all stay different.",
            {"velocity_noise_px": 0.3},
        ),
        {"velocity_noise_px": 0, "process_noise_px": 0.5},
        frames=BEFORE_COLUMN,
    ),
    Failure(
        "overconfident-weights",
        "Overconfident weights",
        "weights",
        "At lambda 200 a difference of 0.01 in likeness makes a weight seven times as large, also where nothing of the "
        "target is seen. Behind the column the cloud settles on the patches of lawn that happen to be more alike, sure "
        "of itself, and never comes out.",
        "condensation",
        91,
        "overconfident-weights",
        Cure(
            "Lambda 20: the same difference makes a weight larger by a fifth, and the cloud widens until it meets the "
            "target again.",
            {"sharpness": 20},
        ),
        {"sharpness": 200},
    ),
    Failure(
        "look-alike-capture",
        "Look-alike capture",
        "dynamics",
        "Without a velocity the cloud lags behind the target. When a look-alike comes the other way through it, both "
        "fit as well, and the cloud goes away with the wrong one.",
        "condensation",
        48,
        "look-alike-capture",
        Cure(
            "A velocity that is kept: the look-alike is as alike as before, but it moves the other way, and particles "
            "that move so have died out.",
            {"velocity_retention": 1},
        ),
        {"velocity_retention": 0},
        frames=BEFORE_COLUMN,
    ),
    Failure(
        "occlusion-longer-than-memory",
        "Occlusion longer than memory",
        "dynamics",
        "A fifth of the velocity is lost in each frame without news, a memory of five frames, and the column hides the "
        "target for ten. The cloud stops behind the column while the target goes on.",
        "condensation",
        83,
        "occlusion-longer-than-memory",
        Cure("The whole velocity is kept: a memory longer than the occlusion.", {"velocity_retention": 1}),
        {"velocity_retention": 0.8, "look_alike_red": 0},
        seed=1,
    ),
    Failure(
        "degenerate-resampling",
        "Degenerate resampling",
        "collapse",
        "The threshold is 0, so that parents are never drawn again: weights are only multiplied, and after twenty "
        "frames one particle carries all of them. The others are computed for nothing, and one guess is no filter.",
        "condensation",
        29,
        "degenerate-resampling",
        Cure(
            "Resample when fewer than half of the particles carry the weight: the bad ones make room for copies of the "
            "good ones.",
            {"resampling_threshold": 0.5},
        ),
        {"resampling_threshold": 0},
        frames=60,
    ),
    Failure(
        "template-drift",
        "Template drift",
        "appearance",
        "A fifth of the model is renewed in every frame by whatever the window shows. As the target goes behind the "
        "column the model learns lawn, little by little; from then on lawn is what it is looking for, and it fits.",
        "condensation",
        90,
        "template-drift",
        Cure(
            "A guard: a frame renews only if the window is alike by 0.95 and the particles agree within half of it, so "
            "that nothing is learned from a target that is half hidden.",
            {"renewal_likeness": 0.95, "renewal_spread": 0.5},
        ),
        {"renewal_rate": 0.2, "renewal_likeness": 0, "renewal_spread": 10},
        seed=6,
    ),
    Failure(
        "detector-seized-by-background",
        "Detector seized by background",
        "appearance",
        "A search through the whole picture always has a best place. While the target is hidden that is a redder thing "
        "in the background, and a threshold of 0.6 takes it for the target.",
        "condensation",
        92,
        "detector-seized-by-background",
        Cure(
            "A threshold of 0.92, which the background does not reach: the search goes on until the target comes out.",
            {"found_likeness": 0.92},
        ),
        {"find_again": True, "found_likeness": 0.6, "look_alike_red": 0.9},
        frames=110,
    ),
)
