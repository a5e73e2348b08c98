"""What an upper layer is: a model of the whole object that says where each of its features should be seen.

Features are tracked in two layers. The lower one is the image positions of the features, a small particle filter each;
the upper one, the state of the object that carries them. From above comes a prediction of every feature, a Gaussian per
axis over its position in this frame and in the last (Bando 2007, ch. 4, eq. 4.8); from below come measured positions,
the means of the particles, with their variances.

The members are `affine` (entries of an affine camera by a Kalman filter, from which the pose is estimated) and
`perspective` (pose and translation by an extended Kalman filter on a pinhole).
"""

from dataclasses import dataclass
from typing import Protocol, TypeVar

from pftrack.core.arrays import Floats
from pftrack.core.numerics.random import Gaussian, Generator

S = TypeVar("S")


@dataclass(frozen=True, slots=True)
class Projection:
    """Where F features should be seen: independent Gaussians per feature and axis, of positions now and a frame ago.

    Attributes:
        means: (F, 2, 2) px; by feature, axis (x, y) and age (this frame, the last).
        covariances: (F, 2, 2, 2) px^2; by feature and axis, over the two ages.
    """

    means: Floats
    covariances: Floats

    @property
    def positions(self) -> Floats:
        """(F, 2) px, where the features should be in this frame."""
        positions: Floats = self.means[:, :, 0]
        return positions

    @property
    def variances(self) -> Floats:
        """(F, 2) px^2 of the positions, per axis."""
        variances: Floats = self.covariances[:, :, 0, 0]
        return variances


class UpperLayer(Protocol[S]):
    """A model of the object; its belief S is a frozen value."""

    def begin(self) -> S:
        """Return the belief at the beginning."""

    def predict(self, belief: S) -> S:
        """Return the belief a frame later."""

    def project(self, belief: S) -> Projection:
        """Return where the features should be seen."""

    def update(self, belief: S, positions: Floats, variances: Floats, rng: Generator) -> S:
        """Condition on positions (F, 2) px with variances (F, 2) px^2, and estimate the pose."""

    def pose(self, belief: S) -> Gaussian:
        """Return the belief in the angles (theta_x, theta_y, theta_z), rad."""
