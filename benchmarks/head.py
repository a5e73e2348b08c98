"""The simulated driver's head at 640 x 480: rendering a frame, the templates' likelihood, finding a face.

The goals are 10 ms for a frame and 0.6 ms for the likelihood of 11 features x 50 particles; the picture's luma is part
of it. Detection has no goal; it runs once, and at intervals while a face is lost. Median and fastest call are given: on
a busy machine the fastest is closer to the code's own time.
"""

from collections.abc import Callable

from _table import Size, arguments, progress, report, single_threaded

single_threaded()

from statistics import median  # noqa: E402
from time import perf_counter  # noqa: E402

import cv2  # noqa: E402
import numpy as np  # noqa: E402

from pftrack.core.model.parameters import revise  # noqa: E402
from pftrack.core.model.source import History  # noqa: E402
from pftrack.experiments.head.appearance import template_sizes  # noqa: E402
from pftrack.experiments.head.detection import detect, find_again  # noqa: E402
from pftrack.experiments.head.scene import HeadSceneParameters, HeadSource  # noqa: E402
from pftrack.vision.face import FEATURES  # noqa: E402
from pftrack.vision.likelihoods import template  # noqa: E402

OCCLUDED = {"sunglasses": True, "hand_cover": 0.6, "pillar_width_px": 60}


def measure(name: str, call: Callable[[int], object], repeats: int, goal_ms: float | None = None) -> dict[str, object]:
    """Call with 0..repeats and return the row; the first call compiles and is left out."""
    progress(name)
    taken = []
    for index in range(repeats + 1):
        begun = perf_counter()
        call(index)
        taken.append(1e3 * (perf_counter() - begun))
    del taken[0]
    return {"what": name, "ms": median(taken), "fastest ms": min(taken), "goal ms": goal_ms}


def rendering(name: str, repeats: int, **values: object) -> dict[str, object]:
    """Render frames spread over the script of motions."""
    parameters = revise(HeadSceneParameters(), values)
    source, history = HeadSource(0, parameters), History(((0, parameters),))
    return measure(name, lambda index: source.frame(7 * index % 900, history), repeats, 10.0)


def likelihood(count: int, spread_px: float, repeats: int) -> dict[str, object]:
    """Weigh particles around the true points of the frontal frame."""
    parameters = HeadSceneParameters()
    source = HeadSource(0, parameters)
    image = source.frame(0, History(((0, parameters),))).image_rgb
    landmarks = source.start.landmarks
    if image is None or landmarks is None:
        raise RuntimeError("the simulated head has pictures and landmarks")
    templates = template.cut(template.luma(image), landmarks.points_px, template_sizes(FEATURES, 108.0))
    noise = np.random.default_rng(0).standard_normal((11, count, 2))
    positions = landmarks.points_px[:, None] + spread_px * noise
    return measure(
        f"likelihood, 11 x {count}, spread {spread_px:g} px",
        lambda _: template.log_likelihood(template.luma(image), positions, templates),
        repeats,
        0.6 if count == 50 else None,
    )


def main() -> None:
    """Measure and report."""
    given = arguments(__doc__.splitlines()[0], frames=Size(120, 6, "frames a row"))
    cv2.setNumThreads(1)
    parameters = HeadSceneParameters()
    image = HeadSource(0, parameters).frame(0, History(((0, parameters),))).image_rgb
    grey = template.luma(image)  # type: ignore[arg-type] # a picture
    rows = [
        rendering("frame", given.frames),
        rendering("frame, everything in front", given.frames, **OCCLUDED),
        rendering("frame, 320 x 240", given.frames, image_width_px=320),
        likelihood(50, 5.0, 10 * given.frames),
        likelihood(50, 20.0, 10 * given.frames),
        likelihood(200, 5.0, 3 * given.frames),
        measure("detection", lambda _: detect(grey), given.frames // 6),
        measure("found again nearby", lambda _: find_again(grey, (188.0, 98.0, 270.0, 270.0)), given.frames // 6),
    ]
    report("The simulated head, 640 x 480, one core", rows, as_json=given.json)


if __name__ == "__main__":
    main()
