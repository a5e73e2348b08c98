"""What can be turned on the trackers of a body's shape."""

from pftrack.core.model.parameters import Parameters, parameter

__all__ = ["StructureTrackerParameters"]

METHOD, CAMERA, SCORING = "Method", "Assumed camera", "Scoring"
WINDOWED = ("online", "informed")


class StructureTrackerParameters(Parameters):
    """Everything that trackers of a shape read."""

    # fmt: off
    window_frames: int = parameter(
        90, "Window", "How many frames the online methods look at together; until there are as many, all of them.",
        unit="frames", ge=5, le=180, step=5, group=METHOD, trackers=WINDOWED, role="memory")
    kept_share: float = parameter(
        0.5, "Memory", "What the average of the online methods keeps of itself with each frame; 1 forgets nothing.",
        ge=0, le=1, step=0.05, group=METHOD, trackers=WINDOWED)
    first_frames: int = parameter(
        20, "First frames", "From how many frames at least the first shape is made where nothing is known of the body.",
        unit="frames", ge=3, le=90, step=1, group=METHOD, trackers=("growing",))
    kept_precision: float = parameter(
        1, "Memory of a point", "What is kept with each frame of what is known of a point that is well seen.",
        ge=0.8, le=1, step=0.005, group=METHOD, trackers=("growing",))
    frozen: bool = parameter(
        False, "Freeze", "Learn nothing more: the shape stays, and only the pose is followed.",
        group=METHOD, trackers=("growing",))
    trust_px: float = parameter(
        0, "Least noise", "No measurement is taken as more exact than this, in case the variances are too small.",
        unit="px", ge=0, le=50, step=0.5, group=METHOD)
    wrong_odds: float = parameter(
        0.02, "Silently wrong", "What share of the measurements is taken to be wrong without their variance saying so; "
        "at 0 all are believed, as Bando does.",
        ge=0, le=0.5, step=0.01, group=METHOD, trackers=("growing", *WINDOWED))
    lens_factor: float = parameter(
        1, "Focal length", "What the camera is assumed to have, as a multiple of what is known of it.",
        ge=0.1, le=10, step=0.05, group=CAMERA)
    wrong_share: float = parameter(
        0.6, "Frames that may be off", "A run is a success if its shape is off by over 5 % in no more than this share.",
        ge=0, le=1, step=0.01, group=SCORING, role="loss_share")
    # fmt: on
