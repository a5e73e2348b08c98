"""Silhouettes, and what cannot be a hand."""

from typing import Any

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from pftrack.core.model.parameters import revise
from pftrack.core.numerics.compiled import read_only
from pftrack.experiments.hand.fingers import features_of
from pftrack.experiments.hand.shape import MODEL, open_pose, silhouette
from pftrack.experiments.hand.silhouette import (
    Finding,
    SilhouetteParameters,
    contacts,
    silhouette_of,
    suggest_parameters,
)

Picture = NDArray[np.uint8]
SKIN, WALL = (224, 172, 138), (90, 110, 120)
DEFAULTS = SilhouetteParameters()


def hand(side: int = 200, ground: Any = (16, 20, 24), colour: Any = SKIN) -> tuple[Picture, NDArray[np.bool_]]:
    mask = silhouette(open_pose((side / 2, 0.685 * side)), 0.25 * side, MODEL, (side, side))
    return np.where(mask[..., None], np.array(colour, np.uint8), np.array(ground, np.uint8)), mask


def found(image: Picture, **values: object) -> Any:
    return silhouette_of(image, revise(DEFAULTS, values))


@pytest.mark.parametrize(
    ("values", "ground", "colour"),
    [
        ({"tells_by": "light"}, (16, 20, 24), SKIN),
        ({"tells_by": "dark"}, (230, 235, 225), (60, 40, 30)),
        ({"tells_by": "skin"}, WALL, SKIN),
        ({"tells_by": "skin"}, WALL, (92, 60, 42)),
        ({"tells_by": "background"}, WALL, SKIN),
    ],
)
def test_a_hand_is_told_from_the_rest(values: dict[str, object], ground: Any, colour: Any) -> None:
    """By brightness, by skin of any tone, and by what differs from the border, to the pixel."""
    image, mask = hand(ground=ground, colour=colour)
    seen = found(image, **values)
    assert seen.finding is Finding.CLEAR
    assert seen.reduction == 1
    assert np.array_equal(seen.mask, mask)


def test_what_cannot_be_a_hand_is_said_in_words() -> None:
    """Nothing, a flash, two hands, and a hand beyond the border; each has a sentence."""
    image, mask = hand()
    two = np.hstack([image, image[:, ::-1]])
    cut = np.roll(image, -45, axis=0)
    cut[150:] = image[150:]
    empty, full = np.zeros_like(image), np.full_like(image, 255)
    for picture, expected in ((empty, Finding.EMPTY), (full, Finding.FULL), (two, Finding.SEVERAL), (cut, Finding.CUT)):
        seen = found(picture)
        assert seen.finding is expected
        assert len(expected.value) > 20
        assert seen.mask.shape == tuple(side // seen.reduction for side in picture.shape[:2])
    speck = empty.copy()
    speck[50:58, 50:58] = 255
    assert found(speck).finding is Finding.EMPTY
    assert mask.any()


def test_smaller_things_beside_the_hand_are_left_out_and_pin_holes_filled() -> None:
    """Only the largest connected thing counts; a hole of a few pixels is none."""
    image, mask = hand()
    image[20:40, 10:30] = 255
    image[120:124, 100:104] = 0
    seen = found(image)
    assert seen.finding.ok
    assert np.array_equal(seen.mask, mask)
    image[105:120, 95:105] = 0
    assert found(image).mask.sum() == mask.sum() - 166


def test_large_pictures_are_made_smaller_by_a_whole_factor() -> None:
    """4,000 x 4,000 px come down to 250 x 250; places go to the picture and back."""
    image, mask = hand(1000)
    huge = np.repeat(np.repeat(image, 4, axis=0), 4, axis=1)
    seen = found(read_only(huge))
    assert seen.reduction == 16
    assert seen.mask.shape == (250, 250)
    small = cv2.resize(mask.astype(np.float32), (250, 250), interpolation=cv2.INTER_AREA) > 0.4
    assert (seen.mask != small).mean() < 0.01
    places = np.array([[0.0, 0.0], [249.0, 100.0]])
    assert seen.in_picture(places).tolist() == [[7.5, 7.5], [3991.5, 1607.5]]
    assert seen.in_mask(seen.in_picture(places)) == pytest.approx(places)


def test_features_of_the_last_pictures_are_kept() -> None:
    """The same read-only picture gives the same object; one that may be written is looked at again."""
    image, _ = hand()
    settings = DEFAULTS
    assert features_of(read_only(image), settings) is not features_of(image, settings)
    kept = read_only(image)
    assert features_of(kept, settings) is features_of(kept, settings)


def test_contacts_are_counted_around_the_border() -> None:
    """One through a corner is one; gaps of a few pixels do not count; all around is one."""
    mask = np.zeros((40, 60), np.bool_)
    assert contacts(mask).tolist() == []
    mask[:5, :7] = True
    assert contacts(mask).tolist() == [11]
    mask[39, [30, 31, 34, 35]] = True
    assert sorted(contacts(mask).tolist()) == [6, 11]
    mask[20:25, 59] = True
    assert len(contacts(mask)) == 3
    assert contacts(np.ones((40, 60), np.bool_)).tolist() == [196]


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


def test_before_a_wall_of_many_colours_skin_is_suggested() -> None:
    """Where brightness does not fall into two classes."""
    wall = np.linspace(40, 240, 200)[None, :, None] * np.array([0.8, 1.0, 1.0])
    _, mask = hand()
    image = np.where(mask[..., None], SKIN, np.broadcast_to(wall, (200, 200, 3))).astype(np.uint8)
    values = suggest_parameters(image)
    assert values["tells_by"] == "skin"
    assert (found(image, **values).mask != mask).mean() < 0.02


def test_a_plain_picture_gets_a_suggestion_as_well() -> None:
    """Without anything in it there is nothing to tell, and nothing breaks."""
    for level in (0, 128, 255):
        image = np.full((60, 80, 3), level, np.uint8)
        assert not found(image, **suggest_parameters(image)).finding.ok
