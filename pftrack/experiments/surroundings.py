"""What is said of a target beside its surroundings, before it is tracked, by whichever likelihood of places."""

import numpy as np

from pftrack.likelihoods.separation import Separation
from pftrack.model.sequence import FrameSequence
from pftrack.model.suitability import WELL, Suitability

__all__ = ["BETTER_BY", "frames_of_a_second", "remark"]

LOOKS = 9
"""Pictures that are looked at, the first included, evenly over a second."""

BETTER_BY = 0.15
"""What would help is said if it helps at least this much."""

MUCH = 0.1
"""Share of the rest of a picture that is worth a word if it looks like the target."""


def frames_of_a_second(sequence: FrameSequence, start: int) -> list[int]:
    """Return the numbers of the pictures that are looked at: that in which a target is marked, and later ones."""
    last = min(start + round(sequence.frame_rate_hz), sequence.frame_count - 1)
    return sorted({int(number) for number in np.linspace(start, last, LOOKS)} | {start})


def remark(value: float, found: Separation) -> str:
    """Say what was found: how likely the surroundings are, and whether the rest of the picture looks alike."""
    share = f"{100 * found.around / found.on:.0f} %" if found.on > 0.0 else "100 %"
    if value >= WELL:
        said = f"separates well: what is around the target is {share} as likely as the target itself"
    elif value > 0.0:
        grade = Suitability(value, "").grade
        said = f"separates {grade}: what is around the target is {share} as likely as the target itself"
        said += ", expect losses" if grade == "poorly" else ", so that nothing holds the tracker to it"
    else:
        said = "separates not at all: what is around the target is as likely as the target itself, or more"
    if found.alike >= MUCH:
        said += f"; {100 * found.alike:.0f} % of the rest of the picture looks like it"
    return said
