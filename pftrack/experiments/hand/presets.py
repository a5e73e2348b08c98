"""Where to begin: the three motions, the same seed with one hand kept and with four, and what makes it hard."""

from pftrack.experiments.experiment import Preset

__all__ = ["PRESETS"]

SCENE = ("motion",)

PRESETS = (
    Preset(
        "occlusion",
        "works: two fingers fold",
        "beam",
        {"motion": "occlusion"},
        about=("beam_width", "shown_hypothesis", "edge_noise_px", "ranking"),
        watch=(
            "Watch frames 4 to 6: the middle and the ring finger fold within two frames, so that two of five "
            "protrusions vanish, and in space the fingers bend where the picture shows none."
        ),
        scene=SCENE,
    ),
    Preset(
        "wrist",
        "works: a turn at the wrist, four hands kept",
        "beam",
        {"motion": "wrist"},
        seed=151,
        about=("beam_width", "shown_hypothesis", "edge_noise_px"),
        watch=(
            "Watch frames 12 to 16 in the plots of the tilt and of the kept hands: at first a turn either way fits as "
            "well, the best hand is wrong for three frames, and one of the others takes over."
        ),
        scene=SCENE,
    ),
    Preset(
        "one",
        "breaks: the same turn, one hand kept",
        "beam",
        {"motion": "wrist", "beam_width": 1},
        seed=151,
        about=("edge_noise_px",),
        watch=(
            "Watch the hand in space from frame 10 on: it turns the wrong way, and there is no other one to come back "
            "to. In the picture it hardly shows; from frame 21 on the hand is lost."
        ),
        scene=SCENE,
    ),
    Preset(
        "bend",
        "works: the fingers close",
        "beam",
        {"motion": "bend"},
        about=("beam_width", "shown_hypothesis", "edge_noise_px"),
        watch=(
            "Watch the number of protrusions fall from five to one or two from frame 19 on, as the fingers close over "
            "the palm; the hand is right in all frames but one."
        ),
        scene=SCENE,
    ),
    Preset(
        "particles",
        "worse: particles with the same likelihood",
        "particles",
        {"motion": "occlusion"},
        about=("sample_count", "edge_noise_px"),
        watch=(
            "Watch the error in space: a hundred particles are more than one and a half times as far off as the beam, "
            "since few of them are near the best hand."
        ),
        scene=SCENE,
    ),
)
