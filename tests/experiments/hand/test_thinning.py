"""Skeletons and their free lines."""

from itertools import pairwise

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from pftrack.experiments.hand.silhouette import free_lines, skeleton

Mask = NDArray[np.uint8]


def lines(mask: Mask, least: float = 2.5) -> list[NDArray[np.int64]]:
    radii = np.asarray(cv2.distanceTransform(mask, cv2.DIST_L2, cv2.DIST_MASK_PRECISE), np.float32)
    pixels, begins = free_lines(skeleton(mask), radii, least)
    return [pixels[first:last] for first, last in pairwise(begins)]


def blobs(number: int) -> Mask:
    noise = np.random.default_rng(number).normal(size=(90, 120)).astype(np.float32)
    mask = np.asarray(cv2.GaussianBlur(noise, (0, 0), 5) > 0, np.uint8)
    mask[[0, -1]] = 0
    mask[:, [0, -1]] = 0
    return mask


def test_a_bar_becomes_its_middle_line() -> None:
    """Of a bar 9 px wide one row is left, nearly as long as the bar."""
    mask = np.zeros((40, 120), np.uint8)
    mask[15:24, 10:110] = 1
    thin = skeleton(mask)
    rows, columns = np.nonzero(thin[:, 20:100])
    assert (rows == 19).all()
    assert len(columns) == 80
    found = lines(mask)
    # Both ends are free, and the whole line belongs to either.
    assert len(found) == 2
    assert found[0][0].tolist() == found[1][-1].tolist()
    assert abs(len(found[0]) - 92) < 5


@pytest.mark.parametrize("number", range(3))
def test_thinning_keeps_what_is_connected(number: int) -> None:
    """As many parts and as many holes are left as there were, and no block of four pixels that could be thinner."""
    mask = blobs(number)
    thin = skeleton(mask)
    assert (thin <= mask).all()
    for connectivity, before, after in ((8, mask, thin), (4, 1 - mask, 1 - thin)):
        counts = [
            cv2.connectedComponents(np.asarray(each, np.uint8), connectivity=connectivity)[0]
            for each in (before, after)
        ]
        assert counts[0] == counts[1]
    blocks = thin[:-1, :-1] + thin[1:, :-1] + thin[:-1, 1:] + thin[1:, 1:]
    assert (blocks == 4).mean() < 0.001


@pytest.mark.parametrize("number", range(3))
def test_taking_lines_away_keeps_the_rest_connected(number: int) -> None:
    """The parts stay as many; every line that is left adds enough, unless it is all there is."""
    mask = blobs(number)
    radii = np.asarray(cv2.distanceTransform(mask, cv2.DIST_L2, cv2.DIST_MASK_PRECISE), np.float32)
    thin = skeleton(mask)
    pixels, begins = free_lines(thin, radii, 3.0)
    assert cv2.connectedComponents(thin)[0] == cv2.connectedComponents(mask)[0]
    for first, last in pairwise(begins):
        steps = np.abs(np.diff(pixels[first:last], axis=0)).max(axis=1)
        assert (steps == 1).all()
        column, row = pixels[last - 1]
        if thin[row - 1 : row + 2, column - 1 : column + 2].sum() > 2:
            away = np.hypot(*(pixels[last - 1] - pixels[first]))
            assert away + radii[pixels[first, 1], pixels[first, 0]] - radii[row, column] >= 3.0


def test_a_cross_has_four_lines_and_a_bump_none() -> None:
    """Lines run from the ends to where they meet; a bump of the edge adds too little."""
    mask = np.zeros((100, 100), np.uint8)
    mask[46:54, 10:90] = 1
    mask[10:90, 46:54] = 1
    mask[44:46, 20:24] = 1
    found = lines(mask)
    assert len(found) == 4
    ends = sorted(tuple(line[0]) for line in found)
    assert [max(abs(x - 50), abs(y - 50)) > 30 for x, y in ends] == [True] * 4
    assert all(np.hypot(*(line[-1] - 49.5)) < 5 for line in found)


@pytest.mark.parametrize("shape", [(3, 3), (3, 40), (12, 12)])
def test_an_empty_mask_and_a_full_one(shape: tuple[int, int]) -> None:
    """Nothing has no lines; all of a small picture becomes a line or a point."""
    assert lines(np.zeros(shape, np.uint8)) == []
    mask = np.zeros(shape, np.uint8)
    mask[1:-1, 1:-1] = 1
    assert skeleton(mask).sum() >= 1
    assert len(lines(mask)) <= 2
