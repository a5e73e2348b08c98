"""Properties: what a file should do, each a function that looks and returns a verdict.

Those of single functions call these with arrays made for it; those of a filter compare runs with an exact answer, with
another tracker, or with the truth. `weights` has those of weights, of resampling and of a whole tracker, `exact` those
with an exact answer and those of how functions go about it; `PROPERTIES` has all by name. Their titles, options and
margins stand in `properties.yaml`.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from pftrack.core.texts import CLOSED, read_as
from pftrack.teaching.exercises.properties import exact, weights
from pftrack.teaching.exercises.properties.weights import Look, Option

__all__ = ["PROPERTIES", "Option", "Property"]

LOOKS: Mapping[str, Look] = {
    "keeps-count": weights.keeps_count,
    "unbiased": weights.unbiased,
    "even": weights.even,
    "threshold": weights.threshold,
    "distribution": weights.distribution,
    "evidence": exact.evidence,
    "moments": exact.moments,
    "steadier": exact.steadier,
    "held": weights.held,
    "linear": exact.linear,
    "unchanged": exact.unchanged,
    "replays": exact.replays,
}


@dataclass(frozen=True)
class Property:
    """Something that should hold of a file.

    Attributes:
        name: In the heads of exercises.
        origin: File and line where it is declared.
        title: What holds, a clause.
        options: Their defaults; an empty text has to be given.
        margin: How far a right solution may be off, and how seldom it fails; a sentence for the documentation.
    """

    __pydantic_config__ = CLOSED

    name: str
    origin: str
    title: str
    options: dict[str, Option] = field(default_factory=dict)
    margin: str = "Nothing in it is left to chance."

    @property
    def look(self) -> Look:
        """(submission, options, first seed) -> what was found."""
        return LOOKS[self.name]


PROPERTIES: Mapping[str, Property] = {
    each.name: each for each in read_as(Property, Path(__file__).with_name("properties.yaml"), "name")
}
