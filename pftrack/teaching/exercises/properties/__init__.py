"""Properties: what a file should do, each a function that looks and returns a verdict.

Those of single functions call these with arrays made for it; those of a filter compare runs with an exact answer, with
another tracker, or with the truth. `weights` has those of weights, of resampling and of a whole tracker, `exact` those
with an exact answer and those of how functions go about it; `registry` has all by name, with their options.
"""

from pftrack.teaching.exercises.properties.registry import PROPERTIES
from pftrack.teaching.exercises.properties.weights import Option, Property

__all__ = ["PROPERTIES", "Option", "Property"]
