"""A frame of the hand trackers, and palms by row sums or filled by OpenCV, on the same picture in one run.

The first comparison is x_p of a palm: ours reads the area outside the silhouette and the contact from sums along rows;
the simple way fills the palm into a picture and compares it with the silhouette's pixels. The second is a whole live
frame, with features, of the beam with one and four hands and of the particle filter.
"""

from _table import Size, arguments, progress, report, single_threaded

single_threaded()

from collections.abc import Callable  # noqa: E402
from statistics import median  # noqa: E402
from time import perf_counter  # noqa: E402

import cv2  # noqa: E402
import numpy as np  # noqa: E402
from numpy.typing import NDArray  # noqa: E402

from pftrack.core.geometry import convex_hull  # noqa: E402
from pftrack.core.model.recipe import Change  # noqa: E402
from pftrack.experiments import find  # noqa: E402
from pftrack.experiments.hand.candidates import palm_candidates  # noqa: E402
from pftrack.experiments.hand.fingers import features_in  # noqa: E402
from pftrack.experiments.hand.likelihood import (  # noqa: E402
    contour_of,
    tables_of,
    x_p,
)
from pftrack.experiments.hand.model import Task, settings  # noqa: E402
from pftrack.experiments.hand.shape import palm_points  # noqa: E402
from pftrack.experiments.hand.silhouette import silhouette_of  # noqa: E402
from pftrack.runs.run import Run  # noqa: E402

MOTIONS = "wrist", "bend", "occlusion"
SEED = 100


def seconds(function: Callable[[], object], repeats: int) -> float:
    """Return the median time of a call, after one that is not counted."""
    function()
    times = []
    for _ in range(repeats):
        began = perf_counter()
        function()
        times.append(perf_counter() - began)
    return median(times)


def by_filling(points: NDArray[np.float64], mask: NDArray[np.uint8], contour: NDArray[np.uint8], scale: float) -> float:
    """Return x_p of a palm's points (18, 2) px, the palm filled into a picture."""
    palm = np.zeros_like(mask)
    hull = cv2.convexHull(np.round(16.0 * points).astype(np.int32))
    cv2.fillConvexPoly(palm, hull, 1, cv2.LINE_8, 4)
    outside = cv2.countNonZero(cv2.bitwise_and(palm, 1 - mask))
    touching = cv2.countNonZero(cv2.bitwise_and(palm, contour))
    return 50.0 * outside / (scale * max(touching, 1))


def main() -> None:
    """Time everything on the simulated hand."""
    options = arguments(
        "The hand trackers and OpenCV.",
        repeats=Size(20, 1, "calls of each"),
        motions=Size(len(MOTIONS), 1, "number of motions"),
        frames=Size(30, 3, "frames of each motion"),
    )
    cv2.setNumThreads(1)
    hand = find("hand")
    rows: list[dict[str, object]] = []
    whole = {}
    for tracker, values in (("beam", {"beam_width": 1}), ("beam", {"beam_width": 4}), ("particles", {})):
        name = f"{tracker} {values.get('beam_width', '')}".strip()
        times = []
        for motion in MOTIONS[: options.motions]:
            progress(f"{name}, {motion}")
            timeline = (Change(0, {"motion": motion, **values}),)
            run = Run(hand, hand.simulate(), tracker=tracker, seed=SEED, frames=options.frames, timeline=timeline)
            run.finish()
            times += [row.step_ms for row in run.diagnostics[2:]]
        whole[name] = median(times)
        rows.append({"what": "frame", "by": name, "ms": whole[name], "frames/s": 1e3 / whole[name]})
    run = Run(hand, hand.simulate(), seed=SEED, frames=6)
    state, parameters = run.finish().state, run.parameters_at(5)
    silhouette = silhouette_of(run.current.frame.image_rgb, parameters)
    time = seconds(lambda: features_in(silhouette), options.repeats)
    rows.append({"what": "features", "by": "pftrack", "ms": 1e3 * time, "frames/s": 1 / time})
    task = Task(state.scale, state.shape, settings(parameters, state.scale))
    seen = tables_of(silhouette.mask, [])
    mask, contour = silhouette.mask.astype(np.uint8), contour_of(silhouette.mask).astype(np.uint8)
    palms = [palm_points(pose, state.scale, state.shape) for pose in palm_candidates(state.pose, task)[0]]
    ours = seconds(lambda: [x_p(convex_hull(each), seen, state.scale) for each in palms], options.repeats)
    theirs = seconds(lambda: [by_filling(each, mask, contour, state.scale) for each in palms], options.repeats)
    for name, time in (("pftrack, row sums", ours), ("OpenCV, filled", theirs)):
        rows.append({"what": f"x_p of {len(palms)} palms", "by": name, "ms": 1e3 * time, "frames/s": 1 / time})
    report(
        "A frame of a hand",
        rows,
        as_json=options.json,
        beam_4_fps=1e3 / whole["beam 4"],
        palms_faster=theirs / ours,
    )


if __name__ == "__main__":
    main()
