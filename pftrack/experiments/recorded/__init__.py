"""What loops and trackers of others have computed, looked at like any run of one's own.

`experiment` holds all of it: the wiring, the parameters, what is compared with the truth, and what is drawn.
"""

__all__: list[str] = []
