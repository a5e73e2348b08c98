"""What several families of trackers let a person turn, declared once for all of them."""

from typing import Any

from pftrack.core.model.parameters import parameter

__all__ = [
    "correlated_changes",
    "diffusion_scale",
    "learned_motion",
    "loss_share",
    "miss_share",
    "particle_count",
    "resampling_threshold",
]

LEARNED_MOTION = "Learned motion"


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
        role="resampling",
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


def miss_share(default: float, *, group: str) -> Any:  # noqa: ANN401
    """Declare the same for targets with a box, of which an estimate outside is a miss."""
    return parameter(
        default,
        "Frames that may miss",
        "A run is a success if the estimate lies outside the true box in no more than this share of the frames with "
        "known truth.",
        ge=0,
        le=1,
        step=0.01,
        group=group,
        role="loss_share",
    )


def learned_motion(*, trackers: tuple[str, ...]) -> Any:  # noqa: ANN401
    """Declare the file by which particles are guided; the model that has it refuses what its `Guidance` refuses."""
    return parameter(
        "",
        "Learned motion",
        "How motion and shape change, by which particles are guided: a file that pftrack learn or the Files menu has "
        "written, or what comes with the experiment if there is none.",
        accept=".json",
        group=LEARNED_MOTION,
        trackers=trackers,
    )


def diffusion_scale(*, trackers: tuple[str, ...]) -> Any:  # noqa: ANN401
    """Declare how wide the learned diffusion is."""
    return parameter(
        1.0,
        "Width of the diffusion",
        "Factor of all standard deviations of the learned changes.",
        ge=0.05,
        le=20,
        step=0.05,
        group=LEARNED_MOTION,
        trackers=trackers,
        role="noise",
    )


def correlated_changes(*, trackers: tuple[str, ...]) -> Any:  # noqa: ANN401
    """Declare whether the learned correlations are used."""
    return parameter(
        True,
        "Correlated changes",
        "Whether changes of motion and shape are drawn together as they were learned, or each by itself with the same "
        "standard deviation.",
        group=LEARNED_MOTION,
        trackers=trackers,
    )
