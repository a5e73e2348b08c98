"""What can be turned beside what trackers and scene declare: what counts as lost, and what is drawn."""

from pftrack.core.model.parameters import parameter
from pftrack.experiments.linkage.scene.parameters import LinkageSceneParameters
from pftrack.experiments.linkage.trackers.parameters import LinkageTrackerParameters
from pftrack.experiments.shared.parameters import loss_share

__all__ = ["LinkageParameters", "SimulatedLinkageParameters"]

SCORING, DRAWING = "Scoring", "Drawing"


class LinkageParameters(LinkageTrackerParameters):
    """The trackers, what counts as lost, and what is drawn."""

    # fmt: off
    lost_deg: float = parameter(
        11.5, "Limit of success",
        "The chain counts as lost when the direction of a link is further off than this, or when regions exclude it.",
        unit="°", ge=0.5, le=180, step=0.5, group=SCORING)
    lost_share: float = loss_share(0.1, group=SCORING)
    shown_hypothesis: int = parameter(
        1, "Shown hypothesis", "Which of a frame's hypotheses is drawn in the picture beside the estimate.",
        ge=1, le=100, step=1, group=DRAWING, role="drawing")
    # fmt: on


class SimulatedLinkageParameters(LinkageParameters, LinkageSceneParameters):
    """The simulated chain and its trackers."""
