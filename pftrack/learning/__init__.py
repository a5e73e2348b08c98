"""Learning: models estimated while tracking goes on.

- `online_em`: the dynamics of a second-order autoregression, by expectation maximisation with forgetting;
- `mixture_em`: the ratio in which particles are drawn from two predictions.
"""

from pftrack.learning import mixture_em, online_em

__all__ = ["mixture_em", "online_em"]
