"""Starting points on the lawn; what each says to watch holds for its own seed."""

from pathlib import Path

from pftrack.core.model.preset import Cure, Failure, read_presets

ABOUT = ("sharpness", "parts_down", "weigh_background", "surround_contrast", "follow_size")
"""Of the lecture's settings and those of recordings, what is worth turning."""

PRESETS = read_presets(Path(__file__).with_name("presets.yaml"))

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
