"""Rules of diagnosis: one for each way in which a cause shows, from the columns of a course.

A rule measures one mechanism around a moment and returns a `Sign` if it is at work: since when, how strongly, and the
numbers that this is said from. Several may be: whoever asks orders them by when they began. What follows from another
sign begins later, so no rule needs to know the others.
"""

from pftrack.analysis.diagnosis.looks import another_that_fits, changed_model, widened_cloud, wrong_find
from pftrack.analysis.diagnosis.motion import (
    beyond_the_picture,
    left_behind,
    out_of_sight,
    out_of_the_cloud,
    suddenly_gone,
)
from pftrack.analysis.diagnosis.sign import Rule
from pftrack.analysis.diagnosis.sureness import (
    mirror_image,
    near_its_mirror_image,
    refuted,
    same_again,
    still_picture,
    too_sure,
)
from pftrack.analysis.diagnosis.weights import alike_particles, everything_fits, few_weights, sure_of_nothing

__all__ = ["RULES"]

RULES: tuple[Rule, ...] = (
    beyond_the_picture,
    few_weights,
    alike_particles,
    same_again,
    still_picture,
    mirror_image,
    near_its_mirror_image,
    changed_model,
    wrong_find,
    everything_fits,
    too_sure,
    refuted,
    sure_of_nothing,
    out_of_sight,
    suddenly_gone,
    another_that_fits,
    widened_cloud,
    left_behind,
    out_of_the_cloud,
)
"""All of them; of two signs since the same frame the one whose rule comes first is told first."""
