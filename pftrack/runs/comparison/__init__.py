"""Comparisons: two to four runs beside each other on the frames that they have in common.

- `alignment`: which frame of the one belongs to which of the other;
- `settings`: what makes the runs different, and that alone;
- `paired`: from which frame on they are different, and how much better one of two did, with an interval;
- `comparison`: all of it in one value.

The runs may have different trackers, parameters, seeds and timelines, and belong to different experiments, as long as
their errors have one unit.
"""

from pftrack.runs.comparison.alignment import MOST_RUNS, Alignment, ComparisonError, align
from pftrack.runs.comparison.comparison import Comparison, Outcome
from pftrack.runs.comparison.paired import Divergence, Paired
from pftrack.runs.comparison.settings import Setting, settings

__all__ = [
    "MOST_RUNS",
    "Alignment",
    "Comparison",
    "ComparisonError",
    "Divergence",
    "Outcome",
    "Paired",
    "Setting",
    "align",
    "settings",
]
