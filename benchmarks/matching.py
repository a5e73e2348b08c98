"""Block matching of many corners at once, by pftrack and by OpenCV: processor time of a frame, and corners found.

The picture is a texture of rectangles that has moved by a whole number of pixels, so that a perfect search finds every
corner again. OpenCV's `matchTemplate` is called in a loop, once for each corner, on the same windows; it has no sum of
absolute differences, so squared ones are closest. `calcOpticalFlowPyrLK` is another method, which follows gradients
without a search window; it is included for its time.
"""

from _table import Size, arguments, report, single_threaded

single_threaded()

from collections.abc import Callable  # noqa: E402
from statistics import median  # noqa: E402
from time import process_time  # noqa: E402

import cv2  # noqa: E402
import numpy as np  # noqa: E402
from numpy.typing import NDArray  # noqa: E402

from pftrack.core.model.parameters import revise  # noqa: E402
from pftrack.experiments.trajectories.corners import DetectorParameters, find_corners  # noqa: E402
from pftrack.vision.matching import cut, match  # noqa: E402

TEMPLATE_PX, REACH_PX = 11, 13
MOVE = (5, -4)


def pictures(width: int = 640, height: int = 480) -> tuple[NDArray[np.uint8], NDArray[np.uint8]]:
    """Return a texture, and the moved texture, each with its own noise."""
    rng = np.random.default_rng(0)
    grey = np.full((height, width), 128, np.uint8)
    for x, y, level in rng.integers(0, [width, height, 256], (900, 3)).tolist():
        cv2.rectangle(grey, (x, y), (x + 18, y + 13), level, -1)
    both = grey, np.roll(grey, MOVE[::-1], (0, 1))
    one, other = (np.clip(it + rng.normal(0, 3, it.shape), 0, 255).astype(np.uint8) for it in both)
    return one, other


def by_loop(later: NDArray[np.uint8], templates: NDArray[np.uint8], around: NDArray[np.int64]) -> NDArray[np.int64]:
    """Match one corner after the other by OpenCV."""
    half, found = TEMPLATE_PX // 2 + REACH_PX, []
    for (x, y), template in zip(around.tolist(), templates, strict=True):
        window = later[y - half : y + half + 1, x - half : x + half + 1]
        least = cv2.minMaxLoc(cv2.matchTemplate(window, template, cv2.TM_SQDIFF))[2]
        found.append([x - REACH_PX + least[0], y - REACH_PX + least[1]])
    return np.array(found)


def time_matching(
    name: str, call: Callable[[], NDArray[np.float64]], around: NDArray[np.int64], repeats: int
) -> dict[str, object]:
    """Return a row: the median processor time of a call, and the share of corners found within a pixel."""
    found = call()
    taken = []
    for _ in range(repeats):
        begun = process_time()
        call()
        taken.append(1e3 * (process_time() - begun))
    off = np.abs(found - around - np.array(MOVE)).max(axis=1)
    return {"corners": len(around), "method": name, "ms a frame": median(taken), "found": float((off <= 1.0).mean())}


def rows_of(count: int, repeats: int) -> list[dict[str, object]]:
    """Follow `count` corners by all methods."""
    earlier, later = pictures()
    margin = TEMPLATE_PX // 2 + REACH_PX + max(map(abs, MOVE))
    wanted = {"corner_count": count, "corner_margin_px": margin, "corner_distance_px": 3, "corner_quality": 0.01}
    around = find_corners(earlier, revise(DetectorParameters(), wanted)).astype(np.int64)
    templates, points = cut(earlier, around, TEMPLATE_PX), around.astype(np.float32)[:, None]

    def flow() -> NDArray[np.float64]:
        return np.asarray(cv2.calcOpticalFlowPyrLK(earlier, later, points, None, winSize=(11, 11))[0][:, 0], np.float64)

    calls: dict[str, Callable[[], NDArray[np.float64]]] = {
        "pftrack, difference": lambda: match(later, templates, around, REACH_PX).places.astype(np.float64),
        "pftrack, correlation": lambda: match(later, templates, around, REACH_PX, "correlation").places.astype(
            np.float64
        ),
        "OpenCV, matchTemplate in a loop": lambda: by_loop(later, templates, around).astype(np.float64),
        "OpenCV, calcOpticalFlowPyrLK": flow,
    }
    return [time_matching(name, call, around, repeats) for name, call in calls.items()]


def main() -> None:
    """Measure and report."""
    given = arguments(__doc__.splitlines()[0], repeats=Size(50, 1, "frames"))
    cv2.setNumThreads(1)
    rows = [row for count in (60, 200, 400) for row in rows_of(count, given.repeats)]
    title = f"Corners of {TEMPLATE_PX} x {TEMPLATE_PX} px looked for {REACH_PX} px to all sides, 640 x 480"
    report(title, rows, as_json=given.json)


if __name__ == "__main__":
    main()
