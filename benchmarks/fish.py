"""A frame of the fish filters, and weighing in NumPy, on the same edges in one run.

The first comparison is the look-up of all points of all particles in the distance image, by far the largest part of a
step: ours compiled, NumPy on all particles at once, and a plain loop over particles. The second is a whole step of the
filters, with drawing, moving and estimating, as the paper counts it: ordinary with 3,000 particles, guided with 500;
and the time for the edges of a picture, which both need.
"""

from _table import Size, arguments, progress, report, single_threaded

single_threaded()

from collections.abc import Callable  # noqa: E402
from statistics import median  # noqa: E402
from time import perf_counter  # noqa: E402

import cv2  # noqa: E402
import numpy as np  # noqa: E402
from numpy.typing import NDArray  # noqa: E402

from pftrack.core.model.parameters import revise  # noqa: E402
from pftrack.core.model.source import History  # noqa: E402
from pftrack.experiments import find  # noqa: E402
from pftrack.experiments.fish.model import (  # noqa: E402
    GOLDFISH,
    find_edges,
    largest_distances,
    model_points,
)
from pftrack.experiments.fish.scene import FishSource  # noqa: E402
from pftrack.experiments.fish.trackers import begin_at, step_frame  # noqa: E402

LOOPED = 100
"""Particles for timing the plain loop; its time is proportional to them."""


def seconds(function: Callable[[], object], repeats: int) -> float:
    """Return the median time of a call, s, after a first call that does not count."""
    function()
    times = []
    for _ in range(repeats):
        began = perf_counter()
        function()
        times.append(perf_counter() - began)
    return median(times)


def by_numpy(distances: NDArray[np.uint8], poses: NDArray[np.float64]) -> NDArray[np.uint8]:
    """Return the largest distances (N,) with all particles at once."""
    height, width = distances.shape
    places = np.floor(model_points(poses, GOLDFISH) + 1.5).astype(np.int64)
    columns, rows = np.clip(places[..., 0], 0, width - 1), np.clip(places[..., 1], 0, height - 1)
    largest: NDArray[np.uint8] = distances[rows, columns].max(axis=1)
    return largest


def by_loop(distances: NDArray[np.uint8], poses: NDArray[np.float64]) -> list[int]:
    """Return the largest distances with a loop over particles."""
    return [int(by_numpy(distances, pose[None])[0]) for pose in poses]


def main() -> None:
    """Time everything on frame 1 of a clip."""
    options = arguments("The fish filters and NumPy.", repeats=Size(200, 1, "calls of each"))
    cv2.setNumThreads(1)
    parameters = find("fish").simulate().parameters
    source = FishSource(0, parameters)
    frame = source.frame(1, History(((0, parameters),)))
    edges = find_edges(frame, parameters)
    state = begin_at(source.target(0, parameters), 3000)
    for number in range(1, 4):
        state = step_frame("ordinary", state, edges, revise(parameters, {"sample_count": 3000}), 0, number)
    rows: list[dict[str, object]] = []
    for count in (500, 3000):
        progress(f"look-ups of {count} particles")
        states = np.asfortranarray(state.particles.states[:count])
        poses = np.ascontiguousarray(states[:, [0, 1, 4, 5]])
        distances = edges.distances
        if not (largest_distances(distances, states, GOLDFISH) == by_numpy(distances, poses)).all():
            raise RuntimeError("NumPy gives other distances")
        ours = seconds(lambda s=states: largest_distances(edges.distances, s, GOLDFISH), options.repeats)
        theirs = seconds(lambda p=poses: by_numpy(edges.distances, p), max(options.repeats // 10, 3))
        looped = seconds(lambda p=poses: by_loop(edges.distances, p[:LOOPED]), 3) * count / LOOPED
        for name, time in (("pftrack", ours), ("NumPy, all at once", theirs), ("NumPy, one by one", looped)):
            rows.append({"what": "look-ups", "particles": count, "by": name, "ms": 1e3 * time, "ratio": time / ours})
    whole = {}
    for tracker, count in (("ordinary", 3000), ("guided", 500), ("constant-velocity", 500)):
        progress(f"steps of {tracker}")
        chosen = revise(parameters, {"sample_count": count})
        first = step_frame(tracker, begin_at(source.target(0, parameters), count), edges, chosen, 0, 1)
        whole[tracker] = seconds(lambda t=tracker, s=first, p=chosen: step_frame(t, s, edges, p, 0, 2), options.repeats)
        ratio = whole[tracker] / whole["ordinary"]
        rows.append({"what": "step", "particles": count, "by": tracker, "ms": 1e3 * whole[tracker], "ratio": ratio})
    time = seconds(lambda: find_edges(frame, parameters), max(options.repeats // 4, 3))
    rows.append({"what": "edges", "particles": 0, "by": "OpenCV", "ms": 1e3 * time, "ratio": time / whole["ordinary"]})
    report(
        "A frame of a fish",
        rows,
        as_json=options.json,
        kfps_ordinary=1e-3 / whole["ordinary"],
        kfps_guided=1e-3 / whole["guided"],
    )


if __name__ == "__main__":
    main()
