"""What is believed of a body after a frame, in the same form for all methods."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pftrack.experiments.structure.trackers.methods import Belief, Prior
from pftrack.experiments.structure.trackers.observed import Observed
from pftrack.experiments.structure.trackers.placing import Placed
from pftrack.sources.tracks.bodies import Shape

__all__ = ["StructureState"]


@dataclass(frozen=True, eq=False)
class StructureState:
    """The belief after a frame, immutable; the estimate is the shape.

    Attributes:
        body: What is between its points.
        prior: What was known beforehand.
        principal_px: (2,) where the camera's axis meets the picture.
        seen: The frames so far.
        belief: The method's own.
        placed: The shape in the common frame of reference, and the camera.
        focal_px: That the camera was assumed to have in this frame.
        log_evidence: Of this frame before it was taken, where the method has one; else 0.
    """

    body: Shape
    prior: Prior
    principal_px: NDArray[np.float64]
    seen: Observed
    belief: Belief
    placed: Placed
    focal_px: float
    log_evidence: float = 0.0

    @property
    def estimate(self) -> NDArray[np.float64]:
        """(3 n,) the shape about its centre, of unit size."""
        return self.placed.points.ravel()

    @cached_property
    def sigma(self) -> NDArray[np.float64]:
        """(3 n,) standard deviations of the same."""
        variances = np.diagonal(self.placed.covariances, axis1=1, axis2=2)
        return np.asarray(np.sqrt(np.maximum(variances, 0.0)).ravel())

    @property
    def nbytes(self) -> int:
        """About how much memory it takes, bytes."""
        return self.seen.nbytes + self.belief.nbytes + 4096

    def arrays(self) -> Mapping[str, NDArray[Any]]:
        """Return the shape's covariances and the camera, for a file."""
        return {"covariances": self.placed.covariances, "camera": self.placed.camera}
