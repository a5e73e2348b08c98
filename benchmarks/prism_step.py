"""One frame of the turning prism: every method that tracks it, and OpenCV's pose from the same points.

A step is all work of a method for a frame: particles of eight features, their likelihood, the mixing ratios, the
upper layer and the pose. The goals are 0.12 ms for PF-ASD with 50 particles a feature and 8 ms for the
Rao-Blackwellised filter with 25,000. `solvePnP` gets the measured points of the visible vertices, the visibility and
the true camera, as the pinhole layer does; it has no memory. Bando's own tracker of a driver's head, eleven templates
and the capture included, took 29 ms on a processor of its time.
"""

from _table import Size, arguments, progress, report, single_threaded

single_threaded()

from collections.abc import Callable  # noqa: E402
from statistics import median  # noqa: E402
from time import perf_counter  # noqa: E402

import cv2  # noqa: E402
import numpy as np  # noqa: E402
from numpy.typing import NDArray  # noqa: E402

from pftrack.core.geometry import angles  # noqa: E402
from pftrack.core.numerics.elementary import wrap  # noqa: E402
from pftrack.core.numerics.random import Purpose, Stream  # noqa: E402
from pftrack.experiments.prism.scene import VERTICES_MM, PrismParameters, Sight, sight  # noqa: E402
from pftrack.experiments.shared.pose import layered  # noqa: E402
from pftrack.filters import rao_blackwell  # noqa: E402
from pftrack.filters.affine import AffineLayer  # noqa: E402
from pftrack.filters.perspective import PerspectiveLayer  # noqa: E402
from pftrack.vision.likelihoods import points  # noqa: E402

SCENE = PrismParameters()
SCALE = SCENE.focal_length_px / SCENE.distance_mm
AFFINE = AffineLayer(VERTICES_MM, np.eye(2, 4) * SCALE)
BY_PARTICLES = AffineLayer(VERTICES_MM, np.eye(2, 4) * SCALE, estimator="particle")
PINHOLE = PerspectiveLayer(VERTICES_MM, SCENE.focal_length_px, np.array([0, 0, 0, 0, 0, SCENE.distance_mm]))

Follow = Callable[[int, Sight], NDArray[np.float64]]
"""(frame number, frame) -> angles (3,), rad."""


def layers(layer: AffineLayer | PerspectiveLayer, ratio: float, count: int, *, learn: bool) -> Follow:
    """Track in two layers."""
    settings = layered.Settings(sample_count=count) if learn else layered.Settings(count, learning=None)
    start = Stream(0, 0, Purpose.START)
    state = layered.begin(layer, layer.begin(), sight(0, 0, SCENE).true_px, settings, start, ratio=ratio)

    def follow(index: int, now: Sight) -> NDArray[np.float64]:
        nonlocal state
        state = layered.step(
            state,
            layer,
            lambda positions: points.log_likelihood(positions, now.points_px, now.noise_sd_px),
            settings,
            Stream(0, index, Purpose.TRACK),
        )
        return state.pose.mean

    return follow


def joint(count: int) -> Follow:
    """Track by the Rao-Blackwellised filter."""
    state = rao_blackwell.begin(AFFINE, count)

    def follow(index: int, now: Sight) -> NDArray[np.float64]:
        nonlocal state
        state = rao_blackwell.step(
            state,
            AFFINE,
            lambda positions: points.log_likelihood(positions, now.points_px, now.noise_sd_px),
            Stream(0, index, Purpose.TRACK),
        )
        return state.pose.mean

    return follow


def solve(_: int, now: Sight) -> NDArray[np.float64]:
    """Ask OpenCV."""
    camera = np.diag([SCENE.focal_length_px, SCENE.focal_length_px, 1.0])
    _, turn, _ = cv2.solvePnP(
        VERTICES_MM[now.visible], now.points_px[now.visible], camera, None, flags=cv2.SOLVEPNP_SQPNP
    )
    return angles(cv2.Rodrigues(turn)[0])


METHODS: dict[str, Callable[[], Follow]] = {
    "PF-ASD, affine, 50": lambda: layers(AFFINE, 0.5, 50, learn=True),
    "PF-ASD, affine, 50, pose by 500 particles": lambda: layers(BY_PARTICLES, 0.5, 50, learn=True),
    "PF-ASD, affine, 500": lambda: layers(AFFINE, 0.5, 500, learn=True),
    "PF-ASD, pinhole, 50": lambda: layers(PINHOLE, 0.5, 50, learn=True),
    "alpha = 1, affine, 50": lambda: layers(AFFINE, 1.0, 50, learn=False),
    "alpha = 0, affine, 50": lambda: layers(AFFINE, 0.0, 50, learn=False),
    "RB-PF, 25,000": lambda: joint(25_000),
    "OpenCV solvePnP, visible points": lambda: solve,
}


def measure(method: str, sights: list[Sight]) -> dict[str, object]:
    """Follow the prism once and return the method's row."""
    follow = METHODS[method]()
    times, errors = [], []
    for index, now in enumerate(sights[1:], 1):
        begun = perf_counter()
        theta = follow(index, now)
        times.append(perf_counter() - begun)
        errors.append(np.abs(wrap(theta - now.theta_rad)))
    warm = sorted(times[len(times) // 10 :])
    return {
        "method": method,
        "step ms": 1e3 * median(warm),
        "step ms, p95": 1e3 * warm[int(0.95 * len(warm))],
        "error, degrees": float(np.rad2deg(np.mean(errors))),
    }


def main() -> None:
    """Measure and report."""
    given = arguments(__doc__.splitlines()[0], frames=Size(625, 4, "frames a method"))
    sights = [sight(0, index, SCENE) for index in range(given.frames)]
    rows = []
    for method in METHODS:
        progress(method)
        rows.append(measure(method, sights))
    for row in rows:
        row["ratio"] = row["step ms"] / rows[0]["step ms"]  # type: ignore[operator]
    report("One frame of the turning prism, eight features", rows, as_json=given.json)


if __name__ == "__main__":
    main()
