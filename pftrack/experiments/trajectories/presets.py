"""Starting points that show something of trajectories."""

from pftrack.experiments.experiment import Preset

__all__ = ["PRESETS"]

MODEL = "noise_variance_px2", "drive_variance_px2", "lag_frames"

TRACKS = {"trajectories_scene": "tracks"}
"""The simulated tracks, in place of the pictures."""

MATCHING = "match_cost", "search_reach_px", "largest_ratio"

PRESETS = (
    Preset(
        "lattice",
        "works: a wall of look-alikes",
        "nlng",
        {"selected_track": 1},
        about=("noise_variance_px2", "lag_frames", "gain_jump", "match_cost"),
        watch=(
            "Watch frames 11, 27, 41 and 45: the light jumps, and most crossings of the wall are found one cell off, "
            "by 11 to 16 px. The smoothed paths go straight on, and the ringed track is never off by more than 1.3 px."
        ),
    ),
    Preset(
        "look-alike",
        "breaks: drawn to look-alikes",
        "lg",
        {"selected_track": 1},
        about=("noise_variance_px2", "lag_frames", "gain_jump", "match_cost"),
        watch=(
            "Watch the ringed track at frames 11 and 27: its match is 16 px off, the estimate follows by 10, and half "
            "of that is left a frame later."
        ),
    ),
    Preset(
        "lost-cell",
        "breaks: lost on the lattice",
        "nlng",
        {"selected_track": 17},
        about=(*MATCHING, "gain_jump_share"),
        watch=(
            "Watch the ringed track from frame 42 on: the light jumps again and again, the match gets two cells away, "
            "further than the search reaches back, and the estimate goes with it."
        ),
    ),
    Preset(
        "light",
        "works: by correlation",
        "nlng",
        {"match_cost": "correlation", "selected_track": 17},
        about=("gain_jump", "gain_jump_share", "search_reach_px"),
        watch=(
            "Watch frames 27, 41 and 45: normalised correlation does not mind the light, and where differences lose "
            "more than half of all corners it loses an eighth."
        ),
    ),
    Preset(
        "slanted",
        "breaks: a slanted line",
        "nlng",
        {"selected_track": 59},
        about=("false_corners", "largest_ratio", "search_reach_px"),
        watch=(
            "Watch the surface of the search: along the book's line it is a ridge, so that the match slides, from "
            "frame 7 on by more than 10 px, as if that were a motion."
        ),
    ),
    Preset(
        "works",
        "works: finds the noise",
        "nlng",
        TRACKS,
        about=(*MODEL, "outlier_scale_px2"),
        watch=(
            "Watch the interval of σ: it reaches from 0.7 to 3.1 px at frame 0, and has shrunk to one value by "
            "frame 45. At frames 15, 45 and 75 measurements jump, and the smoothed paths go straight on."
        ),
    ),
    Preset(
        "known",
        "works: Cauchy noise",
        "lng",
        TRACKS,
        about=(*MODEL, "outlier_every"),
        watch=(
            "Watch the ringed track at frame 45: its measurement is 38 px off, and the estimate stays within 1 px "
            "of the truth."
        ),
    ),
    Preset(
        "dragged",
        "breaks: dragged along",
        "lg",
        TRACKS,
        about=(*MODEL, "outlier_scale_px2"),
        watch=(
            "Watch the ringed track at frame 45: its measurement is 38 px off, the estimate follows it by 26, and "
            "needs three frames to come back."
        ),
    ),
    Preset(
        "trusting",
        "breaks: σ too small",
        "lg",
        {**TRACKS, "noise_variance_px2": 0.1},
        about=("drive_variance_px2", "lag_frames"),
        watch=(
            "Watch frame 45: who trusts every measurement to a third of a px is 35 px off with it. Smoothing "
            "takes off little of that."
        ),
    ),
    Preset(
        "stiff",
        "breaks: too smooth",
        "lng",
        {**TRACKS, "noise_variance_px2": 0.25, "drive_variance_px2": 0.01},
        about=("lag_frames", "sample_count"),
        watch=(
            "Watch frames 50 to 55, where all tracks move aside: a motion that may hardly bend takes that for "
            "outliers, and is 26 px off."
        ),
    ),
    Preset(
        "drifting",
        "worse: σ and τ drift",
        "nlng",
        {**TRACKS, "law_drift": 0.2},
        about=("noise_variance_px2", "drive_variance_px2"),
        watch=(
            "Watch the interval of τ: after 45 straight frames it is down to 0.05 to 0.25 px, and when the tracks "
            "move aside at frame 50 the estimate is left 29 px behind."
        ),
    ),
    Preset(
        "few",
        "worse: few particles",
        "lng",
        {**TRACKS, "sample_count": 100},
        about=("point_estimate", "lag_frames"),
        watch=(
            "Watch frame 15: of 100 particles hardly two share a bin of the histogram, and the fullest bin "
            "happens to be at the outlier, 11 px off."
        ),
    ),
    Preset(
        "long",
        "breaks: a long mismatch",
        "lng",
        {**TRACKS, "outlier_frames": 12, "outlier_every": 30, "outlier_scale_px2": 400, "reference_track": False},
        watch=(
            "Watch the ringed track from frame 30 to 41, when it is measured 33 px aside: the estimate holds out "
            "for two frames and then follows. A mismatch that lasts is a consistent track, and no law of the "
            "noise removes it."
        ),
    ),
)
