"""A chain of three links: a frame of each tracker, and of an extended Kalman filter as a user would write it.

The scene is that of the preset `cross`. The NumPy filter has a function for the image and one for its derivatives, and
no bounds; FilterPy gets the same. The error is that of the worst link direction over the last six frames, the median
over the seeds: a filter with one hypothesis and no bounds loses a link in some of them.
"""

from _table import Size, arguments, progress, report, single_threaded

single_threaded()

from collections.abc import Callable  # noqa: E402
from itertools import islice  # noqa: E402
from time import process_time  # noqa: E402

import numpy as np  # noqa: E402
from numpy.typing import NDArray  # noqa: E402

from pftrack.core.model.parameters import revise  # noqa: E402
from pftrack.core.model.setup import Setup  # noqa: E402
from pftrack.core.model.source import Frame  # noqa: E402
from pftrack.core.numerics.random import Purpose, Stream  # noqa: E402
from pftrack.experiments import find  # noqa: E402
from pftrack.experiments.linkage.scene import LinkageTarget  # noqa: E402
from pftrack.runs.run import Run  # noqa: E402

Array = NDArray[np.float64]
LINKAGE = find("linkage")
LAST_FRAMES = 6
ACCELERATION, NOISE = 0.03, 5.0
START_VARIANCES = np.array([0.2] * 3 + [0.01] * 3 + [400.0] * 3)
MOTION = np.eye(9)
MOTION[:3, 3:6] = np.eye(3)
PROCESS = np.zeros((9, 9))
PROCESS[:3, :3], PROCESS[3:6, 3:6] = 0.25 * np.eye(3), np.eye(3)
PROCESS[:3, 3:6] = PROCESS[3:6, :3] = 0.5 * np.eye(3)
PROCESS *= ACCELERATION**2


def image(x: Array) -> Array:
    """Return the image positions of the joints and the tip (3,), px."""
    return np.asarray(np.cumsum(x[6:] * np.cos(np.cumsum(x[:3]))))


def slopes(x: Array) -> Array:
    """Return the derivatives (3, 9) of the image positions."""
    angles = np.cumsum(x[:3])
    down = np.tril(np.ones((3, 3)))
    turned = down * (-x[6:] * np.sin(angles))
    return np.hstack([turned @ down, np.zeros((3, 3)), down * np.cos(angles)])


def with_numpy(start: LinkageTarget, seen: Array) -> Array:
    """Filter by plain NumPy, and return theta of all frames (T, 3)."""
    x, p = np.concatenate([start.theta, np.zeros(3), start.r]), np.diag(START_VARIANCES)
    found = [x[:3]]
    for y in seen[1:]:
        x, p = MOTION @ x, MOTION @ p @ MOTION.T + PROCESS
        c = slopes(x)
        gain = p @ c.T @ np.linalg.inv(c @ p @ c.T + NOISE * np.eye(3))
        x, p = x + gain @ (y - image(x)), p - gain @ c @ p
        found.append(x[:3])
    return np.array(found)


def with_filterpy(start: LinkageTarget, seen: Array) -> Array:
    """Filter by FilterPy, and return theta of all frames (T, 3)."""
    from filterpy.kalman import ExtendedKalmanFilter

    ekf = ExtendedKalmanFilter(dim_x=9, dim_z=3)
    ekf.x, ekf.P = np.concatenate([start.theta, np.zeros(3), start.r]), np.diag(START_VARIANCES)
    ekf.F, ekf.Q, ekf.R = MOTION, PROCESS, NOISE * np.eye(3)
    found = [ekf.x[:3]]
    for y in seen[1:]:
        ekf.predict()
        ekf.update(y, slopes, image)
        found.append(ekf.x[:3])
    return np.array(found)


def scene(seed: int, frames: int) -> tuple[Run, list[Frame]]:
    """Return a run of the preset, for its parameters, and its first frames."""
    preset = LINKAGE.preset_named("cross")
    setup = LINKAGE.simulate()
    run = Run(LINKAGE, Setup(setup.open_source, revise(setup.parameters, preset.parameters)), tracker="ekf", seed=seed)
    return run, [step.frame for step in islice(run, frames)]


def error(theta: Array, frames: list[Frame]) -> float:
    """Return the largest error of a link's direction over the last frames, degrees."""
    true = np.array([frame.target.theta for frame in frames if isinstance(frame.target, LinkageTarget)])
    off = np.cumsum(theta - true, axis=1)[-LAST_FRAMES:]
    return float(np.rad2deg(np.abs((off + np.pi) % (2.0 * np.pi) - np.pi).max(axis=1).mean()))


def ours(name: str, run: Run, frames: list[Frame], seed: int) -> Array:
    """Track by pftrack, and return theta of all frames (T, 3)."""
    tracker, parameters = LINKAGE.trackers[name], run.current.parameters
    state = tracker.start(run.source.start, frames[0], parameters, Stream(seed, 0, Purpose.START))
    found = [state.mean[:3]]  # type: ignore[attr-defined]
    for frame in frames[1:]:
        state = tracker.step(state, frame, parameters, Stream(seed, frame.index, Purpose.TRACK))
        found.append(state.mean[:3])  # type: ignore[attr-defined]
    return np.array(found)


def main() -> None:
    """Measure and report."""
    given = arguments(__doc__.splitlines()[0], seeds=Size(10, 1, "how many"), frames=Size(51, 7, "frames of a run"))
    scenes = [scene(seed, given.frames) for seed in range(given.seeds)]
    others: dict[str, Callable[[LinkageTarget, Array], Array]] = {
        "NumPy, one EKF": with_numpy,
        "FilterPy, one EKF": with_filterpy,
    }
    names = [*LINKAGE.trackers, *others]
    rows: list[dict[str, object]] = []
    for name in names:
        progress(name)
        errors, spent, count = [], 0.0, 0
        try:
            for seed, (run, frames) in enumerate(scenes):
                begun = process_time()
                start = run.source.start
                if name in others and isinstance(start, LinkageTarget):
                    points = np.array([one.measurements.points_px[:, 0] for one in frames if one.measurements])
                    theta = others[name](start, points - start.origin_px[0])
                else:
                    theta = ours(name, run, frames, seed)
                if seed or len(scenes) == 1:  # the first one compiles
                    spent, count = spent + process_time() - begun, count + len(frames)
                errors.append(error(theta, frames))
        except ImportError as missing:
            progress(f"{name}: {missing}")
            continue
        lost = sum(one > 11.5 for one in errors) / len(errors)
        rows.append(
            {"who": name, "ms a frame": 1e3 * spent / count, "error, °": float(np.median(errors)), "lost": lost}
        )
    report(f"{given.seeds} runs of {given.frames} frames", rows, as_json=given.json)


if __name__ == "__main__":
    main()
