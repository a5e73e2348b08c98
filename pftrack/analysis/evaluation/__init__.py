"""Trackers on the sequences of public benchmarks, which a user brings, by the benchmark's own protocol.

- `sequences`: folders of pictures with a true box for every picture, in the forms of OTB and VOT;
- `protocol`: one pass through a sequence (OPE), and the figures that come of it;
- `published`: what classical trackers came to on the same sequences.

The pictures of these benchmarks have no licence, so none comes along.
"""

from pftrack.analysis.evaluation.protocol import PRECISION, SUCCESS, Score, evaluate_sequence, follows_boxes
from pftrack.analysis.evaluation.published import PUBLISHED_SOURCE, published
from pftrack.analysis.evaluation.sequences import BenchmarkError, BenchmarkSequence, find_sequences

__all__ = [
    "PRECISION",
    "PUBLISHED_SOURCE",
    "SUCCESS",
    "BenchmarkError",
    "BenchmarkSequence",
    "Score",
    "evaluate_sequence",
    "find_sequences",
    "follows_boxes",
    "published",
]
