"""What a likelihood says of any state, for people who want to look into it.

A filter asks its likelihood p(z_t | x_t) at its particles alone. Whoever wants to know why a target was lost asks it
elsewhere: at the target, at a look-alike, all over the picture. A tracker that can answer declares an
`ObservationLikelihood`: the very function that weighs its particles, for any states of any frame, and what that number
is made of (`pftrack.core.model.part`), such as the histogram of a window beside the model's.

An `Anchor` says where in the picture a state is, and which state is at a place; so a picture can be covered with states
that are like the estimate in all but the place (`likelihood_map`).
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from pftrack.core.model.frame import Frame
from pftrack.core.model.part import Part

__all__ = ["Anchor", "Component", "LikelihoodMap", "ObservationLikelihood", "anchor_at", "lattice"]

LOWEST = -20.0
"""Of the logarithm of a likelihood beside the greatest on a map: what is less probable is as good as impossible."""


@dataclass(frozen=True, slots=True)
class Component:
    """One coordinate of a state.

    Attributes:
        name: As an array's column is called.
        unit: "px", "rad"; empty for a pure number.
    """

    name: str
    unit: str = ""


LogLikelihood: TypeAlias = Callable[[Any, NDArray[np.float64], Frame, Any], NDArray[np.float64]]
"""(state, states (N, d), frame, parameters) -> log p(z_t | x_t) (N,)."""


@dataclass(frozen=True)
class Anchor:
    """How states lie in the picture.

    Attributes:
        place: (state of the tracker, states (N, d)) -> their places (N, 2), px.
        put: (state of the tracker, one state (d,), places (M, 2)) -> states (M, d) at these places, else like the one.
    """

    place: Callable[[Any, NDArray[np.float64]], NDArray[np.float64]]
    put: Callable[[Any, NDArray[np.float64], NDArray[np.float64]], NDArray[np.float64]]


def anchor_at(across: int = 0, down: int = 1) -> Anchor:
    """Return the anchor of states of which two components are the place, px."""
    axes = [across, down]

    def place(_: object, states: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.asarray(states[:, axes])

    def put(_: object, state: NDArray[np.float64], places: NDArray[np.float64]) -> NDArray[np.float64]:
        states = np.tile(state, (len(places), 1))
        states[:, axes] = places
        return states

    return Anchor(place, put)


def _no_parts(*_: object) -> tuple[Part, ...]:
    return ()


def _as_it_is(state: Any, frame: Frame, parameters: Any) -> Any:  # noqa: ANN401 - the state of any family
    del frame, parameters
    return state


@dataclass(frozen=True)
class ObservationLikelihood:
    """p(z_t | x_t) of a tracker, to be asked at any state.

    All functions but `prepare` and `centre` take the state of the frame before as `prepare` has brought it up to the
    frame; of frame 0, that of frame 0 itself.

    Attributes:
        title: What it compares, a few words.
        components: (parameters) -> the coordinates of a state, in order; d of them.
        log_likelihood: The function that weighs particles, up to a constant; see `LogLikelihood`.
        prepare: (state before, frame, parameters) -> the state as far as it can be brought up to the frame without its
            particles, such as a model that other parameters want otherwise.
        centre: (state) -> the state (d,) that stands for what is believed.
        anchor: How states lie in the picture; None where they have no place there.
        parts: (state before, one state (d,), frame, parameters) -> what the number of that state is made of.
        most_places: How many states a map of the picture may ask for, so that it takes 50 ms at most.
        weighs: Whether a particle that was drawn by prediction has a weight in proportion to this alone.
    """

    title: str
    components: Callable[[Any], tuple[Component, ...]]
    log_likelihood: LogLikelihood
    centre: Callable[[Any], NDArray[np.float64]]
    prepare: Callable[[Any, Frame, Any], Any] = _as_it_is
    anchor: Anchor | None = field(default_factory=anchor_at)
    parts: Callable[[Any, NDArray[np.float64], Frame, Any], tuple[Part, ...]] = _no_parts
    most_places: int = 4800
    weighs: bool = True

    def ask(self, before: Any, states: NDArray[np.float64], frame: Frame, parameters: Any) -> NDArray[np.float64]:  # noqa: ANN401 - of any family
        """Return log p(z_t | x_t) (N,) of states (N, d), given the state before; NaN counts as impossible, -inf."""
        known = self.prepare(before, frame, parameters)
        found = self.log_likelihood(known, states, frame, parameters)
        return np.where(np.isnan(found), -np.inf, found)

    def map(self, before: Any, state: Any, frame: Frame, parameters: Any, size: tuple[int, int]) -> "LikelihoodMap":  # noqa: ANN401 - of any family
        """Return the likelihood all over a picture.

        Args:
            before: The state of the frame before.
            state: The state of the frame: what is asked for is like it in all but the place.
            frame: What was seen.
            parameters: In force.
            size: Width and height of the picture, px.

        Raises:
            ValueError: The states have no place in the picture.
        """
        if self.anchor is None:
            raise ValueError(f"the {self.title} has no place in the picture")
        known = self.prepare(before, frame, parameters)
        places, (rows, columns), step = lattice(size, self.most_places)
        states = self.anchor.put(known, self.centre(state), places)
        found = self.log_likelihood(known, states, frame, parameters)
        return LikelihoodMap(np.where(np.isnan(found), -np.inf, found).reshape(rows, columns), step)


@dataclass(frozen=True, slots=True, eq=False)
class LikelihoodMap:
    """A likelihood all over a picture.

    Attributes:
        log_likelihoods: (rows, columns), the first in the middle of the first cell.
        step_px: Sides of a cell, px.
    """

    log_likelihoods: NDArray[np.float64]
    step_px: int

    @property
    def range(self) -> tuple[float, float]:
        """The lowest and the highest number that colours tell apart; equal where all are the same or impossible."""
        finite = self.log_likelihoods[np.isfinite(self.log_likelihoods)]
        if not len(finite):
            return 0.0, 0.0
        high = float(finite.max())
        return max(float(finite.min()), high + LOWEST), high

    @property
    def levels(self) -> NDArray[np.float64]:
        """(rows, columns) from 0 for the lowest of the range and below to 1 for the highest."""
        low, high = self.range
        spread = high - low if high > low else 1.0
        return np.clip((self.log_likelihoods - low) / spread, 0.0, 1.0)


def lattice(size: tuple[int, int], most: int) -> tuple[NDArray[np.float64], tuple[int, int], int]:
    """Return places all over a picture, in the middles of equal cells.

    Args:
        size: Width and height of the picture, px.
        most: How many places at the most.

    Returns:
        The places (rows * columns, 2), px, row after row; how many rows and columns; and the sides of a cell, px.
    """
    width, height = size
    step = max(math.isqrt(max(width * height // most, 1)), 1)
    while math.ceil(width / step) * math.ceil(height / step) > most:
        step += 1
    rows, columns = np.arange(step // 2, height, step), np.arange(step // 2, width, step)
    across, down = np.meshgrid(columns.astype(np.float64), rows.astype(np.float64))
    return np.column_stack([across.ravel(), down.ravel()]), (len(rows), len(columns)), step
