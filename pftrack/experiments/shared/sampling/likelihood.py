"""What the loop weighs particles by: any compiled likelihood of pictures, with its parameters packed for compiled code.

A family of trackers reuses the loop with a `Likelihood` of its own:

    class Brightness(NamedTuple):
        level: float

    @compiled
    def log_likelihood(image_rgb, states, brightness): ...

    LIKELIHOOD = Likelihood(log_likelihood, lambda parameters: Brightness(...))
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from pftrack.experiments.shared.sampling.loop import LogLikelihood, loop_with

__all__ = ["Likelihood"]


@dataclass(frozen=True)
class Likelihood:
    """p(z | x) of a picture.

    Attributes:
        log_likelihood: (picture, states (N, d), packed parameters) -> (N,); compiled.
        packed: What the family knows of its target, such as the parameters -> a named tuple of what the function needs.
        loop: The loop that weighs by it.
    """

    log_likelihood: LogLikelihood
    packed: Callable[[Any], tuple[Any, ...]]
    loop: Any = field(init=False, repr=False)

    def __post_init__(self) -> None:
        """Build the loop; it is compiled when it runs first."""
        object.__setattr__(self, "loop", loop_with(self.log_likelihood))
