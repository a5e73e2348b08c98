"""What there is to say of a silhouette, as events of a run and as words under the picture."""

from collections.abc import Mapping

from pftrack.core.model.series import Series, SeriesValue
from pftrack.experiments.hand.detection.silhouette import Finding
from pftrack.experiments.hand.trackers.state import HandState

__all__ = ["SERIES", "describe", "flags"]

NO_FINGER = "no finger is seen beside the palm: a fist, or fingers before it"

EVENTS = {
    Finding.EMPTY.value: "no_hand",
    Finding.AS_BACKDROP.value: "no_hand",
    Finding.FULL.value: "flash",
    Finding.SEVERAL.value: "two_hands",
    Finding.CUT.value: "cut",
}
"""By what is said of a silhouette; whatever else is said means that no hand fits."""

SERIES = (
    Series("no_hand", "no hand", role="event", colours=("hidden",)),
    Series("flash", "flash of light", role="event", colours=("prediction",)),
    Series("two_hands", "two things", role="event", colours=("lost",)),
    Series("cut", "beyond the picture", role="event", colours=("second",)),
    Series("no_fit", "no hand fits", role="event", colours=("lost",)),
    Series("no_finger", "no finger beside the palm", role="event", colours=("observation",)),
)


def flags(state: HandState) -> Mapping[str, SeriesValue]:
    """Return which of these is so in a frame."""
    happened = EVENTS.get(state.finding, "no_fit") if state.finding else "no_finger" if not state.protrusions else ""
    return {series.name: float(series.name == happened) for series in SERIES}


def describe(state: HandState) -> str:
    """Return what there is to say of a frame in words; nothing if a hand is seen, and a finger of it."""
    return state.finding or ("" if state.protrusions else NO_FINGER)
