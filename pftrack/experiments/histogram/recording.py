"""A recording for the window: whether its target can be followed by its colours, and the values to begin with.

The lawn keeps the values of the lecture: it is the lecture's scene, and what it shows (a sharp likelihood that clings,
a velocity that carries) would be hidden by what helps on real pictures. Recordings have the best values that we know.
"""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pftrack.core.arrays import Floats
from pftrack.core.model.marks import Box
from pftrack.core.model.parameters import Value
from pftrack.core.model.recipe import Footage
from pftrack.core.model.setup import WELL, Suitability
from pftrack.core.model.source import Frame, FrameSequence
from pftrack.core.numerics.elementary import exponential
from pftrack.experiments.histogram.model import HistogramState
from pftrack.experiments.shared.sketch import BETTER_BY, beside, frames_of_a_second, looked_at, remark
from pftrack.vision.likelihoods.counting import SPACES, Space
from pftrack.vision.likelihoods.histogram import Window, fit, rho_map
from pftrack.vision.likelihoods.separation import Separation, separation, surroundings

SHARPNESS = 50.0
"""Lambda for which the grades were set, of a window without parts; trackers may have another."""
STEPS_A_WINDOW = 6
"""So many places are looked at along the shorter side of a window."""
COARSE_STEPS = 4
"""The same of each frame of a run."""


def suits(sequence: FrameSequence, footage: Footage, parameters: Any) -> Suitability:  # noqa: ANN401 - on either model
    """Compare the target with its surroundings over a second, as the likelihood weighs windows around both.

    Args:
        sequence: The pictures.
        footage: Start, and a box around the target there.
        parameters: Of frame 0.
    """
    view = _View(sequence, footage, parameters)
    chosen = parameters.colour_space, parameters.spatial_kernel
    likelihood, found = view.separation(*chosen)
    value = found.contrast
    return Suitability(
        value,
        f"{remark(value, found)}; {looked_at(sequence, footage.start)}",
        _advice(view, chosen, value) if value < WELL else (),
        None,
        likelihood,
    )


def look_beside(frame: Frame, state: HistogramState, parameters: Any) -> float:  # noqa: ANN401 - on either model
    """Return how likely what is around the estimate is beside the estimate itself, by the colours as they are counted.

    Args:
        frame: The picture.
        state: Of the tracker.
        parameters: In force.
    """
    del parameters  # what counts of them is in the state
    picture, window = frame.picture, state.window
    width, height = state.box_px
    x, y = state.estimate[:2] - np.array([width, height]) / 2
    box = float(x), float(y), width, height
    rows, columns = surroundings(picture.shape, box)
    # Windows at the edge of what is looked at reach beyond it.
    top, left = max(rows.start - window.reach_down_px, 0), max(columns.start - window.reach_across_px, 0)
    seen = picture[top : rows.stop + window.reach_down_px, left : columns.stop + window.reach_across_px]
    step = max(min(window.size_px) // COARSE_STEPS, 1)
    rho = rho_map(np.ascontiguousarray(seen), window, state.space, state.model, step, state.background)
    likelihood = exponential(SHARPNESS * (rho - 1.0))
    return beside(separation(likelihood, (), ((x - left) / step, (y - top) / step, width / step, height / step)))


class _View:
    """A target in the picture in which it is marked, and its place in the second after that."""

    def __init__(self, sequence: FrameSequence, footage: Footage, parameters: Any) -> None:  # noqa: ANN401 - see above
        self._pictures = [sequence.picture(number) for number in frames_of_a_second(sequence, footage.start)]
        self._box = Box.model_validate(footage.mark).corner_and_size
        self._reach = int(parameters.window_width_px) // 2, int(parameters.window_height_px) // 2

    def separation(self, space: Space, kernel: bool) -> tuple[Floats, Separation]:
        """Return the likelihood over the first picture, and how it separates the target, for a way of counting."""
        window = Window(*self._reach, kernel)
        x, y, w, h = self._box
        first, *later = self._pictures
        model = fit(first, np.array([x + (w - 1) / 2, y + (h - 1) / 2]), window, space)
        step = max(min(window.size_px) // STEPS_A_WINDOW, 1)

        def likelihood(picture: NDArray[np.uint8]) -> Floats:
            return exponential(SHARPNESS * (rho_map(picture, window, space, model, step) - 1.0))

        begun = likelihood(first)
        scaled = x / step, y / step, w / step, h / step
        return begun, separation(begun, (likelihood(picture) for picture in later), scaled)


def _advice(view: _View, chosen: tuple[Space, bool], value: float) -> tuple[str, ...]:
    """Say which other way of counting separates better."""
    advice = []
    for space in SPACES:
        for kernel in (False, True):
            if (space, kernel) == chosen:
                continue
            other = view.separation(space, kernel)[1].contrast
            if other >= value + BETTER_BY:
                weighed = "weighing the middle" if kernel else "counting all alike"
                advice.append(f"the colour space {space!r}, {weighed}, separates better ({other:.2f})")
    if not advice:
        advice.append(
            "no other way of counting separates better; the trackers here follow colours alone, so mark something that "
            "differs in its colours from what is around it"
        )
    return tuple(advice)


PICTURES: Mapping[str, Value] = MappingProxyType(
    {
        "sharpness": 70,
        "spatial_kernel": True,
        "parts_across": 2,
        "parts_down": 3,
        "weigh_background": True,
        "surround_contrast": 0.4,
        "follow_size": True,
        "size_noise": 0.012,
        "follow_camera": True,
        "wide_share": 0.1,
    }
)
"""Parts, colours beside their background, contrast, size and camera; each helped on clips that were chosen by."""
