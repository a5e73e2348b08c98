"""What classical trackers came to on the sequences of OTB, by its authors' own runs.

The table holds areas under the success curve, one pass, of the file `results/OPE/<tracker>/scores_cvpr13/ALL.json` of
the repository jwlim/tracker_benchmark at commit 5e1029c. CPF is the particle filter of Pérez et al. (2002), KMS and MS
are mean shift (Comaniciu, Ramesh, Meer 2003; Collins 2003), the others are no colour trackers.
"""

import csv
from collections.abc import Mapping
from functools import cache
from pathlib import Path

__all__ = ["PUBLISHED_SOURCE", "published"]

PUBLISHED_SOURCE = "Wu, Lim, Yang, Online object tracking: a benchmark, 2013; jwlim/tracker_benchmark, results/OPE"


def published(name: str) -> Mapping[str, float]:
    """Return the area under the success curve by tracker on a sequence; empty for one that the table does not have."""
    return _table().get(name.lower(), {})


@cache
def _table() -> Mapping[str, Mapping[str, float]]:
    with Path(__file__).with_name("published.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    return {row.pop("sequence").lower(): {name: float(text) for name, text in row.items()} for row in rows}
