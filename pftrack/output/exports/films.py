"""A run as moving pictures: what a frame looks like with everything that is drawn over it, MP4 or GIF.

Films have every frame at the source's own rate. A GIF is for a slide or a page: at most so wide, so fast and so long
that it can be loaded; of a longer run it shows every second frame, every third and so on, at the same speed.
"""

import math
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pftrack.core.model.faults import without_faults
from pftrack.runs.manifest import embed, extent_of, title_of
from pftrack.runs.run import Run
from pftrack.vision.rendering import render_beside
from pftrack.vision.rendering.film import FilmWriter, common_colours, write_gif

GIF_RATE_HZ, GIF_PICTURES, GIF_WIDE_PX = 15.0, 300, 640
SAMPLED = 6
"""So many pictures of a run tell which colours its GIF needs."""

Steps = Iterator[tuple[int, int]]


def mp4_of(run: Run, path: Path) -> Steps:
    """Write a film of a run, whose manifest is the file's comment."""
    total = run.computed + 1
    words = {"title": f"{title_of(run)}; {extent_of(run)}", "comment": embed(run)}
    with FilmWriter(path, run.source.frame_rate_hz, words) as film:
        for frame in range(total):
            film.write(_picture(run, frame))
            yield frame + 1, total


def gif_of(run: Run, path: Path) -> Steps:
    """Write a GIF of a run that plays for ever, whose manifest is the file's comment."""
    total, rate_hz = run.computed + 1, run.source.frame_rate_hz
    stride = max(math.ceil(rate_hz / GIF_RATE_HZ), math.ceil(total / GIF_PICTURES), 1)
    scale = min(1.0, GIF_WIDE_PX / _picture(run, 0).shape[1])
    samples = sorted({round(place) for place in np.linspace(0, total - 1, SAMPLED)})
    colours = common_colours([_picture(run, frame, scale) for frame in samples])
    pictures = []
    for frame in range(0, total, stride):
        pictures.append(colours.of(_picture(run, frame, scale)))
        yield min(frame + stride, total), total
    write_gif(path, pictures, stride / rate_hz, comment=embed(run))


def _picture(run: Run, frame: int, scale: float = 1.0) -> NDArray[np.uint8]:
    """Return what a frame looks like, (height, width, 3) RGB; the run stands there afterwards."""
    drawing = without_faults(run.experiment.draw(run.seek(frame), run.diagnostics))
    return render_beside(drawing, layers=run.experiment.shown_layers, scale=scale)
