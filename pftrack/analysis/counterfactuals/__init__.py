"""Counterfactuals: what would have saved a run that lost its target, found by experiment.

A run can be repeated from any of its frames, to the same numbers. So one goes back to shortly before the loss
(`pftrack.runs.scoring`), changes one thing, and lets the run go on with many other seeds: does it then hold? The
changes (`alternatives`) are found by what parameters declare of themselves, their roles, so that they exist for every
tracker. First of all nothing is changed: of the same settings with other seeds many may hold, and then it was bad luck.
`report` runs the trials and judges them.

Each share comes with Wilson's interval. A change is compared with no change on the same seeds (McNemar's test), and
since many are tried the p-values are corrected for that (Holm). What cures this run need not cure others: that is a
question for a sweep.
"""

from pftrack.analysis.counterfactuals.alternatives import Alternative, alternatives
from pftrack.analysis.counterfactuals.report import (
    Finding,
    LossError,
    Report,
    find_loss,
    join,
    read_record,
    record,
    what_if,
)

__all__ = [
    "Alternative",
    "Finding",
    "LossError",
    "Report",
    "alternatives",
    "find_loss",
    "join",
    "read_record",
    "record",
    "what_if",
]
