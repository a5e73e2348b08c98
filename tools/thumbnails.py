"""Draw the small picture of each experiment for its card on the start page.

`python -m tools.thumbnails` writes `thumbnail.webp` into the folder of each experiment: a middle frame of a run of its
own scene with its first preset. Names of experiments after the command limit it to those. A test compares the files
with new drawings (`tests/tools/test_thumbnails.py`).
"""

import sys
from collections.abc import Iterable

import cv2
import numpy as np
from numpy.typing import NDArray

from pftrack.core.model.recipe import Change
from pftrack.experiments import EXPERIMENTS
from pftrack.experiments.experiment import Experiment
from pftrack.runs.run import Run
from pftrack.vision.rendering import render

__all__ = ["LARGEST_BYTES", "draw", "main", "pack"]

FRAME = 90
"""Frame of the run by which a cloud of particles has spread, and an occluder hides the target."""

WIDTH_PX = 400
LARGEST_BYTES = 10_000


def draw(experiment: Experiment) -> NDArray[np.uint8]:
    """Return a frame of an experiment's run with its first preset, RGB, as wide as a card."""
    preset = experiment.presets[0]
    timeline = (Change(0, preset.parameters),)
    run = Run(experiment, experiment.simulate(), tracker=preset.tracker, seed=preset.seed, timeline=timeline)
    run.seek(min(FRAME, run.frames - 1))
    drawing = experiment.draw(run.current, run.diagnostics)
    return render(drawing, layers=experiment.display.shown, scale=WIDTH_PX / drawing.width, caption=False)


def pack(image_rgb: NDArray[np.uint8]) -> bytes:
    """Return a picture as a WebP file of at most `LARGEST_BYTES`, as sharp as that allows."""
    image_bgr = cv2.cvtColor(image_rgb, cv2.COLOR_RGB2BGR)
    for quality in range(90, 0, -5):
        done, file = cv2.imencode(".webp", image_bgr, (cv2.IMWRITE_WEBP_QUALITY, quality))
        if done and file.size <= LARGEST_BYTES:
            return file.tobytes()
    raise ValueError(f"a picture of shape {image_rgb.shape} takes more than {LARGEST_BYTES} bytes")


def main(names: Iterable[str]) -> None:
    """Draw the thumbnails of some experiments."""
    for name in names:
        path = EXPERIMENTS[name].display.thumbnail
        if path is not None:
            path.write_bytes(pack(draw(EXPERIMENTS[name])))
            sys.stderr.write(f"{path}: {path.stat().st_size} bytes\n")


if __name__ == "__main__":
    main(sys.argv[1:] or EXPERIMENTS.own)
