"""Results of other loops and trackers, shown like any run of pftrack.

`experiment` holds all of it: the wiring, the parameters, the comparison with the truth, and the drawing.
"""

__all__: list[str] = []
