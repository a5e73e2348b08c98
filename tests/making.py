"""What tests make themselves: short films, and runs that have come to their end."""

from collections.abc import Iterable, Mapping, Sequence
from io import BytesIO
from pathlib import Path
from typing import Any

import av
import numpy as np
from numpy.typing import NDArray

from pftrack.core.model.parameters import Value
from pftrack.core.model.recipe import Change
from pftrack.core.model.setup import Setup
from pftrack.experiments.experiment import Experiment
from pftrack.runs.run import Run

__all__ = ["disc_film", "encoded", "truth_file", "whole_run"]

Picture = NDArray[np.uint8]


def encoded(pictures: Sequence[Picture], frame_rate_hz: int = 30, **options: str) -> bytes:
    """Return pictures of one size as an H.264 film, (height, width, 3) uint8 RGB each; `options` are the encoder's."""
    file = BytesIO()
    with av.open(file, "w", format="mp4") as container:
        stream = container.add_stream("libx264", rate=frame_rate_hz, options={"crf": "12", **options})
        stream.height, stream.width = pictures[0].shape[:2]
        stream.pix_fmt = "yuv420p"
        for picture in pictures:
            frame = av.VideoFrame.from_ndarray(np.ascontiguousarray(picture), format="rgb24")
            container.mux(stream.encode(frame))
        container.mux(stream.encode(None))
    return file.getvalue()


def disc_film(
    frames: int, *, speed_px: int = 2, ground: int = 110, colours: Iterable[tuple[int, int, int]] = ()
) -> bytes:
    """Return a film, 160 x 120 px, of a disc of 9 px that begins at (40, 60) and walks to the right.

    Args:
        frames: Its length.
        speed_px: How far the disc walks from frame to frame.
        ground: The grey behind it.
        colours: Colours of the disc in the first frames; it is red in the others.
    """
    y, x = np.mgrid[:120, :160]
    given = dict(enumerate(colours))
    pictures = []
    for index in range(frames):
        pictures.append(np.full((120, 160, 3), ground, np.uint8))
        pictures[-1][np.hypot(x - 40 - speed_px * index, y - 60) <= 9] = given.get(index, (210, 40, 40))
    return encoded(pictures)


def truth_file(folder: Path, text: str) -> Path:
    """Return a new file with a table of what is true."""
    path = folder / "truth.csv"
    path.write_text(text, encoding="utf-8")
    return path


def whole_run(
    experiment: Experiment, setup: Setup | None = None, *, values: Mapping[str, Value] | None = None, **options: Any
) -> Run:
    """Return a run that is computed to its end.

    Args:
        experiment: What is tracked.
        setup: Where; without it, on the experiment's own scene.
        values: Parameters from frame 0 on.
        options: Tracker, seed, frames and timeline, as `Run` takes them.
    """
    if values:
        options["timeline"] = (Change(0, values), *options.get("timeline", ()))
    run = Run(experiment, setup or experiment.simulate(), **options)
    run.finish()
    return run
