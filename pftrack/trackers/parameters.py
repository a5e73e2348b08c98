"""What several families of trackers let a person turn, declared once for all of them."""

from typing import Any

from pftrack.parameters import parameter

__all__ = ["loss_share", "particle_count", "resampling_threshold"]


def particle_count(default: int, *, group: str, trackers: tuple[str, ...]) -> Any:  # noqa: ANN401 - as of `parameter`
    """Declare the number of particles of filters with one set of them."""
    return parameter(
        default,
        "Particles",
        "Number of particles N.",
        ge=1,
        le=100_000,
        step=1,
        group=group,
        trackers=trackers,
        role="particles",
    )


def resampling_threshold(*, group: str, trackers: tuple[str, ...]) -> Any:  # noqa: ANN401
    """Declare when filters resample that need not do so in every frame."""
    return parameter(
        1.0,
        "Resampling threshold",
        "Resample only when the effective sample size is below this share of N; 1 resamples in every frame.",
        ge=0,
        le=1,
        step=0.05,
        group=group,
        trackers=trackers,
    )


def loss_share(default: float, *, group: str) -> Any:  # noqa: ANN401
    """Declare how much of a successful run may be lost, for trackers of targets that can be."""
    return parameter(
        default,
        "Frames that may be lost",
        "A run is a success if no more than this share of its frames with known truth is lost.",
        ge=0,
        le=1,
        step=0.01,
        group=group,
        role="loss_share",
    )
