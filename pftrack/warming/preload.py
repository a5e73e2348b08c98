"""What the fork server of the processes that compile imports: all experiments, once for all of them."""

from pftrack.experiments import EXPERIMENTS
from pftrack.warming import compiling

__all__ = ["compiling"]

dict(EXPERIMENTS)
