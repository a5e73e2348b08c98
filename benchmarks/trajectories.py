"""Many tracks with outliers, 2,000 particles each: time of a frame of all tracks, by pftrack and by others.

The tracks are simulated ones of Ichimura and Ikoma 2000, section 5.1. Ours smooths with a lag of 25 frames and takes
modes of
histograms; NumPy, written as a user would, does all tracks in one array and smooths by a ring of paths; `particles` and
FilterPy take one track after the other and only filter. E is Ichimura and Ikoma's error, the median over the tracks.
"""

from _table import Size, arguments, progress, report, single_threaded

single_threaded()

from collections.abc import Callable  # noqa: E402
from time import process_time  # noqa: E402

import numpy as np  # noqa: E402
from numpy.typing import NDArray  # noqa: E402

from pftrack.experiments.trajectories.scene import TracksSceneParameters, simulate  # noqa: E402
from pftrack.filters.trajectories.whole import Method, Settings, follow, track_error  # noqa: E402
from pftrack.runs.checkpoint import bytes_of  # noqa: E402

Array = NDArray[np.float64]
Followed = tuple[Array, Array | None, float]
"""Filtered and smoothed positions (T, K, 2), and megabytes kept from frame to frame."""

SIGMA, TAU, LAG, COUNT = 1.0, 1.0, 25, 2000
GAUSSIAN_NOISE = 10.0


def ours(method: Method, tracks: Array, *, by_mode: bool = True) -> Followed:
    """Follow by pftrack."""
    noise = GAUSSIAN_NOISE if method == "lg" else SIGMA**2
    found = follow(method, tracks, Settings(noise, TAU**2, LAG, COUNT, by_mode=by_mode))
    return found.filtered, found.smoothed, bytes_of(found.last, set()) / 1e6


def with_numpy(tracks: Array) -> Followed:
    """Follow all tracks in one array, and keep the last positions of each particle."""
    length, several, _ = tracks.shape
    rng = np.random.default_rng(0)
    ring = tracks[0][:, None, None] + rng.standard_normal((several, COUNT, LAG + 1, 2))
    filtered, smoothed = np.empty_like(tracks), np.empty_like(tracks)
    for t in range(length):
        new = 2.0 * ring[:, :, 0] - ring[:, :, 1] + TAU * rng.standard_normal((several, COUNT, 2))
        weights = (SIGMA / (np.square(tracks[t][:, None] - new) + SIGMA**2)).prod(axis=2)
        weights /= weights.sum(axis=1, keepdims=True)
        filtered[t] = (weights[..., None] * new).sum(axis=1)
        wanted = (np.arange(COUNT) + rng.random((several, 1))) / COUNT
        parents = np.array([np.searchsorted(np.cumsum(one), at) for one, at in zip(weights, wanted, strict=True)]).clip(
            max=COUNT - 1
        )
        paths = np.concatenate([new[:, :, None], ring[:, :, :-1]], axis=2)
        ring = np.take_along_axis(paths, parents[:, :, None, None], axis=1)
        known = min(t, LAG) + 1
        smoothed[t + 1 - known : t + 1] = ring[:, :, :known].mean(axis=1).swapaxes(0, 1)[::-1]
    return filtered, smoothed, ring.nbytes / 1e6


def with_particles(tracks: Array) -> Followed:
    """Follow one track after the other by `particles`; it does not smooth."""
    import particles as library

    rng = np.random.default_rng(0)

    class Path(library.FeynmanKac):  # type: ignore[misc]
        def __init__(self, data: Array) -> None:
            super().__init__(len(data))
            self.data = data

        def M0(self, N):  # type: ignore[no-untyped-def] # noqa: ANN001, ANN202, N802, N803 - the library's names
            return self.M(0, np.tile(self.data[0], 2) + rng.standard_normal((N, 4)))

        def M(self, _t, xp):  # type: ignore[no-untyped-def] # noqa: ANN001, ANN202, N802
            here = 2.0 * xp[:, :2] - xp[:, 2:] + TAU * rng.standard_normal((len(xp), 2))
            return np.concatenate([here, xp[:, :2]], axis=1)

        def logG(self, t, _xp, x):  # type: ignore[no-untyped-def] # noqa: ANN001, ANN202, N802
            return -np.log(np.square(self.data[t] - x[:, :2]) + SIGMA**2).sum(axis=1)

    filtered = np.empty_like(tracks)
    for place in range(tracks.shape[1]):
        smc = library.SMC(fk=Path(tracks[:, place]), N=COUNT, resampling="systematic", ESSrmin=1.0, collect="off")
        for t in range(len(tracks)):
            next(smc)
            filtered[t, place] = smc.W @ smc.X[:, :2]
    return filtered, None, tracks.shape[1] * COUNT * 4 * 8 / 1e6


def with_filterpy(tracks: Array) -> Followed:
    """Follow one track after the other by FilterPy's Kalman filter; it does not smooth."""
    from filterpy.kalman import KalmanFilter

    filtered = np.empty_like(tracks)
    for place in range(tracks.shape[1]):
        kalman = KalmanFilter(4, 2)
        kalman.F = np.kron(np.array([[2.0, -1.0], [1.0, 0.0]]), np.eye(2))
        kalman.H, kalman.R = np.eye(2, 4), GAUSSIAN_NOISE * np.eye(2)
        kalman.Q = np.diag([TAU**2, TAU**2, 0.0, 0.0])
        kalman.x, kalman.P = np.tile(tracks[0, place], 2), np.eye(4)
        for t, seen in enumerate(tracks[:, place]):
            kalman.predict()
            kalman.update(seen)
            filtered[t, place] = kalman.x[:2]
    return filtered, None, tracks.shape[1] * 20 * 8 / 1e6


def main() -> None:
    """Measure and report."""
    given = arguments(
        __doc__.splitlines()[0],
        tracks=Size(200, 3, "how many"),
        frames=Size(40, 8, "of each"),
    )
    values = {"track_count": given.tracks, "reference_track": False}
    tracks, truth = (one[: given.frames] for one in simulate(0, TracksSceneParameters.model_validate(values)))
    ways: dict[str, Callable[[Array], Followed]] = {
        "pftrack, LNG": lambda data: ours("lng", data),
        "pftrack, LNG, means": lambda data: ours("lng", data, by_mode=False),
        "pftrack, NLNG": lambda data: ours("nlng", data),
        "NumPy, LNG, means": with_numpy,
        "particles, LNG, means, filtered only": with_particles,
        "pftrack, LG": lambda data: ours("lg", data),
        "FilterPy, LG, filtered only": with_filterpy,
    }
    rows: list[dict[str, object]] = []
    times: dict[str, float] = {}
    for name, way in ways.items():
        progress(name)
        try:
            way(tracks[:3])
            begun = process_time()
            filtered, smoothed, megabytes = way(tracks)
        except ImportError as error:
            progress(f"{name}: {error}")
            continue
        times[name] = 1e3 * (process_time() - begun) / given.frames
        base = times["pftrack, LG" if ", LG" in name else "pftrack, LNG, means" if "means" in name else name]
        rows.append(
            {
                "who": name,
                "ms a frame": times[name],
                "ratio": times[name] / base,
                "E filtered": float(np.median(track_error(filtered, truth))),
                "E smoothed": None if smoothed is None else float(np.median(track_error(smoothed, truth))),
                "kept, MB": megabytes,
            }
        )
    report(f"{given.tracks} tracks, {COUNT} particles each", rows, as_json=given.json)


if __name__ == "__main__":
    main()
