"""What is behind the hand, pixel by pixel: a model over the pictures of a recording."""

from collections.abc import Iterator

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from pftrack.core.model.parameters import revise
from pftrack.core.numerics.compiled import read_only
from pftrack.experiments.hand.recording import EVENTS
from pftrack.experiments.hand.shape import MODEL, open_pose, silhouette
from pftrack.experiments.hand.silhouette import (
    NORMAL_SD,
    Finding,
    SilhouetteParameters,
    backdrop_model,
    differs,
    doubtful,
    silhouette_of,
    suggest_parameters,
)

Picture = NDArray[np.uint8]
SIDE = 200
WOOD, SKIN = np.array([150.0, 105.0, 75.0]), np.array([224.0, 172.0, 138.0])


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
    return np.where(mask[..., None], SKIN + noise, wall(seed)).astype(np.uint8), mask


def test_the_median_and_its_deviation_are_those_of_each_pixel() -> None:
    """Of normal noise the deviation is that of the noise; a thing that passes by changes neither by much."""
    noise = np.random.default_rng(0).normal(100.0, 5.0, (25, 30, 40, 3)).astype(np.uint8)
    model = backdrop_model(Clip(*noise), 0, 1)
    assert (model.median_rgb == np.median(noise, axis=0)).all()
    assert model.sd_rgb.mean() == pytest.approx(5.0, rel=0.05)
    assert (model.sd_rgb % NORMAL_SD < 1e-4).mean() > 0.3  # whole grey levels of deviation
    passing = noise.copy()
    for place in range(25):
        passing[place, :, max(2 * place - 8, 0) : 2 * place] = 250
    assert backdrop_model(Clip(*passing), 0, 1).median_rgb.mean() == pytest.approx(model.median_rgb.mean(), abs=2.0)


def test_a_pixel_differs_by_so_much_or_by_four_deviations() -> None:
    """What varies by itself must differ by more, in one channel at least."""
    still, windy = np.full((10, 10, 3), 100, np.uint8), np.full((10, 10, 3), 100, np.uint8)
    windy[:, 5:, 1] = 80
    model = backdrop_model(Clip(still, windy, still, windy, np.full_like(still, 90)), 0, 1)
    assert np.unique(model.sd_rgb).round(3).tolist() == pytest.approx([0.0, 14.826], abs=1e-3)
    shown = still.copy()
    shown[..., 1] = 131
    away = differs(shown, model, 30)
    assert away[:, :5].all()
    assert not away[:, 5:].any()


@pytest.mark.parametrize("first", [4, 0])
def test_before_a_textured_wall_only_the_backdrop_tells_a_hand(first: int) -> None:
    """From pictures without the hand, or from a whole recording through which it moves; the border's colour fails."""
    if first:
        clip = Clip(*(wall(seed) for seed in range(first)), with_hand(9, 100.0)[0])
    else:
        clip = Clip(*(with_hand(seed, column)[0] for seed, column in enumerate(np.linspace(-60.0, 260.0, 13))))
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


def test_a_backdrop_is_suggested_where_nothing_else_tells_the_hand() -> None:
    """And not where the picture alone is enough; what then tells the hand is the model of the whole recording."""
    shown = [with_hand(seed, column)[0] for seed, column in enumerate(np.linspace(-60.0, 260.0, 13))]
    image, _ = with_hand(50, 100.0)
    assert suggest_parameters(image, Clip(*shown))["tells_by"] == "backdrop"
    dark = np.where(silhouette(open_pose((100.0, 137.0)), 50.0, MODEL, (SIDE, SIDE))[..., None], 220, 10)
    clip = Clip(*shown)
    assert suggest_parameters(dark.repeat(3, axis=2).astype(np.uint8), clip)["tells_by"] == "light"
    assert not clip.asked


def test_a_model_is_made_once_and_the_border_stands_in_where_there_is_none() -> None:
    """So live changes of other settings cost nothing, and simulated pictures have a silhouette as well."""
    clip = Clip(*(wall(seed) for seed in range(5)))
    settings = revise(SilhouetteParameters(), {"tells_by": "backdrop"})
    for seed in range(3):
        silhouette_of(read_only(with_hand(seed, 100.0)[0]), settings, clip)
    assert clip.asked == [0]
    image, _ = with_hand(0, 100.0)
    border = silhouette_of(image, revise(settings, {"tells_by": "background"}))
    assert np.array_equal(silhouette_of(image, settings).mask, border.mask)


@pytest.mark.parametrize("count", [1, 12])
def test_a_hand_that_never_moves_is_told_to_be_in_the_backdrop(count: int) -> None:
    """Of a clip of one picture as well: nothing differs, it is said why, and no backdrop is suggested."""
    clip = Clip(*(with_hand(seed, 100.0)[0] for seed in range(count)))
    given = revise(SilhouetteParameters(), {"tells_by": "backdrop", "smoothing_px": 3})
    found = silhouette_of(clip.shown[0], given, clip)
    assert found.finding is Finding.AS_BACKDROP
    assert not found.mask.any()
    assert suggest_parameters(clip.shown[0], clip)["tells_by"] != "backdrop"
    assert EVENTS[found.finding.value] == "no_hand"


def test_a_backdrop_is_in_doubt_where_a_hand_moves_a_little_in_every_picture() -> None:
    """Then what differs is a part of the hand, or of the wall that the median hides; one that passes by is clear."""
    columns = 100.0 + 24.0 * np.sin(np.arange(25.0))
    clip = Clip(*(with_hand(seed, column)[0] for seed, column in enumerate(columns)))
    given = revise(SilhouetteParameters(), {"tells_by": "backdrop", "smoothing_px": 3})
    image, mask = with_hand(50, 124.0)
    found = silhouette_of(image, given, clip)
    assert (found.mask != mask).mean() > 0.03
    assert found.finding is Finding.DOUBTFUL
    assert suggest_parameters(image, clip)["tells_by"] != "backdrop"
    passing = Clip(*(with_hand(seed, column)[0] for seed, column in enumerate(np.linspace(-60.0, 260.0, 25))))
    model = backdrop_model(passing, 0, 1)
    assert doubtful(model, 40)[mask].mean() < 0.07


def test_doubt_begins_where_fewer_than_seven_pictures_of_ten_agree() -> None:
    """In one channel at least, by as much as a pixel has to differ."""
    shown = np.full((10, 1, 10, 3), 100, np.uint8)
    for column in range(10):
        shown[:column, 0, column, 1] = 160
    model = backdrop_model(Clip(*shown), 0, 1)
    assert doubtful(model, 40)[0, :5].tolist() == [False, False, False, False, True]
    assert not doubtful(model, 70).any()
