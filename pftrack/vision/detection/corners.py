"""Corners: places of a picture that can be told from their surroundings in every direction.

Both detectors look at the structure of the gradients g = (gx, gy) in a small square, M = sum of g g^T with the entries
A, B, B, C.

- *eigenvalue* (Shi and Tomasi 1994): the smaller eigenvalue of M, the least contrast over all directions.
- *orientation*, after the corner orientation detector of Chabat, Yang and Hansell (1999), which Ichimura and Ikoma 2000
  use. They measure by single derivatives how far the structure has one direction, its anisotropism

      q = ((A - C)^2 + 4 B^2) / (A + C)^2,    1 for an edge, 0 where no direction is preferred,

  and take for corners what has a strong gradient but no direction: |g| (1 - q)^2. Ichimura and Ikoma 2000 only cite it,
  and report that it takes points of a slanted line for corners; the exponent and the square window are this project's
  reading, and the second half of the published method, from which directions edges run into a corner, is left out:
  matching does not need it.

A corner is a local maximum of the strength, of at least a share of the greatest, and far enough from stronger ones.
Sums of products of whole numbers are exact, and so are roots and quotients as IEEE 754 rounds them: the same corners to
the bit on every processor, which OpenCV's own list in single precision does not promise.
"""

import math
from typing import Literal, TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

from pftrack.core.arrays import Bools, Floats, Ints
from pftrack.core.model.parameters import Parameters, parameter

Detector: TypeAlias = Literal["eigenvalue", "orientation"]

GROUP = "Corners"
BAND_ROWS = 128


class DetectorParameters(Parameters, group=GROUP):
    """What counts as a corner."""

    # fmt: off
    corner_detector: Detector = parameter(
        "eigenvalue", "Detector",
        "By the smaller eigenvalue of the gradients (Shi and Tomasi), or by their lack of a direction (Chabat).",
        live=False)
    corner_count: int = parameter(
        60, "Most corners", "How many corners are followed at most, the strongest first.",
        within=(1, 400, 1), useful=(1, 200), live=False)
    corner_quality: float = parameter(
        0.05, "Least strength", "How strong a corner must be, as a share of the strongest one of the picture.",
        within=(0.001, 1, 0.001), useful=(0.001, 0.3), live=False)
    corner_distance_px: float = parameter(
        9, "Least distance", "How far corners are from each other at least.",
        unit="px", within=(1, 100, 1), useful=(1, 40), live=False)
    corner_window_px: int = parameter(
        5, "Window", "Side of the square over which gradients are summed.",
        unit="px", within=(3, 31, 2), live=False)
    corner_margin_px: int = parameter(
        12, "Margin", "How far corners are from the edge of the picture at least.",
        unit="px", within=(0, 200, 1), useful=(0, 60), live=False)
    # fmt: on


def find_corners(grey: NDArray[np.uint8], parameters: DetectorParameters, among: Bools | None = None) -> Floats:
    """Return corners (n, 2), (column, row) in px, the strongest first.

    Args:
        grey: Picture (height, width).
        parameters: What counts as a corner.
        among: (height, width) where there may be any; everywhere within the margin if None.
    """
    height, width = grey.shape
    margin = max(parameters.corner_margin_px, 1)
    if min(height, width) <= 2 * margin:
        return np.zeros((0, 2))
    values = strength(grey, parameters.corner_detector, parameters.corner_window_px)
    # On a level top of several pixels all are greatest; the order below keeps the first of them.
    tops = values >= cv2.dilate(values, np.ones((3, 3), np.uint8))
    tops &= (values >= parameters.corner_quality * values.max()) & (values > 0.0)
    inside = np.zeros_like(tops)
    inside[margin : height - margin, margin : width - margin] = True
    rows, columns = np.nonzero(tops & inside if among is None else tops & inside & among)
    order = np.argsort(-values[rows, columns], kind="stable")
    places = np.column_stack([columns, rows])[order]
    return _apart(places, grey.shape, parameters.corner_distance_px, parameters.corner_count)


def strength(grey: NDArray[np.uint8], detector: Detector, window_px: int) -> Floats:
    """Return how much of a corner each pixel is, (height, width), not negative.

    Args:
        grey: Picture (height, width).
        detector: What is measured.
        window_px: Side of the square over which gradients are summed, odd.
    """
    across, down = cv2.Sobel(grey, cv2.CV_16S, 1, 0), cv2.Sobel(grey, cv2.CV_16S, 0, 1)
    side = window_px, window_px
    sums = [
        cv2.boxFilter(cv2.multiply(one, other, dtype=cv2.CV_32S), cv2.CV_32S, side, normalize=False)
        for one, other in ((across, across), (across, down), (down, down))
    ]
    values = np.empty(grey.shape)
    # In bands, since all of a large picture in numbers of 64 bits, and again at every step, is gigabytes.
    for top in range(0, len(grey), BAND_ROWS):
        rows = slice(top, top + BAND_ROWS)
        a, b, c, gx, gy = (each[rows].astype(np.float64) for each in (*sums, across, down))
        directed = (a - c) * (a - c) + 4.0 * b * b
        if detector == "eigenvalue":
            values[rows] = np.maximum((a + c - np.sqrt(directed)) / 2.0, 0.0)
        else:
            total = np.maximum((a + c) * (a + c), 1.0)
            undirected = (total - directed) / total
            values[rows] = np.sqrt(gx * gx + gy * gy) * undirected * undirected
    return values


def _apart(places: Ints, shape: tuple[int, ...], distance_px: float, most: int) -> Floats:
    """Return those places, at most so many, that are as far from all that were taken before them."""
    reach = math.ceil(distance_px)
    steps = np.square(np.arange(-reach, reach + 1))
    far = steps[:, None] + steps >= distance_px * distance_px
    # With a rim, so that the surroundings of every place are within.
    free = np.ones((shape[0] + 2 * reach, shape[1] + 2 * reach), np.bool_)
    taken: list[tuple[int, int]] = []
    for x, y in places.tolist():
        if len(taken) == most:
            break
        if free[y + reach, x + reach]:
            taken.append((x, y))
            free[y : y + 2 * reach + 1, x : x + 2 * reach + 1] &= far
    return np.array(taken, np.float64).reshape(-1, 2)
