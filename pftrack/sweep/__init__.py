"""Sweeps: an experiment over a grid of conditions and trials, one row a run.

A *plan* says what is computed: an experiment, *axes* (declared parameters and the values they take), trackers, trials,
a seed. It is cut into *chunks* of about a second, which a pool of processes or a cluster computes in an order that
fills every map evenly. A *journal* keeps each finished chunk on disk, so that a sweep goes on where it was when it was
stopped, by whatever. The *result* is one Parquet file; its *cells* are what a map shows, and each row opens as a live
run with the same numbers.

All runs may be on one *recording*, and the plan knows its hash, target and truth; workers get its content. Where its
truth is not known, runs are measured by what the tracker says of itself.

What methods are compared by is a *quantity*: success, the error, or a measure that the experiment declares.

In order of use: `parse_axis`, `Plan`, `begin` or `carry_out`, `resume`, `read_result`, `cells`, `compare`;
`pftrack.sweep.cells` has what is compared, `pftrack.sweep.journal` the files.
"""

from pftrack.sources.sequence import Recording
from pftrack.sweep.axis import MOST_RUNS, Axis, SweepError, SweepStopped, parse_axis
from pftrack.sweep.cells import Comparison, cells, compare, summary
from pftrack.sweep.driver import carry_out, estimate
from pftrack.sweep.journal import Result, begin, partial_of, read_chunk, read_result, resume, rows_of
from pftrack.sweep.plan import Plan

__all__ = [
    "MOST_RUNS",
    "Axis",
    "Comparison",
    "Plan",
    "Recording",
    "Result",
    "SweepError",
    "SweepStopped",
    "begin",
    "carry_out",
    "cells",
    "compare",
    "estimate",
    "parse_axis",
    "partial_of",
    "read_chunk",
    "read_result",
    "resume",
    "rows_of",
    "summary",
]
