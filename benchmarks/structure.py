"""The shape of the prism from its tracks: every method and two peers, on the same tracks in one run.

For each number of frames: the shape error (Bando 2007, eq. 4.19), and the time of a further frame. Batch methods start
again with each frame, so their time grows with the frames; online methods take one step. The peers are NumPy's singular
values on tracks whose hidden points are filled in iteratively by their rank-three fit, and SciPy's nonlinear least
squares over all shapes and pinholes, started at the shape of the first window: the ceiling of accuracy.
"""

from _table import Size, arguments, progress, report, single_threaded

single_threaded()

from collections.abc import Callable  # noqa: E402
from statistics import median  # noqa: E402
from time import perf_counter  # noqa: E402
from typing import Any  # noqa: E402

import numpy as np  # noqa: E402
from numpy.typing import NDArray  # noqa: E402
from scipy.optimize import least_squares  # noqa: E402
from scipy.sparse import lil_matrix  # noqa: E402
from scipy.spatial.transform import Rotation  # noqa: E402

from pftrack.reproduce.structure import SimulatedTracks, head_tracks, prism_tracks  # noqa: E402
from pftrack.vision.face import mean_model  # noqa: E402
from pftrack.vision.structure import growing, recursive, variational  # noqa: E402
from pftrack.vision.structure.cameras import Sight, fit_camera  # noqa: E402
from pftrack.vision.structure.factorization import Tracks, check_view, factorize, shape_error  # noqa: E402
from pftrack.vision.structure.recursive import from_window  # noqa: E402

WINDOW = 90
HIDDEN_VARIANCE = 100.0
"""Variance above which a point counts as hidden for the peer that fills in."""

FILLS = 50

Shape = NDArray[np.float64]


def time_call(call: Callable[[], Shape], repeats: int) -> tuple[Shape, float]:
    """Return the result of a call, and its median time, ms."""
    taken = []
    for _ in range(repeats):
        begun = perf_counter()
        shape = call()
        taken.append(1e3 * (perf_counter() - begun))
    return shape, median(taken)


def time_steps(step: Callable[[Any, Shape, Shape], Any], state: Any, tracks: Tracks, begin: int) -> tuple[Any, float]:
    """Process frames from `begin` on; return the last state and the median time of a step, ms."""
    taken = []
    for positions, variances in zip(tracks.positions[begin:], tracks.variances[begin:], strict=True):
        started = perf_counter()
        state = step(state, positions, variances)
        taken.append(1e3 * (perf_counter() - started))
    return state, median(taken)


def fill_hidden(tracks: Tracks) -> Shape:
    """Fill hidden points in iteratively by the rank-three fit of all, and factor the result."""
    rows, hidden = tracks.matrix, tracks.precisions < 1.0 / HIDDEN_VARIANCE
    seen = np.where(hidden, 0.0, rows).sum(axis=1) / np.maximum((~hidden).sum(axis=1), 1)
    rows[hidden] = np.broadcast_to(seen[:, None], rows.shape)[hidden]
    for _ in range(FILLS):
        means = rows.mean(axis=1, keepdims=True)
        left, values, right = np.linalg.svd(rows - means, full_matrices=False)
        rows[hidden] = (means + (left[:, :3] * values[:3]) @ right[:3])[hidden]
    return right[:3].T


def adjust_bundle(body: SimulatedTracks, tracks: Tracks) -> Shape:
    """Adjust all points and all pinholes together, by SciPy."""
    focal, frames = body.focal_px, len(tracks.positions)
    state = from_window(window_of(tracks), recursive.Settings(focal))
    count = len(state.shape)
    cameras = [np.zeros((3, 4))] * frames
    # From the window's last frame, whose camera is known, back and forth.
    for order in (range(WINDOW - 1, -1, -1), range(WINDOW, frames)):
        camera = state.camera
        if camera is None:
            raise RuntimeError("a window leaves a camera")
        for index in order:
            sight = Sight(focal, *check_view(tracks.positions[index], tracks.variances[index], count))
            camera = fit_camera(sight, camera, state.shape, camera, 0.0, 50)
            cameras[index] = camera
    turns = Rotation.from_matrix([one[:, :3] for one in cameras])
    weights = 1.0 / np.sqrt(tracks.variances)

    def residuals(numbers: Shape) -> Shape:
        shape = numbers[: 3 * count].reshape(count, 3)
        moves = numbers[3 * count :].reshape(frames, 6)
        turned = (Rotation.from_rotvec(moves[:, :3]) * turns).as_matrix()
        placed = np.einsum("tij,nj->tni", turned, shape) + moves[:, None, 3:]
        return (weights * (focal * placed[..., :2] / placed[..., 2:] - tracks.positions)).ravel()

    sparsity = lil_matrix((2 * frames * count, 3 * count + 6 * frames), dtype=bool)
    for row in range(2 * frames * count):
        frame, point = row // (2 * count), row // 2 % count
        sparsity[row, 3 * point : 3 * point + 3] = True
        sparsity[row, 3 * count + 6 * frame : 3 * count + 6 * frame + 6] = True
    moves = np.array([[0.0, 0.0, 0.0, *one[:, 3]] for one in cameras])
    start = np.concatenate([state.shape.ravel(), moves.ravel()])
    found = least_squares(residuals, start, jac_sparsity=sparsity, x_scale="jac", max_nfev=30)
    return found.x[: 3 * count].reshape(count, 3)


def window_of(tracks: Tracks) -> Tracks:
    """Return the tracks of the first frames."""
    return Tracks(tracks.positions[:WINDOW], tracks.variances[:WINDOW])


def rows_of(frames: int, repeats: int) -> list[dict[str, object]]:
    """Reconstruct from `frames` frames by all methods, and return their rows."""
    body = prism_tracks(0)
    tracks = Tracks(body.tracks.positions[:frames], body.tracks.variances[:frames])
    rows = []

    def add(method: str, shape: Shape, ms: float) -> None:
        error = shape_error(shape, body.shape_mm)
        rows.append({"frames": frames, "method": method, "shape error": error, "ms a further frame": ms})

    progress(f"{frames} frames")
    add("singular values", *time_call(lambda: factorize(tracks).shape, repeats))
    add("NumPy, singular values, filled in", *time_call(lambda: fill_hidden(tracks), 3))
    add("variational, 10 passes", *time_call(lambda: variational.fit(tracks).shape, repeats))
    for forgetting, memory in (("common", 0.5), ("by-information", 1.0)):
        settings = variational.Settings(window=WINDOW, memory=memory, forgetting=forgetting)
        online, _ = time_steps(variational.step, variational.begin(14, settings), window_of(tracks), 0)
        online, ms = time_steps(variational.step, online, tracks, min(WINDOW, frames - 1))
        add(f"online variational, forgetting {forgetting}", online.shape, ms)
    first = from_window(window_of(tracks), recursive.Settings(body.focal_px))
    last, ms = time_steps(recursive.step, first, tracks, min(WINDOW, frames - 1))
    add("recursion", last.shape, ms)
    add("SciPy, least squares over all frames", *time_call(lambda: adjust_bundle(body, tracks), 1))
    return rows


def grow(frames: int) -> dict[str, object]:
    """Let a model grow from the mean face on the tracks of driver 99, and return its row."""
    body, mean = head_tracks(99, 0, frames=frames), mean_model().points_mm
    state = growing.begin(mean, np.tile(9.0 * np.eye(3), (11, 1, 1)), growing.Settings(body.focal_px))
    state, ms = time_steps(growing.step, state, body.tracks, 0)
    error = shape_error(state.own.shape, body.shape_mm)
    return {"frames": frames, "method": "grown face, 11 points", "shape error": error, "ms a further frame": ms}


def main() -> None:
    """Measure and report."""
    given = arguments(
        __doc__.splitlines()[0],
        repeats=Size(15, 1, "calls of a batch method"),
        frames=Size(120, WINDOW + 2, "frames of the shortest tracks"),
        lengths=Size(3, 1, "number of lengths, the shortest one times 1, 2, ..."),
    )
    if not given.smallest:
        rows_of(WINDOW + 2, 1)  # the first one compiles
    lengths = [given.frames * times for times in range(1, given.lengths + 1)]
    rows = [row for frames in lengths for row in rows_of(frames, given.repeats)]
    report("The shape of the prism, fourteen points", [*rows, grow(2 * given.frames)], as_json=given.json)


if __name__ == "__main__":
    main()
