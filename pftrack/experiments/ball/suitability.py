"""Whether a target can be followed by its colour: how far its surroundings share it, and what would help."""

from contextlib import suppress
from dataclasses import replace
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pftrack.likelihoods import chromaticity
from pftrack.likelihoods.chromaticity import ColourModel
from pftrack.likelihoods.separation import Box as Place
from pftrack.likelihoods.separation import Separation, contrast, separation, surroundings
from pftrack.marks import Box
from pftrack.runs.recipe import Footage
from pftrack.sources.sequence import FrameSequence
from pftrack.suitability import NOT_AT_ALL, WELL, Suitability
from pftrack.trackers.ball.likelihood import colour_model

__all__ = ["suits"]

LOOKS = 9
"""Pictures that are looked at, the first included, evenly over a second."""

USUAL_LEVEL = 0.02
"""Background level that a recording begins with."""

BETTER_BY = 0.15
"""What would help is said if it helps at least this much."""

PARTS, PART = 5, 0.5
"""Smaller boxes that are tried: so many places along each side, and what share of a side they have."""

MUCH = 0.1
"""Share of the rest of a picture that is worth a word if it has the target's colour."""


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
    likelihood = chromaticity.likelihood_map(view.first, model, level)
    found = view.separation(model, level, likelihood)
    value = found.contrast
    advice, better = _advice(view, parameters, value) if value < WELL else ((), None)
    return Suitability(value, _remark(value, found), advice, better, likelihood)


class _View:
    """The picture with the target, and its surroundings in the second after it."""

    def __init__(self, sequence: FrameSequence, start: int, box: Place) -> None:
        self._sequence, self._start = sequence, start
        last = min(start + round(sequence.frame_rate_hz), sequence.frame_count - 1)
        self.box = box
        self.first = sequence.picture(start)
        rows, columns = surroundings(self.first.shape, box)
        x, y, w, h = box
        self._near = rows, columns
        self._box_near = (x - columns.start, y - rows.start, w, h)
        numbers = sorted({int(number) for number in np.linspace(start, last, LOOKS)} - {start})
        self._later = [sequence.picture(number)[rows, columns] for number in numbers]

    def of(self, box: Place) -> "_View":
        """Return the same of another target."""
        return _View(self._sequence, self._start, box)

    def separation(self, model: ColourModel, level: float, likelihood: NDArray[np.float64]) -> Separation:
        """Return how a model of colour separates the target, given its likelihood over the first picture."""
        near = likelihood[self._near]
        later = [chromaticity.likelihood_map(picture, model, level) for picture in self._later]
        found = separation(near, later, self._box_near)
        return replace(found, alike=separation(likelihood, (), self.box).alike)

    def contrast(self, model: ColourModel, level: float) -> float:
        """Return the contrast of another model, or with another background level."""
        near = chromaticity.likelihood_map(self.first[self._near], model, level)
        later = [chromaticity.likelihood_map(picture, model, level) for picture in self._later]
        return separation(near, later, self._box_near).contrast

    def contrast_of_part(self, part: Place, level: float, *, quick: bool = False) -> float:
        """Return the contrast of a smaller box within the target's, against the surroundings of the whole.

        Args:
            part: The smaller box, px of the picture.
            level: Background level.
            quick: Whether to look at the first picture alone.

        Raises:
            ValueError: The part is black.
        """
        model = chromaticity.fit(self.first, part)
        near = chromaticity.likelihood_map(self.first[self._near], model, level)
        x, y, w, h = part
        rows, columns = self._near
        on = separation(near, (), (x - columns.start, y - rows.start, w, h)).on
        later = [] if quick else [chromaticity.likelihood_map(picture, model, level) for picture in self._later]
        return contrast(on, separation(near, later, self._box_near).around)


def _remark(value: float, found: Separation) -> str:
    """Say what was found: how likely the surroundings are, and whether the rest of the picture looks alike."""
    share = f"{100 * found.around / found.on:.0f} %" if found.on > 0.0 else "100 %"
    if value >= WELL:
        said = f"separates well: what is around the target is {share} as likely as the target itself"
    elif value > 0.0:
        grade = Suitability(value, "").grade
        said = f"separates {grade}: what is around the target is {share} as likely as the target itself"
        said += ", expect losses" if grade == "poorly" else ", so that nothing holds the tracker to it"
    else:
        said = "separates not at all: what is around the target is as likely as the target itself, or more"
    if found.alike >= MUCH:
        said += f"; {100 * found.alike:.0f} % of the rest of the picture looks like it"
    return said


def _advice(view: _View, parameters: Any, value: float) -> tuple[tuple[str, ...], Box | None]:  # noqa: ANN401 - on either model
    """Say what would help: another colour model or background level, or a smaller box; return that box too."""
    advice = []
    level = parameters.background_level
    for name in {"redness", "chromaticity"} - {parameters.colour_model}:
        other = view.contrast(colour_model(parameters.model_copy(update={"colour_model": name})), level)
        if other >= value + BETTER_BY:
            advice.append(f"the colour model {name!r} separates better ({other:.2f})")
    if level > USUAL_LEVEL:
        other = view.contrast(colour_model(parameters), USUAL_LEVEL)
        if other >= value + BETTER_BY:
            advice.append(f"a background level of {USUAL_LEVEL:g} separates better ({other:.2f})")
    part, other = _best_part(view, level)
    if other >= value + BETTER_BY:
        # It has surroundings of its own, too: the rest of the target.
        other = min(other, view.of(part).contrast(chromaticity.fit(view.first, part), level))
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
