"""pftrack: interactive tracking experiments with particle filters.

Data flows one way, `Source -> Tracker -> Run -> Drawing`, and parameters flow the other way through one door
(`pftrack.parameters.revise`). The library knows nothing of the web; the server is another package.
"""

from pftrack import machine

__all__ = ["__version__"]

__version__ = "0.2.0"

# Before any library is loaded that would choose by the processor how it computes.
machine.settle()
