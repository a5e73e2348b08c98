"""Silhouettes of hands: told from the rest, from a backdrop, and thinned to lines."""

from collections.abc import Iterator
from itertools import pairwise
from typing import Any

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from pftrack.core.model.parameters import revise
from pftrack.core.numerics.compiled import read_only
from pftrack.experiments.hand import silhouette as masks
from pftrack.experiments.hand.fingers import features_in
from pftrack.experiments.hand.recording import EVENTS
from pftrack.experiments.hand.shape import MODEL, open_pose, silhouette
from pftrack.experiments.hand.silhouette import (
    Finding,
    Silhouette,
    SilhouetteParameters,
    silhouette_of,
    suggest_parameters,
)

Picture = NDArray[np.uint8]
SKIN, WALL = (224, 172, 138), (90, 110, 120)
DEFAULTS = SilhouetteParameters()


def hand(ground: Any = (16, 20, 24), colour: Any = SKIN) -> tuple[Picture, NDArray[np.bool_]]:
    mask = silhouette(open_pose((100.0, 137.0)), 50.0, MODEL, (200, 200))
    return np.where(mask[..., None], np.array(colour, np.uint8), np.array(ground, np.uint8)), mask


def found(image: Picture, **values: object) -> Any:
    return silhouette_of(image, revise(DEFAULTS, values))


@pytest.mark.parametrize(
    ("tells_by", "ground", "colour"),
    [
        ("light", (16, 20, 24), SKIN),
        ("dark", (230, 235, 225), (60, 40, 30)),
        ("skin", WALL, SKIN),
        ("skin", WALL, (92, 60, 42)),
        ("background", WALL, SKIN),
    ],
)
def test_a_hand_is_told_from_the_rest(tells_by: str, ground: Any, colour: Any) -> None:
    """By brightness, by skin of any tone, and by what differs from the border, to the pixel."""
    image, mask = hand(ground=ground, colour=colour)
    seen = found(image, tells_by=tells_by)
    assert (seen.finding, seen.reduction) == (Finding.CLEAR, 1)
    assert np.array_equal(seen.mask, mask)


def test_unusable_pictures_have_a_finding_in_words() -> None:
    """Nothing, a speck, a flash, two hands and a hand beyond the border have a sentence each, and no features."""
    image, _ = hand()
    empty, cut = np.zeros_like(image), np.roll(image, -45, axis=0)
    speck = empty.copy()
    speck[50:58, 50:58], cut[150:] = 255, image[150:]
    cases = [(empty, Finding.EMPTY), (speck, Finding.EMPTY), (np.full_like(image, 255), Finding.FULL)]
    cases += [(np.hstack([image, image[:, ::-1]]), Finding.SEVERAL), (cut, Finding.CUT)]
    for picture, expected in cases:
        seen = found(picture)
        assert seen.finding is expected
        assert len(expected.value) > 20
        assert seen.mask.shape == tuple(side // seen.reduction for side in picture.shape[:2])
        features = features_in(Silhouette(np.ones((40, 40), np.bool_), 1, expected))
        assert (features.protrusions, features.wrist, features.finding) == ((), None, expected)


def test_smaller_things_beside_the_hand_are_left_out_and_pin_holes_filled() -> None:
    """Only the largest connected region counts, and holes of a few pixels are filled."""
    image, mask = hand()
    image[20:40, 10:30] = 255
    image[120:124, 100:104] = 0
    seen = found(image)
    assert seen.finding.ok
    assert np.array_equal(seen.mask, mask)
    image[105:120, 95:105] = 0
    assert found(image).mask.sum() == mask.sum() - 166


def test_contacts_are_counted_around_the_border() -> None:
    """A contact around a corner is one, and gaps of a few pixels do not split it."""
    mask = np.zeros((40, 60), np.bool_)
    mask[:5, :7] = mask[39, [30, 31, 34, 35]] = True
    assert sorted(masks.contacts(mask).tolist()) == [6, 11]


@pytest.mark.parametrize(
    ("ground", "colour", "tells_by"),
    [((0, 0, 0), (120, 120, 120), "light"), ((240, 240, 240), (70, 50, 40), "dark")],
)
def test_a_suggestion_tells_the_hand(ground: Any, colour: Any, tells_by: str) -> None:
    """Brightness where that is enough, with a level that leaves a hand its shadows."""
    image, mask = hand(ground=ground, colour=colour)
    values = suggest_parameters(image)
    assert values["tells_by"] == tells_by
    assert (found(image, **values).mask != mask).mean() < 0.005
    image[mask & (np.arange(200) < 90)] = (60, 60, 60) if tells_by == "light" else (150, 140, 130)
    assert (found(image, **suggest_parameters(image)).mask != mask).mean() < 0.005


def test_skin_is_suggested_before_a_wall_of_many_colours() -> None:
    """Brightness has no two classes there; in a plain picture no suggestion finds a hand."""
    wall = np.linspace(40, 240, 200)[None, :, None] * np.array([0.8, 1.0, 1.0])
    _, mask = hand()
    image = np.where(mask[..., None], SKIN, np.broadcast_to(wall, (200, 200, 3))).astype(np.uint8)
    values = suggest_parameters(image)
    assert values["tells_by"] == "skin"
    assert (found(image, **values).mask != mask).mean() < 0.02
    for level in (0, 128, 255):
        plain = np.full((60, 80, 3), level, np.uint8)
        assert not found(plain, **suggest_parameters(plain)).finding.ok


# The backdrop of a hand, pixel by pixel: a model over the pictures of a recording.

SIDE = 200
WOOD, BACKDROP_SKIN = np.array([150.0, 105.0, 75.0]), np.array([224.0, 172.0, 138.0])


class Clip:
    """Pictures that are there."""

    def __init__(self, *shown: Picture) -> None:
        self.shown = shown
        self.asked: list[int] = []

    def pictures(self, first: int) -> Iterator[Picture]:
        self.asked.append(first)
        return iter(self.shown[: first or len(self.shown)])


def wall(seed: int) -> Picture:
    """Return boards of wood, lighter and darker, which has the colours of skin, with noise of 3 grey levels."""
    boards = np.random.default_rng(1).uniform(0.1, 1.1, (SIDE // 8, SIDE // 8)).astype(np.float32)
    shade = cv2.resize(boards, (SIDE, SIDE), interpolation=cv2.INTER_NEAREST)
    noise = np.random.default_rng(seed).normal(0.0, 3.0, (SIDE, SIDE, 3))
    return np.clip(shade[..., None] * WOOD + noise, 0, 255).astype(np.uint8)


def with_hand(seed: int, column: float) -> tuple[Picture, NDArray[np.bool_]]:
    mask = silhouette(open_pose((column, 137.0)), 50.0, MODEL, (SIDE, SIDE))
    noise = np.random.default_rng(100 + seed).normal(0.0, 3.0, (SIDE, SIDE, 3))
    return np.where(mask[..., None], BACKDROP_SKIN + noise, wall(seed)).astype(np.uint8), mask


def moving(columns: NDArray[np.float64]) -> Clip:
    return Clip(*(with_hand(seed, column)[0] for seed, column in enumerate(columns)))


PASSING = np.linspace(-60.0, 260.0, 13)
"""Columns of a hand that moves through the whole picture."""


def test_the_median_and_its_deviation_are_those_of_each_pixel() -> None:
    """The deviation is that of normal noise."""
    noise = np.random.default_rng(0).normal(100.0, 5.0, (25, 30, 40, 3)).astype(np.uint8)
    model = masks.backdrop_model(Clip(*noise), 0, 1)
    assert (model.median_rgb == np.median(noise, axis=0)).all()
    assert model.sd_rgb.mean() == pytest.approx(5.0, rel=0.05)
    assert (model.sd_rgb % masks.NORMAL_SD < 1e-4).mean() > 0.3  # deviations are whole grey levels


@pytest.mark.parametrize("first", [4, 0])
def test_before_a_textured_wall_only_the_backdrop_tells_a_hand(first: int) -> None:
    """The model comes from pictures without the hand, or from a recording through which it moves."""
    clip = Clip(*(wall(seed) for seed in range(first)), with_hand(9, 100.0)[0]) if first else moving(PASSING)
    image, mask = with_hand(50, 100.0)
    seen = {}
    for way in ("light", "background", "skin", "backdrop"):
        given = revise(SilhouetteParameters(), {"tells_by": way, "backdrop_frames": first, "smoothing_px": 3})
        seen[way] = silhouette_of(image, given, clip)
    assert seen["backdrop"].finding is Finding.CLEAR
    assert (seen["backdrop"].mask != mask).mean() < 0.01
    for way in ("background", "skin"):
        assert not seen[way].finding.ok or (seen[way].mask != mask).mean() > 0.1, way
    assert clip.asked[-1] == first


def test_a_backdrop_is_suggested_if_nothing_else_separates_the_hand() -> None:
    """It is not suggested if a single picture is enough."""
    clip, (bright, _) = moving(PASSING), hand(ground=(10, 10, 10), colour=(220, 220, 220))
    assert suggest_parameters(bright, clip)["tells_by"] == "light"
    assert not clip.asked
    assert suggest_parameters(with_hand(50, 100.0)[0], clip)["tells_by"] == "backdrop"


def test_a_backdrop_model_is_made_once() -> None:
    """Live changes of other settings cost nothing; pictures without a recording fall back to the border's colour."""
    clip, settings = Clip(*(wall(seed) for seed in range(5))), revise(DEFAULTS, {"tells_by": "backdrop"})
    for seed in range(3):
        silhouette_of(read_only(with_hand(seed, 100.0)[0]), settings, clip)
    assert clip.asked == [0]
    image, _ = with_hand(0, 100.0)
    assert np.array_equal(silhouette_of(image, settings).mask, found(image, tells_by="background").mask)


@pytest.mark.parametrize("count", [1, 12])
def test_a_hand_that_never_moves_is_part_of_the_backdrop(count: int) -> None:
    """The finding gives this reason, and no backdrop is suggested; this includes a clip of one picture."""
    clip = moving(np.full(count, 100.0))
    given = revise(SilhouetteParameters(), {"tells_by": "backdrop", "smoothing_px": 4})  # 5: a median's side is odd
    found = silhouette_of(clip.shown[0], given, clip)
    assert found.finding is Finding.AS_BACKDROP
    assert not found.mask.any()
    assert suggest_parameters(clip.shown[0], clip)["tells_by"] != "backdrop"
    assert EVENTS[found.finding.value] == "no_hand"


def test_a_backdrop_is_in_doubt_if_the_hand_moves_too_little() -> None:
    """Then a part of the hand or of the wall differs from the median; a hand that passes by leaves no doubt."""
    clip = moving(100.0 + 24.0 * np.sin(np.arange(25.0)))
    given = revise(SilhouetteParameters(), {"tells_by": "backdrop", "smoothing_px": 3})
    image, mask = with_hand(50, 124.0)
    found = silhouette_of(image, given, clip)
    assert (found.mask != mask).mean() > 0.03
    assert found.finding is Finding.DOUBTFUL
    assert suggest_parameters(image, clip)["tells_by"] != "backdrop"
    assert masks.doubtful(masks.backdrop_model(moving(np.linspace(-60.0, 260.0, 25)), 0, 1), 40)[mask].mean() < 0.07


# Skeletons and their free lines.

Mask = NDArray[np.uint8]


def lines(mask: Mask, least: float = 2.5) -> list[NDArray[np.int64]]:
    radii = np.asarray(cv2.distanceTransform(mask, cv2.DIST_L2, cv2.DIST_MASK_PRECISE), np.float32)
    pixels, begins = masks.free_lines(masks.skeleton(mask), radii, least)
    return [pixels[first:last] for first, last in pairwise(begins)]


def blobs(number: int) -> Mask:
    noise = np.random.default_rng(number).normal(size=(90, 120)).astype(np.float32)
    mask = np.asarray(cv2.GaussianBlur(noise, (0, 0), 5) > 0, np.uint8)
    mask[[0, -1]] = 0
    mask[:, [0, -1]] = 0
    return mask


@pytest.mark.parametrize("number", range(3))
def test_thinning_keeps_connections(number: int) -> None:
    """The skeleton has as many parts and holes as the mask and no block of four pixels.

    The numbers of parts stay when lines are removed; each remaining line is long enough, unless it is the whole part.
    """
    mask = blobs(number)
    thin = masks.skeleton(mask)
    assert (thin <= mask).all()
    for connectivity, before, after in ((8, mask, thin), (4, 1 - mask, 1 - thin)):
        counts = [cv2.connectedComponents(each, connectivity=connectivity)[0] for each in (before, after)]
        assert counts[0] == counts[1]
    blocks = thin[:-1, :-1] + thin[1:, :-1] + thin[:-1, 1:] + thin[1:, 1:]
    assert (blocks == 4).mean() < 0.001
    radii = np.asarray(cv2.distanceTransform(mask, cv2.DIST_L2, cv2.DIST_MASK_PRECISE), np.float32)
    pixels, begins = masks.free_lines(thin, radii, 3.0)
    assert cv2.connectedComponents(thin)[0] == cv2.connectedComponents(mask)[0]
    for first, last in pairwise(begins):
        assert (np.abs(np.diff(pixels[first:last], axis=0)).max(axis=1) == 1).all()
        column, row = pixels[last - 1]
        if thin[row - 1 : row + 2, column - 1 : column + 2].sum() > 2:
            away = np.hypot(*(pixels[last - 1] - pixels[first]))
            assert away + radii[pixels[first, 1], pixels[first, 0]] - radii[row, column] >= 3.0


def test_a_cross_has_four_lines_and_a_bump_none() -> None:
    """Lines run along the middles of the bars to their crossing; a bump of the edge is too short for a line."""
    mask = np.zeros((100, 100), np.uint8)
    mask[46:54, 10:90] = mask[10:90, 46:54] = mask[44:46, 20:24] = 1
    assert {*np.nonzero(masks.skeleton(mask)[:, 60:80])[0]} <= {49, 50}
    found = lines(mask)
    assert len(found) == 4
    assert all(np.abs(line[0] - 50).max() > 30 for line in found)
    assert all(np.hypot(*(line[-1] - 49.5)) < 5 for line in found)
