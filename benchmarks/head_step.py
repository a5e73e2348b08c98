"""A frame of the simulated driver at 640 x 480: pose from eleven features, by pftrack and by OpenCV.

OpenCV follows the same points by pyramidal Lucas-Kanade flow and gets the pose from `solvePnP`; `solvePnP` on the true
points shows the cost of the mean face without tracking errors. The goal for PF-ASD is 1 ms for each of its two default
filters, with templates in relief and a growing face; Bando 2007 needed 29 ms a frame, with capture, on a Pentium 4 of
2.8 GHz.
"""

from collections.abc import Callable
from dataclasses import dataclass

from _table import Size, arguments, progress, report, single_threaded

single_threaded()

from statistics import median  # noqa: E402
from time import perf_counter  # noqa: E402

import cv2  # noqa: E402
import numpy as np  # noqa: E402
from numpy.typing import NDArray  # noqa: E402

from pftrack.core.geometry import angles  # noqa: E402
from pftrack.core.model.parameters import revise  # noqa: E402
from pftrack.core.model.source import (  # noqa: E402
    Frame,
    History,
)
from pftrack.core.numerics.elementary import wrap  # noqa: E402
from pftrack.core.numerics.random import Purpose, Stream  # noqa: E402
from pftrack.experiments import find  # noqa: E402
from pftrack.experiments.head.parameters import AS_PUBLISHED  # noqa: E402
from pftrack.experiments.head.scene import HeadSource  # noqa: E402
from pftrack.vision.face import mean_model  # noqa: E402
from pftrack.vision.likelihoods.template import luma  # noqa: E402

HEAD = find("head")
DOCUMENT_MS = 29.05
WINDOW = {"winSize": (31, 31), "maxLevel": 3}
MODEL_MM = np.ascontiguousarray(mean_model().points_mm)

Follow = Callable[[Frame], NDArray[np.float64]]


@dataclass(frozen=True)
class Clip:
    """Frames rendered once, and the features in the first of them."""

    frames: list[Frame]
    points_px: NDArray[np.float64]


def render_clip(count: int) -> Clip:
    """Render the first frames of the script of motions."""
    parameters = HEAD.simulate().parameters
    source, history = HeadSource(0, parameters), History(((0, parameters),))
    frames = []
    for index in range(count):
        if index % 100 == 0:
            progress(f"rendering {index} of {count}")
        frames.append(source.frame(index, history))
    landmarks = source.start.landmarks
    if landmarks is None:
        raise RuntimeError("the simulated head has landmarks")
    return Clip(frames, landmarks.points_px)


def track_by(clip: Clip, method: str, **values: object) -> Follow:
    """Track by a method of pftrack."""
    parameters, tracker = revise(HEAD.simulate().parameters, values), HEAD.trackers[method]
    first = clip.frames[0]
    if first.target is None:
        raise RuntimeError("the simulated head has a target")
    state = tracker.start(first.target, first, parameters, Stream(0, 0, Purpose.TRACK))

    def follow(frame: Frame) -> NDArray[np.float64]:
        nonlocal state
        state = tracker.step(state, frame, parameters, Stream(0, frame.index, Purpose.TRACK))
        return state.estimate

    return follow


def flow(clip: Clip) -> Follow:
    """Follow the points by optical flow and solve for the pose."""
    before, points, resting = _grey(clip.frames[0]), clip.points_px.astype(np.float32), _turn(clip.points_px)

    def follow(frame: Frame) -> NDArray[np.float64]:
        nonlocal before, points
        now = _grey(frame)
        points, *_ = cv2.calcOpticalFlowPyrLK(before, now, points, None, **WINDOW)  # type: ignore[call-overload]
        before = now
        return angles(_turn(points.astype(np.float64)) @ resting.T)

    return follow


def solve_pose(clip: Clip) -> Follow:
    """Solve for the pose from the true points."""
    resting = _turn(clip.points_px)

    def follow(frame: Frame) -> NDArray[np.float64]:
        if frame.target is None or frame.target.landmarks is None:
            raise RuntimeError("the simulated head has landmarks")
        return angles(_turn(frame.target.landmarks.points_px) @ resting.T)

    return follow


def _turn(points_px: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return OpenCV's rotation for points of the mean face in the scene's camera."""
    camera = np.array([[1200.0, 0.0, 320.0], [0.0, 1200.0, 240.0], [0.0, 0.0, 1.0]])
    _, turn, _ = cv2.solvePnP(MODEL_MM, points_px, camera, None, flags=cv2.SOLVEPNP_SQPNP)
    return np.asarray(cv2.Rodrigues(turn)[0])


def _grey(frame: Frame) -> NDArray[np.uint8]:
    if frame.image_rgb is None:
        raise RuntimeError("the simulated head has pictures")
    return luma(frame.image_rgb)


METHODS: dict[str, Callable[[Clip], Follow]] = {
    "PF-ASD, 11 x 50": lambda clip: track_by(clip, "pf-asd"),
    "PF-ASD, 11 x 200": lambda clip: track_by(clip, "pf-asd", sample_count=200),
    "PF-ASD, 11 x 50, mean face": lambda clip: track_by(clip, "pf-asd", face_model="mean"),
    "PF-ASD, 11 x 50, nothing hidden": lambda clip: track_by(clip, "pf-asd", hidden_weight=0.0),
    "PF-ASD, 11 x 50, mean face, nothing hidden": lambda clip: track_by(
        clip, "pf-asd", face_model="mean", hidden_weight=0.0
    ),
    "PF-ASD, 11 x 50, as in Bando 2007": lambda clip: track_by(clip, "pf-asd", **AS_PUBLISHED),
    "alpha = 1, 11 x 50": lambda clip: track_by(clip, "alpha-1"),
    "alpha = 0, 11 x 50": lambda clip: track_by(clip, "alpha-0"),
    "OpenCV, Lucas-Kanade and solvePnP": flow,
    "OpenCV, solvePnP on the true points": solve_pose,
}


def measure(name: str, clip: Clip) -> dict[str, object]:
    """Follow the head once and return the method's row."""
    progress(name)
    METHODS[name](clip)(clip.frames[1])
    follow = METHODS[name](clip)
    taken, errors = [], []
    for frame in clip.frames[1:]:
        begun = perf_counter()
        theta = follow(frame)
        taken.append(1e3 * (perf_counter() - begun))
        if frame.target is not None:
            errors.append(np.abs(wrap(theta - frame.target.position)).mean())
    ordered = sorted(taken)
    return {
        "method": name,
        "ms": median(ordered),
        "95 % within": ordered[int(0.95 * len(ordered))],
        "error, degrees": float(np.rad2deg(np.mean(errors))),
    }


def main() -> None:
    """Measure and report."""
    given = arguments(__doc__.splitlines()[0], frames=Size(900, 3, "frames, 900 are all"))
    cv2.setNumThreads(1)
    clip = render_clip(given.frames)
    rows = [measure(name, clip) for name in METHODS]
    for row in rows:
        row["ratio"] = row["ms"] / rows[0]["ms"]  # type: ignore[operator]
    report("One frame of the driver, 640 x 480", rows, as_json=given.json, document_ms=DOCUMENT_MS)


if __name__ == "__main__":
    main()
