"""Learning: models estimated while tracking goes on.

- `online_em`: the dynamics of a second-order autoregression, by expectation maximisation with forgetting.
"""

from pftrack.learning import online_em

__all__ = ["online_em"]
