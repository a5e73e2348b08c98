"""Colour histograms: 300 boxes weighed at once, and whole trackers of one window at 640 x 480.

The peers are OpenCV's `calcHist` in a loop over the boxes, which does not give a likelihood, and its trackers CamShift
(mean shift on the back-projection of a histogram of hues) and MIL (boosted features). All get the same decoded
pictures; conversions such as HSV are part of a tracker's time. The goals are 300 boxes of 40 x 40 px within 0.25 ms
where the loop takes 1.2 ms, and 300 frames a second at 640 x 480.
"""

from _table import Size, arguments, progress, report, single_threaded

single_threaded()

from collections.abc import Callable, Iterator  # noqa: E402
from statistics import median  # noqa: E402
from time import perf_counter  # noqa: E402

import cv2  # noqa: E402
import numpy as np  # noqa: E402
from numpy.typing import NDArray  # noqa: E402

from pftrack.core.model.parameters import revise  # noqa: E402
from pftrack.core.model.source import Frame, Target  # noqa: E402
from pftrack.core.numerics.random import Purpose, Stream  # noqa: E402
from pftrack.experiments import find  # noqa: E402
from pftrack.experiments.histogram.experiment import RecordedHistogramParameters  # noqa: E402
from pftrack.vision.likelihoods.counting import bin_table  # noqa: E402
from pftrack.vision.likelihoods.histogram import (  # noqa: E402
    NO_BACKGROUND,
    Window,
    fit,
    similarities,
)

BOXES, REACH = 300, 20
WIDTH, HEIGHT = 640, 480
HALF = 25, 33


def lawn(count: int) -> tuple[NDArray[np.uint8], NDArray[np.float64]]:
    """Return pictures (count, 480, 640, 3) of a two-coloured target on a lawn, and its true centres."""
    rng = np.random.default_rng(0)
    ground = cv2.GaussianBlur(rng.normal(size=(HEIGHT, WIDTH, 3)), (0, 0), 2.5) * 60 + (105, 120, 95)
    times = np.arange(count)
    places = np.column_stack([120 + 1.6 * times, 240 + 60 * np.sin(times / 30)])
    pictures = np.empty((count, HEIGHT, WIDTH, 3), np.uint8)
    for picture, place in zip(pictures, places, strict=True):
        image = ground + rng.normal(0, 4, ground.shape)
        middle = round(place[0]), round(place[1])
        cv2.ellipse(image, middle, HALF, 0, 180, 360, (205, 40, 40), -1)
        cv2.ellipse(image, middle, HALF, 0, 0, 180, (215, 190, 40), -1)
        picture[:] = np.clip(image, 0, 255)
    pictures.flags.writeable = False
    return pictures, places


def median_time(function: Callable[[], object], repeats: int) -> float:
    """Return the median time of a call, ms."""
    function()
    times = []
    for _ in range(repeats):
        begun = perf_counter()
        function()
        times.append(perf_counter() - begun)
    return 1e3 * median(times)


def weighing(picture: NDArray[np.uint8], repeats: int) -> Iterator[dict[str, object]]:
    """Yield the rows of weighing boxes: in a cloud, all over the picture, and by the kernel."""
    rng = np.random.default_rng(1)
    side = 2 * REACH + 1
    model = np.sqrt(fit(picture, np.array([120.0, 240.0]), Window(REACH, REACH), "hsv"))
    hsv = cv2.cvtColor(picture, cv2.COLOR_RGB2HSV)
    half = np.full(BOXES, float(REACH))
    places = {
        "in a cloud, 5 px": rng.normal((320, 240), 5, (BOXES, 2)),
        "in a cloud, 20 px": rng.normal((320, 240), 20, (BOXES, 2)),
        "all over the picture": rng.uniform((REACH, REACH), (WIDTH - REACH, HEIGHT - REACH), (BOXES, 2)),
    }
    for name, centres in places.items():
        columns, rows = np.ascontiguousarray(centres.T)
        corners = [(int(column) - REACH, int(row) - REACH) for column, row in centres]

        def ours(kernel: bool, columns: NDArray[np.float64] = columns, rows: NDArray[np.float64] = rows) -> object:
            return similarities(
                picture, columns, rows, half, half, bin_table("hsv"), model, kernel, (1, 1), NO_BACKGROUND
            )

        def loop(corners: list[tuple[int, int]] = corners) -> None:
            for left, top in corners:
                box = hsv[top : top + side, left : left + side]
                cv2.calcHist([box], [0, 1], None, [10, 10], [0, 180, 0, 256])

        peer = median_time(loop, max(repeats // 10, 3))
        for who, ms in (
            ("ours, colours put into bins too", median_time(lambda: ours(kernel=False), repeats)),
            ("ours, by the kernel", median_time(lambda: ours(kernel=True), repeats)),
            ("cv2.calcHist in a loop, HSV given", peer),
        ):
            yield _row(f"300 boxes of 41 x 41 px {name}", who, ms, ms / peer)


def following(
    pictures: NDArray[np.uint8], places: NDArray[np.float64]
) -> Iterator[tuple[str, float, NDArray[np.float64]]]:
    """Yield name, time (s) and estimates in frames 1, 2, ... of each whole tracker."""
    size = 2 * HALF[0] + 1, 2 * HALF[1] + 1
    corner = round(places[0, 0]) - HALF[0], round(places[0, 1]) - HALF[1]
    for kernel in (False, True):
        parameters = revise(
            RecordedHistogramParameters(),
            {"window_width_px": size[0], "window_height_px": size[1], "process_noise_px": 3, "spatial_kernel": kernel},
        )
        tracker = find("histogram").trackers["condensation"]
        first = Frame(0, 0.0, image_rgb=pictures[0])
        state = tracker.start(Target(places[0], max(size)), first, parameters, Stream(0, 0, Purpose.START))
        if tracker.fold is None:
            raise RuntimeError("the lecture's filter takes many frames at once")
        tracker.fold(state, pictures[1:3], parameters, 0, 1)
        begun = perf_counter()
        found = tracker.fold(state, pictures[1:], parameters, 0, 1)
        seconds = perf_counter() - begun
        estimates = found.estimates if found else np.full_like(places[1:], np.nan)
        yield f"ours, 300 particles{', by the kernel' if kernel else ''}", seconds, estimates
        begun, live = perf_counter(), []
        for index, picture in enumerate(pictures[1:], 1):
            frame = Frame(index, 0.0, image_rgb=picture)
            state = tracker.step(state, frame, parameters, Stream(0, index, Purpose.TRACK))
            live.append(state.estimate)
        seconds = perf_counter() - begun
        yield f"the same, frame by frame{', by the kernel' if kernel else ''}", seconds, np.array(live)
    yield "OpenCV, CamShift", *_cam_shift(pictures, (*corner, *size))
    if hasattr(cv2, "TrackerMIL_create"):
        yield "OpenCV, MIL", *_mil(pictures, (*corner, *size))


def measure_trackers(pictures: NDArray[np.uint8], places: NDArray[np.float64]) -> Iterator[dict[str, object]]:
    """Yield the rows of whole trackers: time of a frame, also relative to the first tracker's, and error."""
    first = None
    for who, seconds, estimates in following(pictures, places):
        count = len(estimates)
        ms = 1e3 * seconds / count
        first = first or ms
        error = float(np.hypot(*(estimates - places[1 : count + 1]).T).mean())
        yield _row("a frame of 640 x 480 px", who, ms, ms / first, error)


def _row(what: str, who: str, ms: float, ratio: float, error_px: float | None = None) -> dict[str, object]:
    return {"what": what, "who": who, "ms": ms, "a second": 1e3 / ms, "ratio": ratio, "error, px": error_px}


def _cam_shift(pictures: NDArray[np.uint8], box: tuple[int, int, int, int]) -> tuple[float, NDArray[np.float64]]:
    x, y, w, h = box
    hsv = cv2.cvtColor(pictures[0], cv2.COLOR_RGB2HSV)
    mask = cv2.inRange(hsv, np.array((0, 60, 32)), np.array((180, 255, 255)))
    histogram = cv2.calcHist([hsv[y : y + h, x : x + w]], [0], mask[y : y + h, x : x + w], [16], [0, 180])
    cv2.normalize(histogram, histogram, 0, 255, cv2.NORM_MINMAX)
    criteria = (cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_COUNT, 10, 1)
    estimates = []
    begun = perf_counter()
    for picture in pictures[1:]:
        hsv = cv2.cvtColor(picture, cv2.COLOR_RGB2HSV)
        back = cv2.calcBackProject([hsv], [0], histogram, [0, 180], 1)
        back &= cv2.inRange(hsv, np.array((0, 60, 32)), np.array((180, 255, 255)))
        turned, box = cv2.CamShift(back, box, criteria)  # type: ignore[assignment]
        estimates.append(turned[0])
    return perf_counter() - begun, np.array(estimates)


def _mil(pictures: NDArray[np.uint8], box: tuple[int, int, int, int]) -> tuple[float, NDArray[np.float64]]:
    tracker = cv2.TrackerMIL_create()
    tracker.init(pictures[0], box)
    estimates = []
    begun = perf_counter()
    for picture in pictures[1:41]:
        _, (x, y, w, h) = tracker.update(picture)
        estimates.append((x + (w - 1) / 2, y + (h - 1) / 2))
    return perf_counter() - begun, np.array(estimates)


def main() -> None:
    """Measure and report."""
    given = arguments(
        __doc__.splitlines()[0],
        repeats=Size(300, 3, "calls of ours"),
        frames=Size(200, 4, "frames that a tracker follows"),
    )
    progress("pictures")
    pictures, places = lawn(given.frames)
    progress("boxes")
    rows = list(weighing(pictures[0], given.repeats))
    progress("trackers")
    rows += measure_trackers(pictures, places)
    report("Windows by their colours, decoding apart", rows, as_json=given.json)


if __name__ == "__main__":
    main()
