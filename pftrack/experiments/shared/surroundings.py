"""What is said of a target beside its surroundings, before it is tracked, by whichever likelihood of places."""

import numpy as np

from pftrack.core.model.sequence import FrameSequence
from pftrack.core.model.suitability import WELL, Suitability
from pftrack.vision.likelihoods.separation import Separation

__all__ = ["BETTER_BY", "beside", "frames_of_a_second", "looked_at", "remark"]

LOOKS = 9
"""Pictures that are looked at, the first included, evenly over a second."""

BETTER_BY = 0.15
"""What would help is said if it helps at least this much."""

LEAST, MOST = 1.0, 1000.0
"""What is measured where nothing is likely, and where that is so of the target alone."""

MUCH = 0.1
"""Share of the rest of a picture that is worth a word if it looks like the target."""


def frames_of_a_second(sequence: FrameSequence, start: int) -> list[int]:
    """Return the numbers of the pictures that are looked at: that in which a target is marked, and later ones."""
    last = min(start + round(sequence.frame_rate_hz), sequence.frame_count - 1)
    return sorted({int(number) for number in np.linspace(start, last, LOOKS)} | {start})


def looked_at(sequence: FrameSequence, start: int) -> str:
    """Say which pictures were looked at, a clause."""
    later = frames_of_a_second(sequence, start)[1:]
    if not later:
        return f"looked at picture {start}"
    return f"looked at picture {start}, and around the same place in {len(later)} pictures up to {later[-1]}"


def beside(found: Separation) -> float:
    """Return how likely what is around a target is beside the target itself, as `model.suitability.BESIDE` has it."""
    return found.around / found.on if found.on > 0.0 else LEAST if found.around == 0.0 else MOST


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
