"""Sweeps: an experiment over a grid of conditions and trials, with one row per run.

A *plan* names an experiment, *axes* (declared parameters and their values), trackers, the number of trials and a seed.
It is cut into *chunks* of about a second, and a pool of processes or a cluster computes them in an order that fills
every map evenly. A *journal* keeps each finished chunk on disk, so that an interrupted sweep resumes where it stopped.
The *result* is one Parquet file; a map shows its *cells*, and each row opens as a live run with the same numbers.

All runs may use one *recording*. The plan holds its hash, target and truth, and workers get its content. Without a
truth the tracker's own reports are measured.

A *quantity* compares methods: success, the error, or a measure that the experiment declares.

In order of use: `parse_axis`, `Plan`, `begin` or `carry_out`, `resume`, `read_result`, `cells`, `compare`;
`pftrack.sweep.cells` has the quantities, `pftrack.sweep.journal` the files.
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
