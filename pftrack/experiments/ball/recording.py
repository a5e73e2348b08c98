"""Whether a target can be followed by its colour: how far its surroundings share it, and what would help."""

from contextlib import suppress
from dataclasses import replace
from itertools import product
from typing import Any

import numpy as np

from pftrack.core.model.marks import Box
from pftrack.core.model.recipe import Footage
from pftrack.core.model.setup import NOT_AT_ALL, WELL, Suitability
from pftrack.core.model.source import Frame, FrameSequence
from pftrack.experiments.ball.model import colour_model
from pftrack.experiments.shared.reports import PointState
from pftrack.experiments.shared.sketch import BETTER_BY, beside, frames_of_a_second, looked_at, remark
from pftrack.vision.likelihoods import chromaticity
from pftrack.vision.likelihoods.chromaticity import ColourModel
from pftrack.vision.likelihoods.separation import Box as Place
from pftrack.vision.likelihoods.separation import Separation, contrast, separation, surroundings

USUAL_LEVEL = 0.02
"""Background level that a recording begins with."""

PARTS, PART = 5, 0.5
"""Smaller boxes that are tried: so many places along each side, and what share of a side they have."""

FINE_PX, WIDE_PX = 48, 960
"""Pixels that are looked at along the shorter side of a target, and along the longer one of a picture, at most."""


def suits(sequence: FrameSequence, footage: Footage, parameters: Any) -> Suitability:  # noqa: ANN401 - on either model
    """Compare the target with its surroundings over a second, as the likelihood weighs them.

    Args:
        sequence: The pictures.
        footage: Start, and a box around the target there.
        parameters: Of frame 0.
    """
    box = Box.model_validate(footage.mark).corner_and_size
    view = _View(sequence, footage.start, box)
    model, level = colour_model(parameters), parameters.background_level
    picture = sequence.picture(footage.start)
    every = _every(max(picture.shape), WIDE_PX)
    likelihood = chromaticity.likelihood_map(picture[::every, ::every], model, level)
    alike = separation(likelihood, (), _scale(box, every)).alike
    found = replace(view.separation(model, level), alike=alike)
    value = found.contrast
    advice, better = _advice(view, parameters, value) if value < WELL else ((), None)
    said = f"{remark(value, found)}; {looked_at(sequence, footage.start)}"
    return Suitability(value, said, advice, better, likelihood)


def look_beside(frame: Frame, state: PointState, parameters: Any, size_px: tuple[float, float]) -> float:  # noqa: ANN401 - see above
    """Return how likely what is around the estimate is beside the estimate itself, in a picture.

    Args:
        frame: The picture.
        state: Of the tracker.
        parameters: In force.
        size_px: Width and height of the target as it was marked.
    """
    picture, (width, height) = frame.picture, size_px
    x, y = state.estimate[:2] - np.array(size_px) / 2
    box = float(x), float(y), width, height
    rows, columns = surroundings(picture.shape, box)
    every = _every(round(min(size_px)), FINE_PX)
    seen = chromaticity.likelihood_map(
        picture[rows, columns][::every, ::every], colour_model(parameters), parameters.background_level
    )
    return beside(separation(seen, (), _scale((box[0] - columns.start, box[1] - rows.start, width, height), every)))


class _View:
    """A target and its surroundings, in the picture in which it is marked and in the second after that.

    Of a large target only every so-many-th pixel is looked at, as it is: a mean of several would have less noise than
    the tracker meets.
    """

    def __init__(self, sequence: FrameSequence, start: int, box: Place) -> None:
        self._sequence, self._start = sequence, start
        self.box = box
        self._every = _every(round(min(box[2:])), FINE_PX)
        rows, columns = surroundings(sequence.size[::-1], box)
        self._corner = columns.start, rows.start
        numbers = frames_of_a_second(sequence, start)
        pictures = (sequence.picture(number)[rows, columns] for number in numbers)
        # Copied, so that the whole pictures need not be kept.
        self._first, *self._later = [picture[:: self._every, :: self._every].copy() for picture in pictures]

    def of(self, box: Place) -> "_View":
        """Return the same of another target."""
        return _View(self._sequence, self._start, box)

    def fit(self, part: Place) -> ColourModel:
        """Return the colour of a part of the target.

        Raises:
            ValueError: The part is black.
        """
        return chromaticity.fit(self._first, self._here(part))

    def separation(self, model: ColourModel, level: float, *, quick: bool = False) -> Separation:
        """Return how a model of colour separates the target; if need be quickly, by the first picture alone."""
        first = chromaticity.likelihood_map(self._first, model, level)
        later = [] if quick else [chromaticity.likelihood_map(picture, model, level) for picture in self._later]
        return separation(first, later, self._here(self.box))

    def contrast_of_part(self, part: Place, level: float, *, quick: bool = False) -> float:
        """Return the contrast of a smaller box within the target's, against the surroundings of the whole.

        Args:
            part: The smaller box, px of the picture.
            level: Background level.
            quick: Whether to look at the first picture alone.

        Raises:
            ValueError: The part is black.
        """
        model = self.fit(part)
        first = chromaticity.likelihood_map(self._first, model, level)
        on = separation(first, (), self._here(part)).on
        return contrast(on, self.separation(model, level, quick=quick).around)

    def _here(self, box: Place) -> Place:
        """Return a box of the picture as one of what is kept of it."""
        x, y, w, h = box
        return _scale((x - self._corner[0], y - self._corner[1], w, h), self._every)


def _every(size: int, most: int) -> int:
    """Return the step by which so many pixels become no more than `most`."""
    return max(1, -(-size // most))


def _scale(box: Place, every: int) -> Place:
    x, y, w, h = box
    return x / every, y / every, w / every, h / every


def _advice(view: _View, parameters: Any, value: float) -> tuple[tuple[str, ...], Box | None]:  # noqa: ANN401 - on either model
    """Say what would help: another colour model or background level, or a smaller box; return that box too."""
    advice = []
    level = parameters.background_level
    for name in {"redness", "chromaticity"} - {parameters.colour_model}:
        model = colour_model(parameters.model_copy(update={"colour_model": name}))
        other = view.separation(model, level).contrast
        if other >= value + BETTER_BY:
            advice.append(f"the colour model {name!r} separates better ({other:.2f})")
    if level > USUAL_LEVEL:
        other = view.separation(colour_model(parameters), USUAL_LEVEL).contrast
        if other >= value + BETTER_BY:
            advice.append(f"a background level of {USUAL_LEVEL:g} separates better ({other:.2f})")
    part, other = _best_part(view, level)
    if other >= value + BETTER_BY:
        # It has surroundings of its own, too: the rest of the target.
        own = view.of(part)
        other = min(other, own.separation(own.fit(part), level).contrast)
    better = Box.of(*part) if other >= max(value + BETTER_BY, NOT_AT_ALL) else None
    if better is not None:
        advice.append(f"a smaller box separates better ({other:.2f}), {better.width:g} x {better.height:g} px")
    if not advice:
        advice.append(
            "no smaller box separates better; the trackers here follow colour alone, so mark something that differs in "
            "colour from what is around it, or use a method that follows something else"
        )
    return tuple(advice), better


def _best_part(view: _View, level: float) -> tuple[Place, float]:
    """Return the smaller box within the target's that separates best, and its contrast."""
    x, y, w, h = view.box
    width, height = max(round(PART * w), 1), max(round(PART * h), 1)
    across, down = (np.linspace(0.0, side - part, PARTS).round() for side, part in ((w, width), (h, height)))
    best, most = view.box, 0.0
    for left, top in product(across, down):
        part = (x + float(left), y + float(top), float(width), float(height))
        with suppress(ValueError):
            found = view.contrast_of_part(part, level, quick=True)
            best, most = (part, found) if found > most else (best, most)
    return best, view.contrast_of_part(best, level) if most > 0.0 else 0.0
