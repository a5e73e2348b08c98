"""What can be turned on how corners are found, and found again."""

from pftrack.core.model.parameters import parameter
from pftrack.vision.detection.corners import DetectorParameters
from pftrack.vision.detection.matching import LARGEST_TEMPLATE_PX, Cost

__all__ = ["CornerParameters"]

MATCHING = "Matching"


class CornerParameters(DetectorParameters):
    """Everything that following corners through pictures reads."""

    # fmt: off
    template_px: int = parameter(
        11, "Template", "Side of the square about a corner that is looked for in later pictures.",
        unit="px", ge=3, le=LARGEST_TEMPLATE_PX, step=2, live=False, group=MATCHING)
    search_reach_px: int = parameter(
        13, "Search to", "How far from its last match a corner is looked for, to all four sides.",
        unit="px", ge=1, le=40, step=1, group=MATCHING)
    match_cost: Cost = parameter(
        "difference", "Compare by",
        "The mean difference of grey levels, which light misleads, or normalised correlation, which it does not.",
        group=MATCHING)
    template_renewal: bool = parameter(
        False, "Renew templates", "Whether a template is cut anew at every match: it adapts, and drifts away.",
        group=MATCHING)
    between_pixels: bool = parameter(
        False, "Between pixels", "Whether a match is placed between pixels by the costs of its neighbours.",
        group=MATCHING)
    largest_cost: float = parameter(
        255, "Largest cost", "A costlier match is none: in grey levels, in hundredths by correlation; 255 takes all.",
        ge=0, le=255, step=1, group=MATCHING)
    largest_ratio: float = parameter(
        1, "Largest ratio", "A match that costs more of the next best one elsewhere is ambiguous, and is none.",
        ge=0, le=1, step=0.01, group=MATCHING)
    new_corners: bool = parameter(
        False, "New corners", "Whether a corner that has been gone for ten frames is replaced by another.",
        group=MATCHING)
    # fmt: on
